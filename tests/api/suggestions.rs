//! Calibrations that the server finds for cameras without one.

use std::time::Duration;

use lookdown_imaging::{Frame, annotate::encode_jpeg};
use nalgebra::{Rotation3, Vector3};
use serde_json::Value;
use tokio::time::{sleep, timeout};

use crate::service::{Service, frame};

const SIDE: u32 = 640;
/// Half of the field of view, radians: 186°.
const HALF_FIELD: f64 = 1.623;
const RADIUS: f64 = 310.0;
/// The camera in the room, Euler angles in radians: tilted by 6.9°.
const TILT: (f64, f64) = (0.1, -0.066);
/// The walls, the ceiling and the floor from the camera, meters.
const ROOM: [(f64, f64); 3] = [(-3.1, 3.7), (-2.6, 3.2), (-0.2, 2.6)];
const PATH: &str = "/cameras/hall/suggested-calibration";

/// Brightness of a point of a wall or the floor, which have rectangles.
fn brightness(surface: usize, across: f64, along: f64) -> f64 {
    let (column, row) = ((across / 0.83).floor(), (along / 0.71).floor());
    let mixed =
        (column * 12.9898 + row * 78.233 + surface_number(surface) * 37.719).sin() * 43_758.545;
    60.0 + 160.0 * (mixed - mixed.floor())
}

fn surface_number(surface: usize) -> f64 {
    f64::from(u8::try_from(surface).unwrap())
}

/// Brightness along a ray in the room.
fn seen(ray: &Vector3<f64>) -> f64 {
    let mut nearest = (f64::INFINITY, 0);
    for (axis, (low, high)) in ROOM.into_iter().enumerate() {
        let wall = if ray[axis] > 0.0 { high } else { low };
        let far = wall / ray[axis];
        if far < nearest.0 {
            nearest = (far, 2 * axis + usize::from(ray[axis] > 0.0));
        }
    }
    let (far, surface) = nearest;
    let at = ray * far;
    match surface / 2 {
        0 => brightness(surface, at.y, at.z),
        1 => brightness(surface, at.x, at.z),
        _ => brightness(surface, at.x, at.y),
    }
}

/// A JPEG of the room, by an equidistant lens.
fn rendered() -> Vec<u8> {
    let room_from_camera = Rotation3::from_euler_angles(TILT.0, TILT.1, 0.35);
    let center = f64::from(SIDE) / 2.0;
    let sample = |x: f64, y: f64| {
        let (x, y) = (x - center, y - center);
        let radius = x.hypot(y);
        if radius > RADIUS {
            return 0.0;
        }
        let (sin, cos) = (radius / RADIUS * HALF_FIELD).sin_cos();
        let flat = sin / radius.max(1e-9);
        seen(&(room_from_camera * Vector3::new(x * flat, y * flat, cos)))
    };
    let mut pixels = Vec::new();
    for y in 0..SIDE {
        for x in 0..SIDE {
            let (x, y) = (f64::from(x), f64::from(y));
            let quarters = [(0.25, 0.25), (0.75, 0.25), (0.25, 0.75), (0.75, 0.75)];
            let sum: f64 = quarters.iter().map(|(dx, dy)| sample(x + dx, y + dy)).sum();
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "a byte"
            )]
            pixels.extend([(sum / 4.0) as u8; 3]);
        }
    }
    encode_jpeg(&Frame::new(SIDE, SIDE, pixels).unwrap(), 90).unwrap()
}

/// Waits for the end of the fit of the frames that were sent.
async fn found(service: &Service) -> Value {
    let asking = async {
        loop {
            let suggested = service.get(PATH).await.json();
            if suggested["state"] != "waiting" {
                return suggested;
            }
            sleep(Duration::from_millis(20)).await;
        }
    };
    timeout(Duration::from_mins(5), asking).await.unwrap()
}

#[tokio::test]
async fn a_camera_without_a_calibration_gets_one_suggested() {
    let service = Service::start();
    assert_eq!(service.get(PATH).await.status, 404);
    let answer = service
        .post_raw("camera=hall&profile=fast", rendered())
        .await;
    assert_eq!(answer.status, 200, "{}", answer.text());
    let suggested = found(&service).await;
    assert_eq!(suggested["state"], "found", "{suggested}");
    assert_eq!(
        (&suggested["frames"], &suggested["frames_wanted"]),
        (&1.into(), &5.into())
    );
    let lens = &suggested["lens"];
    let field_of_view = lens["field_of_view_deg"].as_f64().unwrap();
    assert!(
        (field_of_view - 2.0 * HALF_FIELD.to_degrees()).abs() < 2.0,
        "{lens}"
    );
    let nadir = Rotation3::from_euler_angles(TILT.0, TILT.1, 0.35).inverse() * Vector3::z();
    let tilt = lens["tilt_deg"].as_f64().unwrap();
    assert!(
        (tilt - nadir.angle(&Vector3::z()).to_degrees()).abs() < 0.5,
        "{lens}"
    );
    assert_eq!(
        suggested["calibration"]["sources"]["lens"]["source"],
        "measured"
    );
    // Nothing is stored before it is applied; then the camera has nothing to suggest but its
    // height.
    assert_eq!(service.get("/calibrations/hall").await.status, 404);
    let stored = service
        .put("/calibrations/hall", &suggested["calibration"].to_string())
        .await;
    assert_eq!(stored.status, 201, "{}", stored.text());
    let answer = service
        .post_raw("camera=hall&profile=fast", rendered())
        .await;
    assert_eq!(answer.json()["calibration"]["id"], "hall");
    let suggested = service.get(PATH).await.json();
    assert_eq!(suggested["lens"], Value::Null);
    assert_eq!(suggested["replaces"], Value::Null);
}

#[tokio::test]
async fn frames_without_edges_are_refused_with_the_remedy() {
    let service = Service::start();
    service.post_raw("camera=hall&profile=fast", frame()).await;
    let suggested = found(&service).await;
    assert_eq!(suggested["state"], "refused");
    let refusal = &suggested["lens_refusal"];
    assert_eq!(refusal["reason"], "too_few_edges");
    assert!(
        refusal["detail"].as_str().unwrap().contains("lights on"),
        "{refusal}"
    );
}

#[tokio::test]
async fn unnamed_and_calibrated_cameras_have_no_suggestion() {
    let service = Service::start();
    service.post_raw("profile=fast", frame()).await;
    service
        .post_raw("camera=hall&calibration=lobby&profile=fast", frame())
        .await;
    service
        .post_raw("camera=gate&store=false&profile=fast", frame())
        .await;
    for camera in ["hall", "assumed", "lobby", "gate"] {
        let answer = service
            .get(&format!("/cameras/{camera}/suggested-calibration"))
            .await;
        assert_eq!(answer.status, 404, "{camera}");
    }
}
