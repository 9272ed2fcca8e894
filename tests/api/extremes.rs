//! Requests at the limits.

use axum::{
    body::{Body, Bytes},
    http::Request,
};
use http_body_util::channel::Channel;

use crate::service::{Bounds, Service, frame, frame_of};

/// The default limit of candidates per view, less one.
const CROWD: u32 = 299;

#[tokio::test]
async fn any_threshold_has_bounded_cost_for_a_crowd() {
    let service = Service::start();
    service.gate.crowd(CROWD);
    for refine in ["nms", "soft_nms_linear", "soft_nms_gaussian", "fusion"] {
        for (score, iou) in [
            ("0", "0.5"),
            ("0", "0"),
            ("0.0", "1"),
            ("0", "1e-300"),
            ("1", "0.5"),
        ] {
            let query = format!(
                "calibration=lobby&profile=paper&refine={refine}&score_threshold={score}\
                 &iou_threshold={iou}"
            );
            let answer = service.post_raw(&query, frame()).await;
            assert_eq!(answer.status, 200, "{query}: {}", answer.text());
            let report = answer.json();
            let persons = report["persons"].as_array().unwrap();
            assert!(persons.len() <= 1000, "{query}: {}", persons.len());
            for person in persons {
                let score = person["score"].as_f64().unwrap();
                assert!((0.0..=1.0).contains(&score), "{query}: {person}");
            }
        }
    }
}

#[tokio::test]
async fn a_report_holds_as_many_persons_as_its_request_allows() {
    let service = Service::start();
    service.gate.crowd(CROWD);
    for most in [1, 7, 10_000] {
        let query = format!(
            "calibration=lobby&profile=fast&refine=nms&iou_threshold=1&score_threshold=0\
             &max_detections={most}"
        );
        let report = service.post_raw(&query, frame()).await.json();
        let persons = report["persons"].as_array().unwrap().len();
        // Four views, of whose candidates some are outside the lens image.
        let there = persons == most || most == 10_000 && (100..=4 * 300).contains(&persons);
        assert!(there, "{persons} of at most {most}");
    }
}

#[tokio::test]
async fn the_body_limit_is_the_configured_one() {
    let service = Service::within(&Bounds {
        max_body_bytes: 4 << 20,
        ..Bounds::default()
    });
    // Bytes after the end of an image are ignored.
    let mut image = frame();
    image.resize(3 << 20, 0);
    let parameters: [(&str, &[u8]); 2] = [("calibration", b"lobby"), ("profile", b"fast")];
    for answer in [
        service
            .post_raw("calibration=lobby&profile=fast", image.clone())
            .await,
        service
            .post_form(&[("img", &image), parameters[0], parameters[1]])
            .await,
    ] {
        assert_eq!(answer.status, 200, "{}", answer.text());
    }
}

#[tokio::test]
async fn a_body_may_arrive_in_many_parts() {
    let service = Service::start();
    let image = frame();
    let (mut sender, channel) = Channel::<Bytes, axum::Error>::new(1);
    let bytes = image.clone();
    tokio::spawn(async move {
        for byte in bytes {
            sender
                .send_data(Bytes::copy_from_slice(&[byte]))
                .await
                .unwrap();
        }
    });
    let request = Request::post("/detect?calibration=lobby&profile=fast");
    let answer = service
        .send(request.body(Body::new(channel)).unwrap())
        .await;
    assert_eq!(answer.status, 200, "{}", answer.text());
}

#[tokio::test]
async fn form_values_and_names_have_exact_limits() {
    let service = Service::start();
    let image = frame();
    let of = |length: usize| vec![b'x'; length];
    for (length, status) in [(128, 200), (129, 422), (1024, 422), (1025, 422)] {
        let answer = service
            .post_form(&[("img", &image), ("camera", &of(length))])
            .await;
        assert_eq!(answer.status, status, "{length}: {}", answer.text());
    }
    let name = "n".repeat(100_000);
    let answer = service.post_form(&[("img", &image), (&name, b"1")]).await;
    assert_eq!(answer.status, 400);
    assert!(answer.body.len() < 2_000, "{} bytes", answer.body.len());

    let fields = |count: usize| {
        let parameters = std::iter::repeat_n(("profile", &b"fast"[..]), count - 1);
        std::iter::once(("img", &image[..]))
            .chain(parameters)
            .collect::<Vec<_>>()
    };
    for (count, kind) in [(24, "repeated-parameter"), (25, "malformed-request")] {
        let answer = service.post_form(&fields(count)).await;
        let urn = format!("/problems/{kind}");
        assert_eq!(answer.problem()["type"], urn, "{count} fields");
    }
}

#[tokio::test]
async fn a_compressed_body_is_not_decompressed() {
    let request = Request::post("/detect")
        .header("content-encoding", "gzip")
        .body(Body::from(b"\x1f\x8b\x08\0\0\0\0\0\0\xff".to_vec()))
        .unwrap();
    let answer = Service::start().send(request).await;
    assert_eq!(answer.status, 415);
    assert_eq!(answer.problem()["type"], "/problems/unsupported-image");
}

#[tokio::test]
async fn a_frame_of_one_row_is_refused() {
    let service = Service::start();
    for (width, height) in [(1, 1), (1, 4000), (4000, 1)] {
        let answer = service
            .post_raw("profile=fast", frame_of(width, height))
            .await;
        assert_eq!(answer.status, 422, "{width}×{height}: {}", answer.text());
        answer.problem();
    }
    service.still_works().await;
}
