//! Invalid requests: each returns a problem that names the field, and has no other effect.

use axum::{
    body::Body,
    http::{
        Request, StatusCode,
        header::{CONTENT_ENCODING, CONTENT_TYPE},
    },
};
use serde_json::Value;

use crate::service::{Answer, Bounds, Service, form, frame, frame_of};

/// A valid PNG header of an image of 100,000 × 100,000 pixels, without pixels.
const HUGE_PNG: &[u8] = b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\x01\x86\xa0\0\x01\x86\xa0\x08\x02\0\0\0\
    \x6a\x1b\x5f\x7e\0\0\0\0IDAT\x35\xaf\x06\x1e";

/// Asserts a problem of this status and kind whose detail contains `part`.
#[track_caller]
fn assert_refused(answer: &Answer, status: u16, kind: &str, part: &str) {
    assert_eq!(answer.status, status, "{}", answer.text());
    let problem = answer.problem();
    assert_eq!(problem["type"], format!("/problems/{kind}"));
    let detail = problem["detail"].as_str().unwrap();
    assert!(
        detail.contains(part),
        "{detail:?} does not contain {part:?}"
    );
    assert!(!detail.contains('\n'), "{detail:?} is more than one line");
}

#[tokio::test]
async fn unusable_images_are_refused() {
    let service = Service::start();
    let good = frame();
    let truncated = &good[..good.len() - 20];
    let jpeg_magic = [0xff, 0xd8, 0xff, 0xe0];
    for (content, status, kind) in [
        (&b"GIF89a or so"[..], 415, "unsupported-image"),
        (b"{\"image\": \"aGVsbG8=\"}", 415, "unsupported-image"),
        (b"", 400, "missing-image"),
        (truncated, 422, "damaged-image"),
        (&jpeg_magic, 422, "damaged-image"),
        (HUGE_PNG, 413, "image-too-large"),
    ] {
        for answer in [
            service.post_form(&[("img", content)]).await,
            service.post_raw("", content.to_vec()).await,
        ] {
            assert_refused(&answer, status, kind, "image");
        }
    }
    service.still_works().await;
}

#[tokio::test]
async fn a_parameter_that_cannot_be_used_is_refused_by_name() {
    let service = Service::start();
    for (name, value, status, kind) in [
        ("score_threshold", "1.5", 422, "invalid-parameter"),
        ("score_threshold", "-0.1", 422, "invalid-parameter"),
        ("score_threshold", "NaN", 422, "invalid-parameter"),
        ("score_threshold", "high", 422, "invalid-parameter"),
        ("iou_threshold", "inf", 422, "invalid-parameter"),
        ("sigma", "0", 422, "invalid-parameter"),
        ("max_detections", "0", 422, "invalid-parameter"),
        ("profile", "turbo", 422, "invalid-parameter"),
        ("refine", "median", 422, "invalid-parameter"),
        ("captured_at", "yesterday", 422, "invalid-parameter"),
        ("calibration", "../etc/passwd", 422, "invalid-parameter"),
        ("calibration", "attic", 404, "unknown-calibration"),
        ("model", "yolo", 404, "unknown-model"),
        ("confidence", "0.5", 400, "unknown-parameter"),
    ] {
        for answer in [
            service
                .post_form(&[("img", &frame()), (name, value.as_bytes())])
                .await,
            service.post_raw(&format!("{name}={value}"), frame()).await,
        ] {
            assert_refused(&answer, status, kind, &format!("{name}: "));
        }
    }
    service.still_works().await;
}

#[tokio::test]
async fn a_frame_that_does_not_match_is_refused() {
    let service = Service::start();
    let oblong = service
        .post_raw("calibration=lobby", frame_of(200, 150))
        .await;
    assert_refused(&oblong, 422, "unfit-image", "200×150");
    let tiny = service.post_raw("", frame_of(8, 8)).await;
    assert_refused(&tiny, 422, "unfit-image", "8×8");
    service.still_works().await;
}

#[tokio::test]
async fn a_form_with_the_wrong_fields_is_refused_by_their_name() {
    let service = Service::start();
    let image = frame();
    let wrong_name = service.post_form(&[("file", &image)]).await;
    assert_refused(
        &wrong_name,
        400,
        "unknown-parameter",
        "file: there is no such field",
    );
    let nothing = service.post_form(&[]).await;
    assert_refused(&nothing, 400, "missing-image", "img: ");
    let only_parameters = service.post_form(&[("profile", b"fast")]).await;
    assert_refused(&only_parameters, 400, "missing-image", "img: ");
    let two_frames = service
        .post_form(&[("img", &image), ("image", &image)])
        .await;
    assert_refused(&two_frames, 400, "repeated-parameter", "image: ");
    let twice = service
        .post_form(&[("img", &image), ("sigma", b"0.2"), ("sigma", b"0.3")])
        .await;
    assert_refused(&twice, 400, "repeated-parameter", "sigma: ");
    let not_text = service
        .post_form(&[("img", &image), ("camera", b"\xff")])
        .await;
    assert_refused(&not_text, 422, "invalid-parameter", "camera: ");
    let endless = service
        .post_form(&[("img", &image), ("camera", &[b'x'; 2000])])
        .await;
    assert_refused(&endless, 422, "invalid-parameter", "camera: ");
    // Characters that reorder or hide the others: a name must be what a reader sees.
    for invisible in [
        "\u{202e}gpj.exe",
        "hall\u{200b}",
        "a\u{2066}b",
        "\u{feff}hall",
    ] {
        let fields = [("img", &image[..]), ("camera", invisible.as_bytes())];
        let refused = service.post_form(&fields).await;
        assert_refused(&refused, 422, "invalid-parameter", "camera: ");
    }
    let many = [("profile", &b"fast"[..]); 25];
    assert_refused(
        &service.post_form(&many).await,
        400,
        "malformed-request",
        "24 fields",
    );
    service.still_works().await;
}

#[tokio::test]
async fn a_parameter_in_form_and_query_is_repeated() {
    let service = Service::start();
    let mut request = form(&[("img", &frame()), ("profile", b"fast")]);
    *request.uri_mut() = "/detect?profile=fast".parse().unwrap();
    let answer = service.send(request).await;
    assert_refused(&answer, 400, "repeated-parameter", "profile: ");
}

#[tokio::test]
async fn a_malformed_form_or_query_is_refused() {
    let service = Service::start();
    let no_boundary = Request::post("/detect")
        .header(CONTENT_TYPE, "multipart/form-data")
        .body(Body::from(frame()))
        .unwrap();
    let answer = service.send(no_boundary).await;
    assert_refused(&answer, 400, "malformed-request", "boundary");
    let cut_off = Request::post("/detect")
        .header(CONTENT_TYPE, "multipart/form-data; boundary=b")
        .body(Body::from(
            "--b\r\nContent-Disposition: form-data; name=\"img\"\r\n\r\nabc",
        ))
        .unwrap();
    let answer = service.send(cut_off).await;
    assert_refused(&answer, 400, "malformed-request", "cut off");
    let lines = "--b\nContent-Disposition: form-data; name=\"img\"\n\nabc\n--b--\n";
    let without_cr = Request::post("/detect")
        .header(CONTENT_TYPE, "multipart/form-data; boundary=b")
        .body(Body::from(lines))
        .unwrap();
    let answer = service.send(without_cr).await;
    assert_refused(&answer, 400, "malformed-request", "end them with CRLF");
    let compressed = Request::post("/detect")
        .header(CONTENT_ENCODING, "gzip")
        .body(Body::from(frame()))
        .unwrap();
    let answer = service.send(compressed).await;
    assert_refused(
        &answer,
        415,
        "unsupported-image",
        "Content-Encoding is \"gzip\"",
    );
    let answer = service.post_raw("camera=%FF", frame()).await;
    assert_refused(&answer, 400, "malformed-request", "query");
}

#[tokio::test]
async fn a_body_that_is_too_large_is_refused_however_it_is_sent() {
    let service = Service::within(&Bounds {
        max_body_bytes: 4096,
        ..Bounds::default()
    });
    let large = vec![0; 5000];
    let announced = Request::post("/detect")
        .header("content-length", "5000")
        .body(Body::from(large.clone()))
        .unwrap();
    for answer in [
        service.post_raw("", large.clone()).await,
        service.post_form(&[("img", &large)]).await,
        service.send(announced).await,
    ] {
        assert_refused(&answer, 413, "body-too-large", "4096 bytes");
    }
    service.still_works().await;
}

#[tokio::test]
async fn refusals_of_the_framework_are_problem_documents() {
    let service = Service::start();
    let nowhere = service.get("/nowhere").await;
    assert_refused(&nowhere, 404, "not-found", "/nowhere");
    let wrong_method = service.get("/detect").await;
    assert_refused(&wrong_method, 405, "method-not-allowed", "GET");
    assert_eq!(wrong_method.header("allow"), "POST");
    let no_such_page = service.get("/docs/nothing.js").await;
    assert_refused(&no_such_page, 404, "not-found", "/docs/nothing.js");
    let no_text = service.get("/v2/models/%FF").await;
    assert_refused(&no_text, 400, "malformed-request", "");
}

#[tokio::test]
async fn an_invalid_request_id_is_replaced() {
    let service = Service::start();
    let request = Request::get("/nowhere")
        .header("X-Request-Id", "two words")
        .body(Body::empty())
        .unwrap();
    let answer = service.send(request).await;
    assert_eq!(answer.status, StatusCode::NOT_FOUND);
    let given = answer.problem()["request_id"].clone();
    assert_ne!(given, Value::from("two words"));
}

#[tokio::test]
async fn a_file_name_instead_of_a_file_is_recognized() {
    let service = Service::start();
    let body = "--B\r\nContent-Disposition: form-data; name=\"img\"\r\n\r\nframe.JPG\r\n--B--\r\n";
    let request = Request::post("/detect")
        .header(CONTENT_TYPE, "multipart/form-data; boundary=B")
        .body(Body::from(body))
        .unwrap();
    let answer = service.send(request).await;
    assert_refused(&answer, 400, "missing-image", "-F img=@frame.jpg");
    assert_eq!(answer.problem()["parameter"], "img");
}

#[tokio::test]
async fn a_camera_without_a_view_names_its_latest_report() {
    let service = Service::start();
    let answer = service.get("/results/hall").await;
    assert_refused(&answer, 405, "method-not-allowed", "/results/hall/latest");
}
