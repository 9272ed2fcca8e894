//! A running server whose calibrations are in a bucket.

use std::net::TcpListener;

use crate::buckets::{
    s3_server::{S3Server, SECRET},
    service::{Service, command},
};

fn native(id: &str, focal: f64) -> String {
    format!(
        r#"{{"id":"{id}","image":{{"width":600,"height":600}},
            "lens":{{"model":"equidistant","focal":{focal},"cx":299.5,"cy":299.5}}}}"#
    )
}

/// Returns true if a response holds the native file of a lens of this focal length.
fn has_focal(answer: &str, focal: f64) -> bool {
    let body = answer.split_once("\r\n\r\n").unwrap().1;
    let native: serde_json::Value = serde_json::from_str(body).unwrap();
    native["lens"]["focal"] == focal
}

#[test]
fn calibrations_are_read_again_only_when_they_change() {
    let s3 = S3Server::start();
    s3.put("lobby.json", &native("lobby", 190.0));
    let service = Service::start(s3.address);
    assert!(has_focal(&service.get("/calibrations/lobby"), 190.0));

    let put = service.send(
        "PUT",
        "/calibrations/yard",
        "If-None-Match: *\r\n",
        &native("yard", 150.0),
    );
    assert!(put.starts_with("HTTP/1.1 201"), "{put}");
    let stored = service.get("/calibrations/yard");
    let bucket = s3.store();
    let content =
        lookdown::calibration_store::CalibrationStore::read(&bucket, &["yard.json"], 10_000);
    assert!(stored.ends_with(std::str::from_utf8(content[0].as_ref().unwrap()).unwrap()));
    let again = service.send(
        "PUT",
        "/calibrations/yard",
        "If-None-Match: *\r\n",
        &native("yard", 151.0),
    );
    assert!(again.starts_with("HTTP/1.1 412"), "{again}");
    let tag = stored
        .lines()
        .find_map(|line| line.strip_prefix("etag: "))
        .unwrap();
    let condition = format!("If-Match: {tag}\r\n");
    let replaced = service.send(
        "PUT",
        "/calibrations/yard",
        &condition,
        &native("yard", 152.0),
    );
    assert!(replaced.starts_with("HTTP/1.1 200"), "{replaced}");

    s3.put("lobby.json", &native("lobby", 191.0));
    service.wait_for("/calibrations/lobby", |answer| has_focal(answer, 191.0));
    s3.put("lobby.json", "{");
    let ready = service.wait_for("/readyz", |answer| answer.contains("lobby.json"));
    assert!(ready.starts_with("HTTP/1.1 200"), "{ready}");
    assert!(has_focal(&service.get("/calibrations/lobby"), 191.0));

    let deleted = service.send("DELETE", "/calibrations/yard", &condition, "");
    assert!(deleted.starts_with("HTTP/1.1 412"), "{deleted}");
    let deleted = service.send("DELETE", "/calibrations/yard", "", "");
    assert!(deleted.starts_with("HTTP/1.1 204"), "{deleted}");
    assert!(
        service
            .get("/calibrations/yard")
            .starts_with("HTTP/1.1 404")
    );
    // At the start, after the change, and invalid.
    let log = s3.log();
    let looks = log.matches("GET /cameras?").count();
    let downloads = log.matches("GET /cameras/ceiling/lobby.json").count();
    assert!(downloads == 3 && looks > downloads, "{log}");
}

#[test]
fn the_last_calibrations_are_used_during_an_outage() {
    let s3 = S3Server::start();
    s3.put("lobby.json", &native("lobby", 190.0));
    let service = Service::start(s3.address);
    let address = s3.address;
    drop(s3);
    let expected = "store_problem\":\"s3://cameras/ceiling cannot be reached: Connection refused";
    let ready = service.wait_for("/readyz", |answer| answer.contains(expected));
    assert!(ready.starts_with("HTTP/1.1 200"), "{ready}");
    assert!(
        service
            .get("/metrics")
            .contains("lookdown_calibration_store_up 0")
    );
    assert!(has_focal(&service.get("/calibrations/lobby"), 190.0));
    let refused = service.send("PUT", "/calibrations/yard", "", &native("yard", 150.0));
    assert!(refused.starts_with("HTTP/1.1 503"), "{refused}");
    assert!(refused.contains("calibrations-unreachable"), "{refused}");

    let s3 = S3Server::at(address);
    s3.put("lobby.json", &native("lobby", 191.0));
    service.wait_for("/calibrations/lobby", |answer| has_focal(answer, 191.0));
    service.wait_for("/metrics", |answer| {
        answer.contains("lookdown_calibration_store_up 1")
    });
    let log = service.log_with("can be read again");
    let reported = log
        .lines()
        .filter_map(|line| line.split_once("the loaded ones stay in use: "));
    let mut problems: Vec<_> = reported.map(|(_, problem)| problem).collect();
    let count = problems.len();
    problems.sort_unstable();
    problems.dedup();
    // Refused, disconnected, and a new server without the bucket are different problems.
    assert!(count > 0 && problems.len() == count, "logged again: {log}");
    assert!(
        !log.contains(SECRET) && !log.contains("backing off"),
        "{log}"
    );
}

#[test]
fn an_unreachable_bucket_ends_the_start_with_a_sentence() {
    let closed = TcpListener::bind("127.0.0.1:0")
        .unwrap()
        .local_addr()
        .unwrap();
    let output = command(closed).output().unwrap();
    assert!(!output.status.success());
    let said = String::from_utf8(output.stderr).unwrap();
    let sentence = "calibrations.path: s3://cameras/ceiling cannot be reached: Connection refused";
    assert!(said.contains(sentence), "{said}");
    assert!(
        said.trim_end().lines().count() == 1 && !said.contains(SECRET),
        "{said}"
    );
}
