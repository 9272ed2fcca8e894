//! The floor of a site as an image: cameras, lines, zones and everyone on it.

use std::fmt::Write as _;

use axum::{
    extract::{Path, State},
    http::header::CONTENT_TYPE,
    response::{IntoResponse, Response},
};
use lookdown_http::problem::Problem;
use lookdown_tracking::Plane;

use super::shared::{Shared, blocking, check_known, not_found, now_ms};
use crate::{scene::Scene, sums::Owner};

/// Least extent around a camera, meters.
const AROUND_CAMERA_M: f64 = 4.0;
/// Farthest from the first camera that is drawn, meters.
const MAX_EXTENT_M: f64 = 500.0;

/// Draw the floor of a site
#[utoipa::path(
    get, path = "/sites/{site}/floor.svg", tag = "sites", operation_id = "draw_site_floor",
    security((), ("bearer" = ["read"]), ("api_key" = ["read"])),
    params(("site" = String, Path, description = "The name of the site.")),
    responses((status = OK, description = "Cameras, lines, zones and persons.", body = String, content_type = "image/svg+xml"))
)]
pub(super) async fn svg(
    State(api): State<Shared>,
    Path(site): Path<String>,
) -> Result<Response, Problem> {
    let owner = Owner::Site(site.clone());
    check_known(&api, &owner).await?;
    blocking(move || {
        let counter = api.counter.lock();
        let Some(scene) = counter.site(&site) else {
            let detail = "the site has no camera now: send frames of its cameras";
            return Err(not_found(detail));
        };
        let last = scene.presence().last_ms;
        let is_current = last.is_some_and(|last| now_ms() - last <= counter.longest_gap_ms());
        let content_type = [(CONTENT_TYPE, "image/svg+xml")];
        Ok((content_type, drawn(scene, is_current)).into_response())
    })
    .await
}

/// Draws the site. Names of the calibration have no characters that XML would need to escape; those
/// of cameras are not drawn.
fn drawn(scene: &Scene, is_current: bool) -> String {
    let positions = scene
        .cameras
        .iter()
        .map(|camera| camera.definition.pose.position_m);
    let positions: Vec<_> = positions.collect();
    let first = positions.first().copied().unwrap_or_default();
    let tracks: Vec<_> = scene.tracks().filter(|_| is_current).collect();
    let places = tracks.iter().filter_map(|track| track.place(Plane::FloorM));
    let around = positions.iter().flat_map(|[x, y]| {
        [
            [x - AROUND_CAMERA_M, y - AROUND_CAMERA_M],
            [x + AROUND_CAMERA_M, y + AROUND_CAMERA_M],
        ]
    });
    let near = |value: f64, center: f64| value.clamp(center - MAX_EXTENT_M, center + MAX_EXTENT_M);
    let (mut least, mut most) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    for point in around.chain(places) {
        for axis in 0..2 {
            let value = near(point[axis], first[axis]);
            least[axis] = least[axis].min(value);
            most[axis] = most[axis].max(value);
        }
    }
    let ([x, y], [right, bottom]) = (least, most);
    let (width, height) = (right - x, bottom - y);
    // Writing to memory does not fail.
    let mut svg = String::new();
    let _ = write!(
        svg,
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"{x:.2} {y:.2} {width:.2} {height:.2}\" \
         width=\"{:.0}\" height=\"{:.0}\" font-family=\"sans-serif\" font-size=\"0.3\">\
         <rect x=\"{x:.2}\" y=\"{y:.2}\" width=\"{width:.2}\" height=\"{height:.2}\" fill=\"#f7f7f7\"/>",
        width * 40.0,
        height * 40.0,
    );
    for camera in &scene.cameras {
        for zone in camera
            .definition
            .zones
            .iter()
            .filter(|zone| zone.plane == Plane::FloorM)
        {
            svg.push_str("<polygon points=\"");
            for corner in zone.area.corners() {
                let _ = write!(svg, "{:.2},{:.2} ", corner.x, corner.y);
            }
            svg.push_str("\" fill=\"#2a9d3a\" fill-opacity=\"0.15\" stroke=\"#2a9d3a\" stroke-width=\"0.04\"/>");
        }
        for line in camera
            .definition
            .lines
            .iter()
            .filter(|line| line.plane == Plane::FloorM)
        {
            polyline(&mut svg, line.points.iter(), "#d1495b", 0.06);
        }
        let [x, y] = camera.definition.pose.position_m;
        let _ = write!(
            svg,
            "<rect x=\"{:.2}\" y=\"{:.2}\" width=\"0.3\" height=\"0.3\" fill=\"#444\"/>",
            x - 0.15,
            y - 0.15
        );
    }
    for track in tracks {
        let tail: Vec<_> = track
            .tail()
            .filter_map(|point| point.place(Plane::FloorM))
            .collect();
        polyline(&mut svg, tail.iter(), "#7aa6d8", 0.06);
        if let Some([x, y]) = track.place(Plane::FloorM) {
            let _ = write!(
                svg,
                "<circle cx=\"{x:.2}\" cy=\"{y:.2}\" r=\"0.2\" fill=\"#1d5fa8\"/>"
            );
        }
    }
    svg.push_str("</svg>\n");
    svg
}

fn polyline<'a>(
    svg: &mut String,
    points: impl Iterator<Item = &'a [f64; 2]>,
    color: &str,
    width: f64,
) {
    svg.push_str("<polyline fill=\"none\" points=\"");
    for [x, y] in points {
        let _ = write!(svg, "{x:.2},{y:.2} ");
    }
    let _ = write!(svg, "\" stroke=\"{color}\" stroke-width=\"{width}\"/>");
}
