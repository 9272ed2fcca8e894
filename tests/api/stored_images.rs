//! The latest annotated image of a camera.

use std::collections::BTreeSet;

use bytes::Bytes;
use lookdown::{
    annotated_image::StoredFrame,
    results::{ImagesOf, NewReport, ResultStore},
};
use lookdown_imaging::{
    Frame,
    annotate::{Concealment, encode_jpeg},
    decode::{DecodeLimits, decode},
};
use serde_json::json;

use crate::service::{Answer, Bounds, FRAME_SIDE, Service, frame, frame_of};

const PATH: &str = "/results/hall/latest.jpg";

/// A service that stores images of the camera `hall`.
fn keeping() -> Service {
    Service::within(&Bounds {
        images_of: ImagesOf::Some(BTreeSet::from(["hall".to_owned()])),
        ..Bounds::default()
    })
}

impl Service {
    async fn detect_in(&self, camera: &str) -> Answer {
        let query = format!("calibration=lobby&profile=fast&camera={camera}");
        let answer = self.post_raw(&query, frame()).await;
        assert_eq!(answer.status, 200, "{}", answer.text());
        answer
    }
}

fn image_of(answer: &Answer) -> Frame {
    let told = String::from_utf8_lossy(&answer.body);
    assert_eq!(answer.status, 200, "{told}");
    assert_eq!(answer.header("content-type"), "image/jpeg");
    decode(&answer.body, &DecodeLimits::default())
        .unwrap()
        .frame
}

/// Returns `true` if the pixel has the gray of the frame.
fn is_gray(frame: &Frame, x: u32, y: u32) -> bool {
    let pixel = frame.pixel(x, y);
    pixel.iter().all(|value| value.abs_diff(128) < 12)
}

fn is_plain(frame: &Frame) -> bool {
    (0..frame.height()).all(|y| (0..frame.width()).all(|x| is_gray(frame, x, y)))
}

#[tokio::test]
async fn no_image_is_stored_unless_the_settings_name_its_camera() {
    for (service, camera) in [(Service::start(), "hall"), (keeping(), "stairs")] {
        service.detect_in(camera).await;
        let path = format!("/results/{camera}/latest.jpg");
        let answer = service.get(&path).await;
        assert_eq!(answer.status, 404);
        let problem = answer.problem();
        assert_eq!(problem["type"], "/problems/image-not-kept");
        let detail = problem["detail"].as_str().unwrap();
        assert!(detail.contains("results.images"), "{detail}");
    }
    let unknown = keeping().get(PATH).await.problem();
    assert_eq!(unknown["type"], "/problems/unknown-camera");
}

#[tokio::test]
async fn all_cameras_may_have_images() {
    let service = Service::within(&Bounds {
        images_of: ImagesOf::All,
        ..Bounds::default()
    });
    service.detect_in("hall").await;
    image_of(&service.get(PATH).await);
    let metrics = service.get("/metrics").await.text();
    let told = "lookdown_results_images 1";
    assert!(metrics.lines().any(|line| line == told), "{metrics}");
}

#[tokio::test]
async fn an_image_is_drawn_as_the_request_specifies() {
    let service = keeping();
    service.detect_in("hall").await;
    let mut seen = Vec::new();
    for draw in [
        "boxes",
        "boxes,oriented",
        "scores",
        "views",
        "timestamp",
        "oriented,scores",
    ] {
        let drawn = image_of(&service.get(&format!("{PATH}?draw={draw}")).await);
        assert_eq!((drawn.width(), drawn.height()), (200, 200));
        assert!(!is_plain(&drawn) && !seen.contains(&drawn), "{draw}");
        seen.push(drawn);
    }
    assert!(seen.last() == Some(&image_of(&service.get(PATH).await)));
    assert!(is_plain(&image_of(
        &service.get(&format!("{PATH}?draw=none")).await
    )));
    let small = image_of(&service.get(&format!("{PATH}?width=100")).await);
    assert_eq!((small.width(), small.height()), (100, 100));
    let mut lengths = Vec::new();
    for quality in [1, 50, 100] {
        let path = format!("{PATH}?quality={quality}");
        lengths.push(service.get(&path).await.body.len());
    }
    assert!(lengths.is_sorted(), "{lengths:?}");
    for (query, status) in [
        ("draw=hats", 422),
        ("width=63", 422),
        ("quality=0", 422),
        ("boxes=true", 400),
        ("width=100&width=100", 400),
    ] {
        let answer = service.get(&format!("{PATH}?{query}")).await;
        assert_eq!(answer.status, status, "{query}");
        answer.problem();
    }
}

#[tokio::test]
async fn an_image_is_sent_again_only_if_there_is_a_newer_one() {
    let service = keeping();
    service.detect_in("hall").await;
    let first = service.get(PATH).await;
    assert_eq!(first.header("cache-control"), "private, no-cache");
    let tag = first.header("etag").to_owned();
    let report = service.get("/results/hall/latest").await;
    assert_eq!(report.header("etag"), tag);
    let again = service.get_if_none_match(PATH, &tag).await;
    assert_eq!((again.status.as_u16(), again.body.len()), (304, 0));
    assert_eq!(again.header("etag"), tag);
    assert_eq!(again.header("cache-control"), "private, no-cache");
    service.detect_in("hall").await;
    let newer = service.get_if_none_match(PATH, &tag).await;
    assert_eq!(newer.status, 200);
    assert_ne!(newer.header("etag"), tag);
}

#[tokio::test]
async fn zones_are_drawn_and_masked_areas_are_black() {
    let service = keeping();
    let lobby = json!({
        "id": "lobby", "image": { "width": 200, "height": 200 },
        "lens": { "model": "equidistant", "focal": 63.66, "cx": 99.5, "cy": 99.5, "max_theta": 1.5 },
        "mount": { "world_up": [0.0, 0.0, -1.0], "height_m": 3.0 },
        "zones": [
            { "name": "till", "frame_px": [[100, 20], [180, 20], [180, 180], [100, 180]] },
            { "name": "door", "floor_m": [[-2, -1], [-1, -1], [-1, 1], [-2, 1]] },
        ],
        "masks": [{ "frame_px": [[0, 0], [40, 0], [40, 40], [0, 40]] }],
    });
    let put = service.put("/calibrations/lobby", &lobby.to_string()).await;
    assert_eq!(put.status, 200, "{}", put.text());
    service.detect_in("hall").await;
    let plain = image_of(&service.get(&format!("{PATH}?draw=none")).await);
    assert!(plain.pixel(20, 20).iter().all(|value| *value < 16));
    let drawn = image_of(&service.get(&format!("{PATH}?draw=zones")).await);
    // The left border of each zone: a meter beside the camera, 3 m below it.
    for (x, y) in [(100, 150), (79, 99)] {
        assert!(is_gray(&plain, x, y) && !is_gray(&drawn, x, y), "{x}, {y}");
    }
    assert!(is_gray(&drawn, 120, 190));
}

#[tokio::test]
async fn a_jpeg_is_stored_unchanged_unless_it_is_masked() {
    let service = keeping();
    let side = FRAME_SIDE as usize;
    let gray = Frame::new(FRAME_SIDE, FRAME_SIDE, vec![128; 3 * side * side]).unwrap();
    let sent = encode_jpeg(&gray, 95).unwrap();
    let query = "calibration=lobby&profile=fast&camera=hall";
    let kept = async || {
        service.post_raw(query, sent.clone()).await;
        let kept = service.results.image("hall").await.unwrap().unwrap();
        kept.frame.jpeg.to_vec()
    };
    assert_eq!(kept().await, sent);
    let mut lobby = service.get("/calibrations/lobby").await.json();
    lobby["masks"] = json!([{ "frame_px": [[0, 0], [40, 0], [40, 40], [0, 40]] }]);
    let put = service.put("/calibrations/lobby", &lobby.to_string()).await;
    assert_eq!(put.status, 200, "{}", put.text());
    let masked = decode(&kept().await, &DecodeLimits::default())
        .unwrap()
        .frame;
    assert!(masked.pixel(20, 20).iter().all(|value| *value < 16));
}

#[tokio::test]
async fn stored_data_that_is_no_image_is_refused_with_404() {
    let service = keeping();
    service.detect_in("hall").await;
    let good = service.results.image("hall").await.unwrap().unwrap();
    let garbage = Bytes::from_static(b"no\nimage");
    for (jpeg, sketch) in [
        (garbage.clone(), good.frame.sketch.clone()),
        (good.frame.jpeg.clone(), garbage.clone()),
    ] {
        let report = NewReport {
            camera: "hall".to_owned(),
            received_at: "2026-11-22T09:30:00Z".parse().unwrap(),
            persons: 0,
            scores: None,
            json: Bytes::from_static(b"{}"),
        };
        let image = StoredFrame { jpeg, sketch };
        service.results.publish(report, Some(image));
        let answer = service.get(PATH).await;
        assert_eq!(answer.status, 404, "{}", answer.text());
        let problem = answer.problem();
        assert_eq!(problem["type"], "/problems/image-not-kept");
        let detail = problem["detail"].as_str().unwrap();
        assert!(detail.contains("cannot be used"), "{detail}");
    }
}

#[tokio::test]
async fn a_large_frame_is_stored_at_a_smaller_size() {
    let service = keeping();
    let query = "profile=fast&camera=hall";
    let answer = service.post_raw(query, frame_of(3000, 1500)).await;
    assert_eq!(answer.status, 200, "{}", answer.text());
    for (query, width, height) in [("", 2048, 1024), ("?width=8192", 2560, 1280)] {
        let kept = image_of(&service.get(&format!("{PATH}{query}")).await);
        assert_eq!((kept.width(), kept.height()), (width, height));
    }
}

#[tokio::test]
async fn persons_are_concealed_in_stored_images_on_request() {
    let service = Service::within(&Bounds {
        images_of: ImagesOf::All,
        conceal_images: Some(Concealment::Silhouette),
        ..Bounds::default()
    });
    service.detect_in("hall").await;
    let stored = service.results.image("hall").await.unwrap().unwrap();
    let frame = decode(&stored.frame.jpeg, &DecodeLimits::default());
    assert!(!is_plain(&frame.unwrap().frame));
    let shown = service.get(&format!("{PATH}?draw=none")).await;
    assert!(!is_plain(&image_of(&shown)));
}
