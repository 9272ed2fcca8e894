//! The web page at `/`: the files of the folder `web` and the samples, inside the executable. It
//! loads nothing from other hosts and uses the public API.

use std::sync::LazyLock;

use axum::{
    Json, Router,
    extract::{Path, State},
    http::{
        HeaderMap, HeaderValue, Uri,
        header::{CACHE_CONTROL, CONTENT_TYPE},
    },
    middleware::map_response,
    response::{IntoResponse, Response},
    routing::get,
};
use lookdown_calibration::revision::revision_of;
use lookdown_http::{
    entity_tags::{entity_tag, revalidated, unless_known},
    page_headers,
};
use serde::Serialize;

use crate::{
    api::{
        ApiState,
        http::problem::{Problem, ProblemKind},
        require_scope::RequireAdmin,
    },
    samples::SAMPLES,
};

/// A file of the page.
struct Asset {
    name: &'static str,
    media_type: &'static str,
    content: &'static [u8],
    /// The revision; it changes with the content.
    revision: String,
}

const PAGE: &str = "index.html";

macro_rules! assets {
    ($($name:literal),* $(,)?) => {
        [$(Asset::new(
            $name,
            include_bytes!(concat!(env!("CARGO_MANIFEST_DIR"), "/web/", $name)),
        )),*]
    };
}

/// All files of the page. A test checks that none is missing.
static ASSETS: LazyLock<Vec<Asset>> = LazyLock::new(|| {
    let files = assets![
        "index.html",
        "style.css",
        "panels.css",
        "zones.css",
        "icon.svg",
        "floor_alerts.js",
        "furniture.js",
        "ignore_place.js",
        "reference_counts.js",
        "reference_crossings.js",
        "main.js",
        "dom.js",
        "server.js",
        "shared.js",
        "key.js",
        "progress.js",
        "frame.js",
        "parameters.js",
        "detect.js",
        "marks.js",
        "findings.js",
        "find_lens.js",
        "live_frames.js",
        "live_view.js",
        "geometry.js",
        "views.js",
        "straighten.js",
        "cameras.js",
        "cameras.css",
        "camera_card.js",
        "camera_day.js",
        "camera_form.js",
        "camera_states.js",
        "use_frame.js",
        "suggestion.js",
        "counts.js",
        "counts_drawing.js",
        "counts.css",
        "plot.js",
        "floor.js",
        "lens.js",
        "lens_choice.js",
        "calibrate.js",
        "calibration_sources.js",
        "calibration_values.js",
        "comparison.js",
        "circle_handles.js",
        "zones.js",
        "zone_surfaces.js",
        "areas.js",
        "area_editor.js",
        "area_shapes.js",
        "area_gestures.js",
        "area_list.js",
        "area_counts.js",
        "edit_history.js",
        "floor_map.js",
    ];
    let samples = SAMPLES
        .iter()
        .map(|sample| Asset::new(sample.file, sample.jpeg));
    files.into_iter().chain(samples).collect()
});

impl Asset {
    fn new(name: &'static str, content: &'static [u8]) -> Self {
        Self {
            name,
            media_type: match name.rsplit_once('.') {
                Some((_, "html")) => "text/html; charset=utf-8",
                Some((_, "css")) => "text/css; charset=utf-8",
                Some((_, "js")) => "text/javascript; charset=utf-8",
                Some((_, "svg")) => "image/svg+xml",
                _ => "image/jpeg",
            },
            content,
            revision: revision_of(content),
        }
    }
}

/// The server's settings that the page needs.
#[derive(Serialize)]
struct PageOptions {
    /// True if this server answers `/counts`.
    has_counts: bool,
    /// True if this server answers `/cameras`.
    has_cameras: bool,
    /// True if the request may change calibrations and cameras.
    can_change: bool,
    /// Longest time that the latest image of a camera is kept.
    image_age_seconds: u64,
}

/// Returns the routes of the page and its files.
pub(in crate::api) fn router() -> Router<ApiState> {
    let page = async |headers: HeaderMap| answer(PAGE, &headers, "/");
    let asset = async |Path(name): Path<String>, uri: Uri, headers: HeaderMap| {
        answer(&name, &headers, uri.path())
    };
    let options = async |State(state): State<ApiState>, admin: Result<RequireAdmin, Problem>| {
        let options = PageOptions {
            has_counts: state.options.companions.has_counts(),
            has_cameras: state.options.companions.cameras().is_some(),
            can_change: admin.is_ok(),
            image_age_seconds: state.options.settings.results.limits.max_age.as_secs(),
        };
        let no_store = [(CACHE_CONTROL, HeaderValue::from_static("no-store"))];
        (no_store, Json(options)).into_response()
    };
    Router::new()
        .route("/", get(page))
        .route("/assets/options.json", get(options))
        .route("/assets/{name}", get(asset))
        .route_layer(map_response(page_headers::for_web_page))
}

fn answer(name: &str, headers: &HeaderMap, path: &str) -> Result<Response, Problem> {
    let asset = ASSETS.iter().find(|asset| asset.name == name);
    let asset = asset.ok_or_else(|| {
        Problem::new(
            ProblemKind::NotFound,
            format!("there is no resource at {path}"),
        )
    })?;
    // Browsers may cache the file but must revalidate it: after an update of the server, old and
    // new scripts must not mix.
    let kept = revalidated(entity_tag(&asset.revision));
    let answer = || ([(CONTENT_TYPE, asset.media_type)], asset.content);
    Ok(unless_known(headers, &asset.revision, kept, answer)?)
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn every_file_of_the_folder_is_served() {
        for file in fs::read_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/web")).unwrap() {
            let name = file.unwrap().file_name().into_string().unwrap();
            let is_served = ASSETS.iter().any(|asset| asset.name == name);
            // This file tells Node the module type for tests and is not served.
            assert_eq!(is_served, name != "package.json", "{name}");
        }
    }
}
