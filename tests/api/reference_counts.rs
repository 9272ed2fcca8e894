//! The numbers of persons that people give for frames of a camera.

use serde_json::{Value, json};

use crate::service::Service;

const PATH: &str = "/cameras/hall/reference-counts";

fn at(report: impl std::fmt::Display) -> String {
    format!("{PATH}/{report}")
}

async fn row(service: &Service) -> Value {
    service.get("/results").await.json()[0].clone()
}

#[tokio::test]
async fn five_reference_counts_teach_the_number() {
    let service = Service::start();
    for number in 1..6 {
        let list = service.publish("hall", number);
        // One person of each frame has no box.
        let body = json!({"persons": number + 1}).to_string();
        assert_eq!(service.put(&at(list), &body).await.status, 201);
        assert_eq!(service.put(&at(list), &body).await.status, 204);
    }
    let list = service.get(PATH).await.json();
    assert_eq!(list["counts"].as_array().unwrap().len(), 5);
    assert_eq!(list["counts"][4]["persons"], 6);
    assert!(list["score_threshold"].is_f64(), "{list}");
    service
        .results
        .store(crate::results::report("hall", 20), None);
    let taught = row(&service).await;
    assert_eq!(taught["persons_source"], "taught");
    let bar = ["persons_low", "persons", "persons_high"].map(|name| taught[name].as_u64().unwrap());
    assert!(bar.is_sorted(), "{taught}");
    let history = service.get("/results/hall/history").await.json();
    assert_eq!(history[5]["persons_high"], taught["persons_high"]);
    let report = list["counts"][0]["report"].as_str().unwrap();
    assert_eq!(service.ask("DELETE", &at(report), &[]).await.status, 204);
    assert_eq!(service.ask("DELETE", &at(report), &[]).await.status, 404);
    assert_eq!(row(&service).await["persons_source"], "median");
}

#[tokio::test]
async fn unusable_reference_count_is_refused_with_its_reason() {
    let service = Service::start();
    assert_eq!(service.get(PATH).await.status, 404);
    let known = service.publish("hall", 3);
    let list = service.get(PATH).await.json();
    assert_eq!(
        (&list["counts"], &list["moment"]),
        (&json!([]), &json!("few"))
    );
    let known = at(known);
    for (path, body, status, reason) in [
        (
            &*known,
            r#"{"persons": 1001}"#,
            422,
            "persons: 1001 is more than 1000",
        ),
        (&*known, r#"{"persons": -1}"#, 422, "persons: "),
        (
            &*known,
            r#"{"persons": 1, "people": 1}"#,
            422,
            "people: there is no such field",
        ),
        (
            &*at("1"),
            r#"{"persons": 1}"#,
            404,
            "report: \"1\" is not stored",
        ),
        (
            &*at("x"),
            r#"{"persons": 1}"#,
            404,
            "report: \"x\" is not stored",
        ),
        (
            "/cameras/gate/reference-counts/1",
            r#"{"persons": 1}"#,
            404,
            "there is no report of the camera \"gate\"",
        ),
    ] {
        let answer = service.put(path, body).await;
        assert_eq!(answer.status, status, "{path} {body}");
        let detail = answer.problem()["detail"].as_str().unwrap().to_owned();
        assert!(detail.starts_with(reason), "{detail}");
    }
}
