//! Responses other than the report: annotated images and files for annotation tools.

use axum::{body::Body, http::Request};
use lookdown_imaging::{
    Frame,
    decode::{DecodeLimits, decode},
};

use crate::service::{Answer, FRAME_SIDE, Service, form, frame, frame_of};

const FAST: &str = "calibration=lobby&profile=fast";

async fn accepting(service: &Service, accept: &str, query: &str) -> Answer {
    let request = Request::post(format!("/detect?{FAST}&{query}"))
        .header("accept", accept)
        .body(Body::from(frame()))
        .unwrap();
    service.send(request).await
}

fn image_of(answer: &Answer) -> Frame {
    assert_eq!(
        answer.status,
        200,
        "{}",
        String::from_utf8_lossy(&answer.body)
    );
    decode(&answer.body, &DecodeLimits::default())
        .unwrap()
        .frame
}

fn gray(frame: &Frame, x: u32, y: u32) -> bool {
    frame
        .pixel(x, y)
        .iter()
        .all(|value| value.abs_diff(128) < 12)
}

fn is_plain(frame: &Frame) -> bool {
    (0..frame.height()).all(|y| (0..frame.width()).all(|x| gray(frame, x, y)))
}

#[tokio::test]
async fn an_image_is_returned_for_accept_or_format() {
    let service = Service::start();
    for (accept, query, media_type, magic) in [
        ("image/jpeg", "", "image/jpeg", &b"\xff\xd8\xff"[..]),
        ("image/png", "", "image/png", b"\x89PNG"),
        ("image/*", "", "image/jpeg", b"\xff\xd8\xff"),
        ("image/webp, image/png;q=0.1", "", "image/png", b"\x89PNG"),
        ("*/*", "format=image", "image/jpeg", b"\xff\xd8\xff"),
        (
            "application/json",
            "format=image",
            "image/jpeg",
            b"\xff\xd8\xff",
        ),
        ("image/png", "format=image", "image/png", b"\x89PNG"),
        ("*/*", "", "application/json", b"{"),
        ("image/png", "format=json", "application/json", b"{"),
        (
            "image/png;q=0.5, application/json",
            "",
            "application/json",
            b"{",
        ),
    ] {
        let answer = accepting(&service, accept, query).await;
        assert_eq!(answer.status, 200, "{accept} {query}");
        assert_eq!(
            answer.header("content-type"),
            media_type,
            "{accept} {query}"
        );
        assert!(answer.body.starts_with(magic), "{accept} {query}");
    }
    let plain = service.post_raw(FAST, frame()).await;
    assert_eq!(plain.header("content-type"), "application/json");
}

#[tokio::test]
async fn boxes_are_drawn_at_the_positions_of_the_report() {
    let service = Service::start();
    let report = accepting(&service, "*/*", "").await.json();
    let drawn = image_of(&accepting(&service, "image/png", "draw=boxes").await);
    let persons = report["persons"].as_array().unwrap();
    assert!(!persons.is_empty());
    let side = |person: &serde_json::Value, name: &str| person["box"][name].as_f64().unwrap();
    for person in persons {
        let middle = f64::midpoint(side(person, "y_min"), side(person, "y_max"));
        for column in ["x_min", "x_max"] {
            let inside = side(person, column).clamp(0.0, f64::from(FRAME_SIDE) - 1.0);
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "a position in the frame"
            )]
            let (x, y) = (inside as u32, middle as u32);
            assert!(!gray(&drawn, x, y), "nothing is drawn at {x}, {y}");
        }
    }
    for nothing in ["draw=none", "draw=none&format=image"] {
        let plain = image_of(&accepting(&service, "image/png", nothing).await);
        assert!(is_plain(&plain), "{nothing}");
    }
}

#[tokio::test]
async fn each_layer_changes_the_image() {
    let service = Service::start();
    let mut images = Vec::new();
    // Persons on the axes of the frame are upright or horizontal. The oriented boxes are those of
    // the others.
    for layer in ["boxes", "boxes,oriented", "scores", "views", "timestamp"] {
        let query = format!("draw={layer}&captured_at=2026-11-21T09:30:00Z");
        let drawn = image_of(&accepting(&service, "image/png", &query).await);
        assert!(!is_plain(&drawn) && !images.contains(&drawn), "{layer}");
        images.push(drawn);
    }
    let default = image_of(&accepting(&service, "image/png", "").await);
    let named = image_of(&accepting(&service, "image/png", "draw=scores,oriented").await);
    assert!(default == named);
}

#[tokio::test]
async fn an_image_has_the_requested_width_up_to_that_of_its_frame() {
    let service = Service::start();
    for (frame, width, expected) in [
        ((200, 200), 100, (100, 100)),
        ((200, 200), 8192, (200, 200)),
        ((300, 100), 64, (64, 21)),
    ] {
        let query = format!("profile=fast&format=image&width={width}");
        let drawn = image_of(&service.post_raw(&query, frame_of(frame.0, frame.1)).await);
        assert_eq!(
            (drawn.width(), drawn.height()),
            expected,
            "{frame:?} {width}"
        );
    }
    let sizes = [1, 60, 100].map(|quality| format!("{FAST}&format=image&quality={quality}"));
    let mut lengths = Vec::new();
    for query in sizes {
        lengths.push(service.post_raw(&query, frame()).await.body.len());
    }
    assert!(
        lengths.is_sorted() && lengths[0] < lengths[2],
        "{lengths:?}"
    );
}

#[tokio::test]
async fn every_response_has_the_report_headers() {
    let service = Service::start();
    let report = accepting(&service, "*/*", "").await;
    let count = report.json()["persons"]
        .as_array()
        .unwrap()
        .len()
        .to_string();
    for format in [
        "json",
        "image",
        "coco",
        "cvat",
        "yolo",
        "voc",
        "geojson",
        "cepdof",
        "labelstudio",
    ] {
        let answer = accepting(&service, "*/*", &format!("format={format}")).await;
        assert_eq!(answer.header("x-person-count"), count, "{format}");
        assert!(answer.header("server-timing").contains("inference;dur="));
        assert!(!answer.header("x-request-id").is_empty());
    }
}

#[tokio::test]
async fn annotation_files_have_the_name_of_the_uploaded_file() {
    let service = Service::start();
    let image = frame();
    let named = "img\"; filename=\"C:\\rooms/hall 1.png";
    for (format, media_type, content) in [
        (
            "coco",
            "application/x.coco+json",
            "\"file_name\": \"hall 1.png\"",
        ),
        ("cvat", "application/xml", "name=\"hall 1.png\""),
        ("voc", "application/xml", "<filename>hall 1.png</filename>"),
        (
            "geojson",
            "application/geo+json",
            "\"file_name\": \"hall 1.png\"",
        ),
        ("yolo", "text/plain; charset=utf-8", "0 0."),
        (
            "cepdof",
            "application/x.cepdof+json",
            "\"file_name\": \"hall 1.png\"",
        ),
        (
            "labelstudio",
            "application/x.label-studio+json",
            "?d=hall%201.png\"",
        ),
    ] {
        let parts: [(&str, &[u8]); 4] = [
            (named, &image),
            ("calibration", b"lobby"),
            ("profile", b"fast"),
            ("format", format.as_bytes()),
        ];
        let answer = service.send(form(&parts)).await;
        assert_eq!(answer.status, 200, "{}", answer.text());
        assert_eq!(answer.header("content-type"), media_type);
        assert!(answer.text().contains(content), "{}", answer.text());
    }
    let raw = service.post_raw(&format!("{FAST}&format=voc"), image).await;
    assert!(
        raw.text().contains("<filename>frame</filename>"),
        "{}",
        raw.text()
    );
}

#[tokio::test]
async fn oriented_boxes_are_the_shapes_of_formats_with_them() {
    let service = Service::start();
    let report = accepting(&service, "application/json", "").await.json();
    let persons = report["persons"].as_array().unwrap().len();
    assert!(persons > 0);
    for (format, part, count) in [
        ("cvat", "rotation=\"", persons),
        ("labelstudio", "\"rectanglelabels\": ", persons),
        ("yolo", " ", 8 * persons),
    ] {
        let query = format!("format={format}&oriented=true");
        let answer = accepting(&service, "*/*", &query).await;
        assert_eq!(answer.status, 200, "{}", answer.text());
        let text = answer.text();
        assert_eq!(text.matches(part).count(), count, "{text}");
    }
    for format in ["coco", "voc", "json"] {
        let query = format!("format={format}&oriented=true");
        let answer = accepting(&service, "*/*", &query).await;
        assert_eq!(answer.status, 422, "{format}");
        let problem = answer.problem();
        let detail = problem["detail"].as_str().unwrap();
        assert!(
            detail.contains("cvat, yolo, geojson, cepdof, labelstudio"),
            "{detail}"
        );
    }
}

#[tokio::test]
async fn geojson_is_negotiable_and_has_a_polygon_per_person() {
    let service = Service::start();
    let report = accepting(&service, "application/json", "").await.json();
    let answer = accepting(&service, "application/geo+json", "").await;
    assert_eq!(answer.header("content-type"), "application/geo+json");
    let features = answer.json()["features"].clone();
    let features = features.as_array().unwrap();
    let persons = report["persons"].as_array().unwrap();
    assert_eq!(features.len(), persons.len());
    for (feature, person) in features.iter().zip(persons) {
        assert_eq!(feature["properties"]["score"], person["score"]);
        assert_eq!(feature["properties"]["floor"], person["floor"]);
        let ring = feature["geometry"]["coordinates"][0].as_array().unwrap();
        assert_eq!((ring.len(), &ring[0]), (5, &ring[4]));
    }
}

#[tokio::test]
async fn invalid_options_are_refused_by_name() {
    let service = Service::start();
    for (query, status, kind, detail) in [
        ("format=gif", 422, "invalid-parameter", "json, image, coco"),
        ("draw=hats", 422, "invalid-parameter", "draw: \"hats\""),
        ("draw=", 422, "invalid-parameter", "draw: "),
        ("width=10", 422, "invalid-parameter", "64 to 8192"),
        ("width=1e3", 422, "invalid-parameter", "width: "),
        ("quality=0", 422, "invalid-parameter", "1 to 100"),
        ("width=640&width=640", 400, "repeated-parameter", "width: "),
        ("colour=red", 400, "unknown-parameter", "quality"),
    ] {
        let answer = accepting(&service, "image/png", query).await;
        assert_eq!(answer.status, status, "{query}");
        let problem = answer.problem();
        assert_eq!(problem["type"], format!("/problems/{kind}"), "{query}");
        let reported = problem["detail"].as_str().unwrap();
        assert!(reported.contains(detail), "{query}: {reported}");
    }
    let image = frame();
    let answer = service
        .post_form(&[("img", &image), ("quality", b"101")])
        .await;
    assert_eq!(answer.status, 422, "{}", answer.text());
}

#[tokio::test]
async fn unavailable_formats_are_refused_with_406_before_inference() {
    let service = Service::start();
    for accept in ["image/webp", "text/html", "application/json;q=0"] {
        let answer = accepting(&service, accept, "").await;
        assert_eq!(answer.status, 406, "{accept}");
        let problem = answer.problem();
        assert_eq!(problem["type"], "/problems/not-acceptable");
        assert!(problem["detail"].as_str().unwrap().contains("image/jpeg"));
    }
    assert_eq!(service.gate.runs(), 0);
    // Failures are problem documents, whatever the client accepts.
    let answer = accepting(&service, "image/png", "score_threshold=2").await;
    assert_eq!(answer.problem()["status"], 422);
    service.still_works().await;
}
