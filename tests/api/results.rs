//! Stored reports: the latest one of each camera, and earlier ones.

use std::num::NonZeroUsize;

use axum::{body::Body, http::Request};
use bytes::Bytes;
use jiff::Timestamp;
use lookdown::results::{NewReport, ReportId, ResultLimits};
use serde_json::{Value, json};

use crate::service::{Answer, Bounds, Service, frame};

/// A report that consists of a number.
pub(crate) fn report(camera: &str, number: usize) -> NewReport {
    NewReport {
        camera: camera.to_owned(),
        received_at: "2026-11-21T09:30:00Z".parse().unwrap(),
        persons: number,
        scores: Some(vec![0.9; number]),
        json: Bytes::from(number.to_string()),
    }
}

impl Service {
    /// Publishes a report that consists of a number.
    pub(crate) fn publish(&self, camera: &str, number: usize) -> ReportId {
        self.results.store(report(camera, number), None).id
    }

    pub(crate) async fn get_if_none_match(&self, path: &str, tag: &str) -> Answer {
        let request = Request::get(path).header("if-none-match", tag);
        self.send(request.body(Body::empty()).unwrap()).await
    }
}

#[tokio::test]
async fn the_latest_report_has_the_bytes_of_the_response() {
    let service = Service::start();
    let path = "/results/hall/latest";
    let query = "calibration=lobby&profile=fast&camera=hall";
    let sent = service.post_raw(query, frame()).await;
    let kept = service.get(path).await;
    assert_eq!((kept.status.as_u16(), &kept.body), (200, &sent.body));
    assert_eq!(kept.header("content-type"), "application/json");
    assert_eq!(kept.header("cache-control"), "no-cache");
    let tag = kept.header("etag").to_owned();
    for (asked, status) in [(&*tag, 304), ("*", 304), ("\"1\"", 200), ("x", 400)] {
        let answer = service.get_if_none_match(path, asked).await;
        assert_eq!(answer.status, status, "{asked}");
        if status == 304 {
            assert_eq!((answer.header("etag"), answer.body.len()), (&*tag, 0));
            assert_eq!(answer.header("cache-control"), "no-cache");
        }
    }
    let newer = service.post_raw(query, frame()).await;
    let answer = service.get_if_none_match(path, &tag).await;
    assert_eq!((answer.status.as_u16(), answer.body), (200, newer.body));
}

#[tokio::test]
async fn the_camera_name_defaults_to_the_calibration_id() {
    let service = Service::start();
    for query in [
        "profile=fast&store=true",
        "profile=fast&calibration=lobby",
        "profile=fast&camera=hall",
    ] {
        let answer = service.post_raw(query, frame()).await;
        assert_eq!(answer.status, 200, "{}", answer.text());
    }
    assert_eq!(
        service
            .post_raw("sigma=0&camera=missing", frame())
            .await
            .status,
        422
    );
    let list = service.get("/results").await;
    assert_eq!(list.header("cache-control"), "no-cache");
    let tag = list.header("etag").to_owned();
    let known = [("If-None-Match", &*tag)];
    let again = service.ask("GET", "/results", &known).await;
    assert_eq!((again.status.as_u16(), again.header("etag")), (304, &*tag));
    let list = list.json();
    let cameras: Vec<_> = list
        .as_array()
        .unwrap()
        .iter()
        .map(|row| &row["camera"])
        .collect();
    assert_eq!(cameras, ["assumed", "hall", "lobby"]);
    let latest = service.get("/results/hall/latest").await;
    let (row, report) = (&list[1], latest.json());
    assert_eq!(row["id"].to_string(), latest.header("etag"));
    assert_eq!(row["received_at"], report["received_at"]);
    assert_eq!(row["persons"], report["persons"].as_array().unwrap().len());
    let age = row["age_seconds"].as_f64().unwrap();
    assert!((0.0..60.0).contains(&age), "{age}");
    service.post_raw("camera=hall", frame()).await;
    let newer = service.ask("GET", "/results", &known).await;
    assert_eq!(newer.status, 200);
}

#[tokio::test]
async fn a_camera_without_reports_is_404_with_a_remedy() {
    let service = Service::start();
    assert_eq!(service.get("/results").await.json(), json!([]));
    for path in [
        "/results/hall/latest",
        "/results/hall/history",
        "/results/%FF/latest",
        "/results/%FF/events",
    ] {
        let answer = service.get(path).await;
        assert_eq!(answer.status, 404, "{path}");
        let problem = answer.problem();
        assert_eq!(problem["type"], "/problems/unknown-camera");
        assert!(problem["detail"].as_str().unwrap().contains("/results"));
    }
}

#[tokio::test]
async fn every_valid_camera_name_works_in_the_path() {
    let service = Service::start();
    let query = "calibration=lobby&profile=fast&camera=hall%2Fnorth%20%C3%A9";
    let sent = service.post_raw(query, frame()).await;
    assert_eq!(sent.json()["camera"], "hall/north é");
    let kept = service.get("/results/hall%2Fnorth%20%C3%A9/latest").await;
    assert_eq!(kept.body, sent.body);
}

/// Returns the reports of a response, which are numbers, and the ID of the last one.
fn page(answer: &Answer) -> (Vec<u64>, Option<String>) {
    assert_eq!(answer.status, 200, "{}", answer.text());
    assert_eq!(answer.header("content-type"), "application/json");
    let page = answer.json();
    let rows = page.as_array().unwrap();
    let last = rows
        .last()
        .map(|row| row["id"].as_str().unwrap().to_owned());
    let reports = rows.iter().map(|row| row["report"].as_u64().unwrap());
    (reports.collect(), last)
}

#[tokio::test]
async fn history_is_read_page_by_page() {
    let service = Service::start();
    for number in 0..5 {
        service.publish("lobby", number);
        service.publish("hall", 100);
    }
    let path = "/results/lobby/history";
    assert_eq!(page(&service.get(path).await).0, [0, 1, 2, 3, 4]);
    let (mut seen, mut since) = (Vec::new(), "0".to_owned());
    loop {
        let answer = service.get(&format!("{path}?limit=2&since={since}")).await;
        let (reports, last) = page(&answer);
        assert!(reports.len() <= 2);
        seen.extend(reports);
        let Some(last) = last else { break };
        since = last;
    }
    assert_eq!(seen, [0, 1, 2, 3, 4]);
}

#[tokio::test]
async fn history_begins_after_a_time_or_an_id() {
    let service = Service::start();
    let id = service.publish("lobby", 1);
    let since = async |time: Timestamp| {
        let path = format!("/results/lobby/history?since={time}");
        page(&service.get(&path).await).0
    };
    let moment = jiff::SignedDuration::from_micros(1);
    assert_eq!(since(id.time() - moment).await, [1]);
    assert_eq!(since(id.time()).await, [0; 0]);
    assert_eq!(since(Timestamp::UNIX_EPOCH).await, [1]);
}

#[tokio::test]
async fn invalid_history_parameters_are_refused_by_name() {
    let service = Service::start();
    service.publish("lobby", 1);
    for (query, status, part) in [
        ("since=yesterday", 422, "since: \"yesterday\""),
        ("since=", 422, "since"),
        ("limit=0", 422, "limit"),
        ("limit=1001", 422, "1 to 1000"),
        ("until=1", 400, "until: there is no such parameter"),
        ("limit=1&limit=2", 400, "twice"),
    ] {
        let answer = service
            .get(&format!("/results/lobby/history?{query}"))
            .await;
        assert_eq!(answer.status, status, "{query}");
        let problem = answer.problem();
        assert!(
            problem["detail"].as_str().unwrap().contains(part),
            "{problem}"
        );
    }
}

#[tokio::test]
async fn a_page_of_large_reports_ends_early() {
    let service = Service::start();
    for _ in 0..3 {
        let report = NewReport {
            camera: "lobby".to_owned(),
            received_at: Timestamp::UNIX_EPOCH,
            persons: 0,
            scores: None,
            json: Bytes::from(format!("\"{}\"", "x".repeat(3 << 20))),
        };
        service.results.store(report, None);
    }
    let answer = service.get("/results/lobby/history").await.json();
    assert_eq!(answer.as_array().unwrap().len(), 2);
}

#[tokio::test]
async fn the_limits_bound_the_stored_reports() {
    let count = |number| NonZeroUsize::new(number).unwrap();
    let service = Service::within(&Bounds {
        results: ResultLimits {
            max_cameras: count(2),
            history_per_camera: count(3),
            ..ResultLimits::default()
        },
        ..Bounds::default()
    });
    for (camera, number) in [("a", 1), ("b", 2), ("b", 3), ("b", 4), ("b", 5), ("c", 6)] {
        service.publish(camera, number);
    }
    assert_eq!(service.get("/results/a/latest").await.status, 404);
    let history = service.get("/results/b/history").await;
    assert_eq!(page(&history).0, [3, 4, 5]);
    let list = service.get("/results").await.json();
    let persons: Vec<_> = list
        .as_array()
        .unwrap()
        .iter()
        .map(|row| &row["frame_persons"])
        .collect();
    assert_eq!(persons, [&Value::from(5), &Value::from(6)]);
    let metrics = service.get("/metrics").await.text();
    for line in [
        "lookdown_results_cameras 2",
        "lookdown_results_reports 4",
        "lookdown_results_stored_total 6",
        "lookdown_results_listeners 0",
    ] {
        assert!(
            metrics.lines().any(|reported| reported == line),
            "{line}: {metrics}"
        );
    }
}

#[tokio::test]
async fn deleted_results_are_gone_until_the_next_frame() {
    let service = Service::within(&Bounds {
        camera_metrics: true,
        ..Bounds::default()
    });
    let query = "calibration=lobby&profile=fast&camera=hall";
    let delete = async |path| service.ask("DELETE", path, &[]).await;
    assert_eq!(delete("/results/hall").await.status, 404);
    let shown = async || {
        let metrics = service.get("/metrics").await.text();
        let row = |name| metrics.contains(&format!("lookdown_camera_{name}{{camera=\"hall\"}} "));
        [row("persons"), row("last_report_timestamp_seconds")]
    };
    for _ in 0..2 {
        let sent = service.post_raw(query, frame()).await.json();
        let latest = service.get("/results/hall/latest").await;
        assert_eq!(latest.json()["request_id"], sent["request_id"]);
        assert_eq!(shown().await, [true, true]);
        assert_eq!(delete("/results/hall").await.status, 204);
        assert_eq!(service.get("/results/hall/latest").await.status, 404);
        assert_eq!(service.get("/results").await.json(), json!([]));
        assert_eq!(shown().await, [false, false]);
    }
}
