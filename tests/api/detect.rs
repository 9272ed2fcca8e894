//! Successful detection requests.

use axum::{body::Body, http::Request};

use crate::service::{FRAME_SIDE, Service, form, frame};

#[tokio::test]
async fn a_form_and_a_raw_body_get_the_same_persons() {
    let service = Service::start();
    let image = frame();
    let parameters: [(&str, &[u8]); 2] = [("calibration", b"lobby"), ("profile", b"fast")];
    let mut persons = Vec::new();
    for name in ["img", "image", "img\"; filename=\"frame.png"] {
        let answer = service
            .post_form(&[(name, &image), parameters[0], parameters[1]])
            .await;
        assert_eq!(answer.status, 200, "{}", answer.text());
        persons.push(answer.json()["persons"].clone());
    }
    let raw = service
        .post_raw("calibration=lobby&profile=fast", image)
        .await;
    persons.push(raw.json()["persons"].clone());
    assert!(!persons[0].as_array().unwrap().is_empty());
    assert!(persons.windows(2).all(|pair| pair[0] == pair[1]));
}

#[tokio::test]
async fn parameters_are_read_from_form_and_query() {
    let service = Service::start();
    let mut request = form(&[
        ("camera", b"north"),
        ("img", &frame()),
        ("profile", b"fast"),
    ]);
    *request.uri_mut() = "/detect?calibration=lobby&max_detections=1&refine=nms"
        .parse()
        .unwrap();
    let report = service.send(request).await.json();
    assert_eq!(report["camera"], "north");
    assert_eq!(report["calibration"]["id"], "lobby");
    assert_eq!(report["profile"], "fast");
    assert_eq!(report["refinement"]["name"], "nms");
    assert_eq!(report["persons"].as_array().unwrap().len(), 1);
}

#[tokio::test]
async fn a_person_has_a_box_a_direction_and_a_floor_position() {
    let service = Service::start();
    let report = service
        .post_raw("calibration=lobby&profile=fast", frame())
        .await
        .json();
    let person = &report["persons"][0];
    for (group, fields) in [
        ("box", &["x_min", "y_min", "x_max", "y_max"][..]),
        (
            "oriented_box",
            &["cx", "cy", "width", "height", "angle_deg"],
        ),
        ("bearing", &["azimuth_deg", "off_axis_deg"]),
        ("floor", &["x_m", "y_m"]),
    ] {
        for field in fields {
            assert!(
                person[group][field].is_number(),
                "{group}.{field} in {person}"
            );
        }
    }
    assert!(person["views"].as_u64().unwrap() >= 1);
    let score = person["score"].as_f64().unwrap();
    assert!((0.0..=1.0).contains(&score));
}

#[tokio::test]
async fn an_assumed_lens_is_reported_with_its_circle() {
    let report = Service::start()
        .post_raw("profile=fast", frame())
        .await
        .json();
    assert_eq!(report["calibration"]["assumed"], true);
    assert_eq!(report["camera"], "assumed");
    assert_eq!(report["warnings"][0]["code"], "lens-assumed");
    let circle = &report["calibration"]["assumed_circle"];
    for coordinate in ["cx", "cy", "radius"] {
        let pixels = circle[coordinate].as_f64().unwrap();
        assert!((0.0..=f64::from(FRAME_SIDE)).contains(&pixels), "{circle}");
    }
}

#[tokio::test]
async fn the_request_id_is_echoed_in_header_and_report() {
    let service = Service::start();
    let request = Request::post("/detect?calibration=lobby&profile=fast")
        .header("X-Request-Id", "camera-7/0001")
        .body(Body::from(frame()))
        .unwrap();
    let answer = service.send(request).await;
    assert_eq!(answer.header("x-request-id"), "camera-7/0001");
    assert_eq!(answer.json()["request_id"], "camera-7/0001");
}

#[tokio::test]
async fn the_stages_are_in_headers() {
    let service = Service::start();
    let answer = service
        .post_raw("calibration=lobby&profile=fast", frame())
        .await;
    let report = answer.json();
    let stages = [
        "decode",
        "calibrate",
        "queue",
        "remap",
        "inference",
        "refine",
        "total",
    ];
    let reported: Vec<_> = answer.header("server-timing").split(", ").collect();
    assert_eq!(reported.len(), stages.len());
    for (reported, stage) in reported.into_iter().zip(stages) {
        let millis: f64 = reported
            .strip_prefix(&format!("{stage};dur="))
            .unwrap()
            .parse()
            .unwrap();
        assert_eq!(report["timings_ms"][stage], millis);
    }
}

#[tokio::test]
async fn the_default_threshold_is_that_of_live_detection() {
    let report = Service::start()
        .post_raw("profile=fast", frame())
        .await
        .json();
    assert_eq!(report["refinement"]["score_threshold"], 0.3);
}
