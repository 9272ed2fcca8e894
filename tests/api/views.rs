//! Straight live views of cameras.

use std::time::Duration;

use axum::{
    body::{Body, Bytes},
    http::Request,
    response::Response,
};
use http_body_util::BodyExt;
use lookdown::views::Views;
use lookdown_imaging::{
    Frame,
    annotate::Concealment,
    decode::{DecodeLimits, decode},
};
use serde_json::json;
use tower::ServiceExt;

use crate::{
    access::{ADMINISTRATOR, READER, VIEWER, guarded},
    log::Log,
    service::{Answer, Bounds, Service, frame, with_host},
};

const VIEW: &str = "/cameras/hall/views/door";
const JPEG: &str = "/cameras/hall/views/door.jpg";
const SMALL: &str = r#"{ "tilt_deg": 40, "width": 320, "height": 240 }"#;

impl Service {
    /// Posts a gray frame of the camera `hall`.
    async fn show(&self) {
        let query = "calibration=lobby&profile=fast&camera=hall";
        let answer = self.post_raw(query, frame()).await;
        assert_eq!(answer.status, 200, "{}", answer.text());
    }

    async fn respond(&self, request: axum::http::request::Builder) -> Response {
        let request = with_host(request.body(Body::empty()).unwrap());
        self.router.clone().oneshot(request).await.unwrap()
    }

    /// The views that another process reads.
    fn stored(&self) -> Views {
        let state = self.folder.path().join("state");
        let views = Views::new(state, DecodeLimits::default(), None);
        views.load().unwrap();
        views
    }
}

fn image_of(answer: &Answer) -> Frame {
    let told = String::from_utf8_lossy(&answer.body);
    assert_eq!(answer.status, 200, "{told}");
    assert_eq!(answer.header("content-type"), "image/jpeg");
    let decoded = decode(&answer.body, &DecodeLimits::default());
    decoded.unwrap().frame
}

/// The number of pixels with this level, with the loss of a JPEG.
fn count(frame: &Frame, level: u8) -> usize {
    let pixels = frame.pixels().as_chunks::<3>().0.iter();
    let is_level = |pixel: &&[u8; 3]| pixel.iter().all(|value| value.abs_diff(level) < 10);
    pixels.filter(is_level).count()
}

#[tokio::test]
async fn a_view_is_stored_listed_and_deleted() {
    let service = Service::start();
    assert_eq!(service.put(VIEW, SMALL).await.status, 201);
    assert_eq!(service.put(VIEW, SMALL).await.status, 204);
    let wanted = json!({ "kind": "fixed", "azimuth_deg": 0.0, "tilt_deg": 40.0, "width": 320, "height": 240 });
    assert_eq!(service.get(VIEW).await.json(), wanted);
    // After a restart.
    assert_eq!(service.stored().list("hall").len(), 1);
    let mut named = wanted;
    named["name"] = json!("door");
    let listed = service.get("/cameras/hall/views").await;
    assert_eq!(listed.json(), json!([named]));
    assert_eq!(service.ask("DELETE", VIEW, &[]).await.status, 204);
    for (method, path) in [("GET", VIEW), ("GET", JPEG), ("DELETE", VIEW)] {
        let answer = service.ask(method, path, &[]).await;
        assert_eq!(answer.status, 404, "{method} {path}");
        let detail = answer.problem()["detail"].to_string();
        assert!(detail.contains("it has none"), "{detail}");
    }
}

#[tokio::test]
async fn views_of_two_processes_are_all_stored() {
    let service = Service::start();
    let other = service.stored();
    assert_eq!(service.put(VIEW, SMALL).await.status, 201);
    let view = serde_json::from_str(SMALL).unwrap();
    assert!(other.put("porch", "door", view).unwrap());
    let second = "/cameras/hall/views/desk";
    assert_eq!(service.put(second, SMALL).await.status, 201);
    let stored = service.stored();
    let numbers = ["hall", "porch"].map(|camera| stored.list(camera).len());
    assert_eq!(numbers, [2, 1]);
}

#[tokio::test]
async fn values_of_views_out_of_range_are_refused() {
    let service = Service::start();
    assert_eq!(service.put(VIEW, SMALL).await.status, 201);
    service.show().await;
    for (field, value, reason) in [
        ("width", json!(20_000), "20000 is not 64 to 4096 pixels"),
        ("height", json!(63), "63 is not 64 to 4096 pixels"),
        ("tilt_deg", json!(-1), "-1 is not 0 to 90 degrees"),
        ("tilt_deg", json!(91), "from straight down"),
        ("azimuth_deg", json!(361), "-360 to 360"),
        ("field_of_view_deg", json!(151), "10 to 150"),
        ("kind", json!("spiral"), "another type"),
        ("zoom", json!(1), "there is no such field"),
    ] {
        let answer = service
            .put(VIEW, &json!({ field: value }).to_string())
            .await;
        assert_eq!(answer.status, 422, "{field}");
        let problem = answer.problem();
        assert_eq!(problem["parameter"], field);
        assert!(problem["detail"].to_string().contains(reason), "{problem}");
    }
    let mut narrow = service.get("/calibrations/lobby").await.json();
    narrow["lens"]["max_theta"] = json!(0.9);
    let put = service
        .put("/calibrations/lobby", &narrow.to_string())
        .await;
    assert_eq!(put.status, 200, "{}", put.text());
    service.show().await;
    let beyond = r#"{ "tilt_deg": 70 }"#;
    let refused = service.put(VIEW, beyond).await;
    assert_eq!(refused.status, 422);
    let refused = refused.text();
    assert!(refused.contains("ends 52° off its axis"), "{refused}");
}

#[tokio::test]
async fn the_image_of_a_view_changes_with_the_frame_and_the_view() {
    let service = Service::start();
    service.put(VIEW, SMALL).await;
    service.show().await;
    let first = service.get(JPEG).await;
    let image = image_of(&first);
    assert_eq!((image.width(), image.height()), (320, 240));
    assert!(count(&image, 128) > 60_000);
    let tag = first.header("etag").to_owned();
    let again = service.get_if_none_match(JPEG, &tag).await;
    assert_eq!((again.status.as_u16(), again.body.len()), (304, 0));
    service.show().await;
    let newer = service.get_if_none_match(JPEG, &tag).await;
    assert_eq!(newer.status, 200);
    for kind in ["panorama", "quarters", "follow"] {
        let tag = service.get(JPEG).await.header("etag").to_owned();
        let view = json!({ "kind": kind, "width": 480, "height": 240 });
        assert_eq!(service.put(VIEW, &view.to_string()).await.status, 204);
        let image = image_of(&service.get_if_none_match(JPEG, &tag).await);
        assert_eq!((image.width(), image.height()), (480, 240), "{kind}");
        assert!(count(&image, 128) > 90_000, "{kind}");
    }
    let mut grays = Vec::new();
    for boxes in ["false", "true"] {
        let path = format!("{JPEG}?boxes={boxes}&quality=95");
        grays.push(count(&image_of(&service.get(&path).await), 128));
    }
    assert!(grays[1] < grays[0] - 100, "{grays:?}");
    let turned = service
        .get("/cameras/hall/views/any.jpg?width=100&azimuth_deg=90")
        .await;
    assert_eq!(image_of(&turned).width(), 100);
    for (query, status) in [
        ("quality=0", 422),
        ("width=1", 422),
        ("boxes=2", 422),
        ("number=2", 422),
        ("a=1", 400),
    ] {
        let answer = service.get(&format!("{JPEG}?{query}")).await;
        assert_eq!(answer.status, status, "{query}");
    }
}

#[tokio::test]
async fn masks_and_concealment_hold_in_every_view() {
    let service = Service::within(&Bounds {
        conceal_images: Some(Concealment::Silhouette),
        ..Bounds::default()
    });
    let mut masked = service.get("/calibrations/lobby").await.json();
    masked["masks"] = json!([{ "frame_px": [[0, 0], [200, 0], [200, 80], [0, 80]] }]);
    let put = service
        .put("/calibrations/lobby", &masked.to_string())
        .await;
    assert_eq!(put.status, 200, "{}", put.text());
    for view in [
        json!({ "azimuth_deg": 270, "tilt_deg": 20, "field_of_view_deg": 120 }),
        json!({ "kind": "panorama", "width": 960, "height": 400 }),
        json!({ "kind": "quarters" }),
        json!({ "kind": "follow", "tilt_deg": 0, "field_of_view_deg": 140 }),
    ] {
        service.put(VIEW, &view.to_string()).await;
        service.show().await;
        let image = image_of(&service.get(JPEG).await);
        assert!(count(&image, 0) > 5_000, "the mask in {view}");
        // The gray of silhouettes.
        assert!(count(&image, 96) > 500, "people in {view}");
    }
}

#[tokio::test]
async fn zones_lines_and_the_number_are_drawn_where_asked() {
    let service = Service::start();
    let mut areas = service.get("/calibrations/lobby").await.json();
    // The azimuths of the middles of the zone and of the line are 0° and 180°.
    areas["zones"] =
        json!([{ "name": "till", "frame_px": [[130, 80], [170, 80], [170, 120], [130, 120]] }]);
    areas["lines"] =
        json!([{ "name": "door", "frame_px": [[50, 80], [50, 120]], "directions": ["in", "out"] }]);
    let put = service.put("/calibrations/lobby", &areas.to_string()).await;
    assert_eq!(put.status, 200, "{}", put.text());
    for (view, zone, line) in [
        (json!({ "azimuth_deg": 0 }), true, false),
        (json!({ "azimuth_deg": 180 }), false, true),
        (json!({ "kind": "quarters" }), true, true),
        (
            json!({ "kind": "panorama", "azimuth_deg": 180, "width": 960, "height": 300 }),
            true,
            true,
        ),
    ] {
        service.put(VIEW, &view.to_string()).await;
        service.show().await;
        let mut tags = std::collections::BTreeSet::new();
        for (option, color, is_drawn) in [
            ("zones", [126, 240, 110], zone),
            ("lines", [255, 214, 60], line),
            ("number", [255, 255, 255], true),
        ] {
            let answer = service
                .get(&format!("{JPEG}?{option}=true&quality=95"))
                .await;
            tags.insert(answer.header("etag").to_owned());
            let image = image_of(&answer);
            let drawn = colored(&image, color);
            assert_eq!(drawn > 20, is_drawn, "{option} in {view}: {drawn}");
            // A stroke along the whole width would be the wrong way around.
            assert!(drawn < 6_000, "{option} in {view}: {drawn}");
        }
        assert_eq!(tags.len(), 3);
    }
}

/// The number of pixels of about this color.
fn colored(frame: &Frame, color: [u8; 3]) -> usize {
    let pixels = frame.pixels().as_chunks::<3>().0.iter();
    let is_color = |pixel: &&[u8; 3]| {
        let mut channels = pixel.iter().zip(color);
        channels.all(|(value, wanted)| value.abs_diff(wanted) < 30)
    };
    pixels.filter(is_color).count()
}

/// The next part of a stream; `None` at its end.
async fn part(stream: &mut Response) -> Option<Bytes> {
    let frame = stream.body_mut().frame().await?;
    Some(frame.unwrap().into_data().unwrap())
}

#[tokio::test]
async fn a_stream_shows_the_newest_frame_and_ends_with_its_view() {
    let service = Service::start();
    service.put(VIEW, SMALL).await;
    service.show().await;
    let path = format!("{VIEW}.mjpg");
    let mut slow = service.respond(Request::get(&path)).await;
    let mut stream = service.respond(Request::get(&path)).await;
    assert_eq!(
        stream.headers()["content-type"],
        "multipart/x-mixed-replace; boundary=frame"
    );
    let first = part(&mut stream).await.unwrap();
    assert!(first.starts_with(b"--frame\r\nContent-Type: image/jpeg\r\n"));
    assert!(first.ends_with(b"\xff\xd9\r\n--frame\r\n"));
    for _ in 0..3 {
        service.show().await;
    }
    // One part for three frames.
    assert!(part(&mut stream).await.is_some());
    assert!(part(&mut slow).await.is_some());
    let mut next = tokio::spawn(async move { part(&mut stream).await });
    let waited = tokio::time::timeout(Duration::from_millis(50), &mut next).await;
    assert!(waited.is_err());
    assert_eq!(service.metrics.results_listeners.get(), 2);
    assert_eq!(service.ask("DELETE", VIEW, &[]).await.status, 204);
    service.show().await;
    assert!(next.await.unwrap().is_none());
    assert_eq!(service.metrics.results_listeners.get(), 1);
}

#[tokio::test]
async fn a_key_of_the_scope_view_opens_images_alone_in_any_place() {
    let log = Log::start();
    let service = guarded();
    let admin = [("x-api-key", ADMINISTRATOR)];
    let request = |method: &str, path: &str, headers: &[(&str, String)]| {
        let mut request = Request::builder().method(method).uri(path);
        for (name, value) in headers {
            request = request.header(*name, value);
        }
        request
    };
    let put = request("PUT", VIEW, &[("x-api-key", ADMINISTRATOR.to_owned())]);
    let put = service.send(put.body(Body::from(SMALL)).unwrap()).await;
    assert_eq!(put.status, 201);
    let detect = "/detect?calibration=lobby&profile=fast&camera=hall";
    assert_eq!(service.ask("POST", detect, &admin).await.status, 200);
    // The user is any text, and the password is the key.
    let basic = "Basic YW55Omxvb2tkb3duX3ZpZXdlcg==".to_owned();
    let in_query = format!("{JPEG}?key={VIEWER}");
    let key = ("x-api-key", VIEWER.to_owned());
    for (path, headers) in [
        (JPEG, vec![key.clone()]),
        (JPEG, vec![("authorization", basic.clone())]),
        (&in_query, vec![]),
    ] {
        let answer = service.respond(request("GET", path, &headers)).await;
        assert_eq!(answer.status(), 200, "{headers:?}");
    }
    for (path, headers, status) in [
        (VIEW, vec![key.clone()], 403),
        ("/cameras/hall/views", vec![key.clone()], 403),
        ("/results/hall/latest.jpg", vec![key.clone()], 403),
        (
            "/cameras/hall/views/a.jpg?azimuth_deg=1",
            vec![key.clone()],
            403,
        ),
        ("/calibrations", vec![("authorization", basic.clone())], 401),
        (JPEG, vec![("x-api-key", READER.to_owned())], 403),
        (&in_query, vec![key], 401),
        (JPEG, vec![], 401),
    ] {
        let answer = service.respond(request("GET", path, &headers)).await;
        assert_eq!(answer.status(), status, "{path} {headers:?}");
    }
    let refused = service.respond(Request::get(JPEG)).await;
    let challenges = refused.headers().get_all("www-authenticate").iter();
    assert!(challenges.eq(["Bearer", "Basic realm=\"Lookdown\""].iter()));
    assert!(!log.text().contains(VIEWER), "{}", log.text());
}

#[tokio::test]
async fn events_have_the_boxes_of_a_view_in_its_pixels() {
    let service = Service::start();
    let whole = r#"{ "tilt_deg": 0, "field_of_view_deg": 150, "width": 400, "height": 400 }"#;
    assert_eq!(service.put(VIEW, whole).await.status, 201);
    service.show().await;
    let path = "/results/hall/events?view=door";
    let mut stream = service.respond(Request::get(path)).await;
    let event = part(&mut stream).await.unwrap();
    let event = String::from_utf8(event.to_vec()).unwrap();
    let data = event.lines().find_map(|line| line.strip_prefix("data: "));
    let report: serde_json::Value = serde_json::from_str(data.unwrap()).unwrap();
    let persons = report["persons"].as_array().unwrap();
    assert!(!persons.is_empty());
    for person in persons {
        // The view is centered on the frame, and turned by a quarter: azimuth 0 is up in it.
        let center = [&person["oriented_box"]["cx"], &person["oriented_box"]["cy"]];
        let [x, y] = center.map(|center| center.as_f64().unwrap() - 100.0);
        let theta = x.hypot(y) / 63.66;
        let Some(sides) = person["view_boxes"]["door"].as_object() else {
            assert!(theta > 1.2, "{person}");
            continue;
        };
        let of = |key: &str| sides[key].as_f64().unwrap() - 200.0;
        let scale = 200.0 / 75_f64.to_radians().tan() * theta.tan() / x.hypot(y);
        let (right, down) = (scale * y, scale * -x);
        assert!(of("x_min") <= right && right <= of("x_max"), "{person}");
        assert!(of("y_min") <= down && down <= of("y_max"), "{person}");
    }
}
