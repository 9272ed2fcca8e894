//! The latest report of a camera, with an optional wait for a newer one.
//!
//! The latest annotated image of a camera, drawn as the request specifies.

use std::{sync::Arc, time::Duration};

use axum::{
    extract::State,
    http::{
        HeaderMap, HeaderName, HeaderValue, StatusCode, Uri,
        header::{CACHE_CONTROL, CONTENT_TYPE, ETAG},
    },
    response::{IntoResponse, Response},
};
use bytes::Bytes;
use lookdown_common::{
    report::Report,
    text::{Quoted, one_line},
};
use lookdown_detect::parameters::whole_number;
use lookdown_http::entity_tags::{entity_tag, is_unmodified};
use tokio::time::timeout_at;

use super::{CameraAddress, NO_CACHE, unknown};
use crate::{
    annotated_image::{AnnotationOptions, StoredFrameError},
    api::{
        ApiState,
        http::{
            caller::Caller,
            deadline::Deadline,
            problem::{Problem, ProblemKind},
            query::{pairs, parameters_named, query_parameters},
        },
        openapi::{AnnotationQuery, RawBytes},
        require_scope::RequireRead,
    },
    results::{Cameras, StoredReport},
};

/// Ten minutes, as for `timeout_millis`.
const MAX_WAIT_SECONDS: u64 = 600;

/// Get the latest report
///
/// `If-None-Match` with the `ETag` of a known report returns 304 while that is the latest. With
/// `wait`, the response waits for a newer report; 304 then means that none arrived in time.
#[utoipa::path(
    get, path = "/results/{camera}/latest", tag = "results", operation_id = "get_latest_result",
    params(
        ("camera" = String, Path, description = "The camera's name."),
        ("wait" = Option<u64>, Query, nullable = false, minimum = 0, maximum = 600,
            description = "Time to wait for a report other than that of `If-None-Match`, seconds; no \
                longer than the server's request timeout."),
        ("If-None-Match" = Option<String>, Header, nullable = false, pattern = r#"^(\*|"[!#-~]*")$"#,
            description = "The ETag of the known report."),
    ),
    security((), ("bearer" = ["read"]), ("api_key" = ["read"])),
    responses(
        (status = OK, description = "The report.", body = Report,
         headers(
            ("ETag" = String, description = "The report's ID."),
            ("Cache-Control" = String, description = "`no-cache`."),
         )),
        (status = NOT_MODIFIED, description = "There is no newer report."),
    )
)]
pub(in crate::api) async fn get_latest(
    State(state): State<ApiState>,
    _reader: RequireRead,
    deadline: Deadline,
    caller: Caller,
    CameraAddress(camera): CameraAddress,
    headers: HeaderMap,
    uri: Uri,
) -> Result<Response, Problem> {
    let [wait] = parameters_named(&uri, ["wait"])?;
    let seconds = wait.map_or(Ok(0), |wait| {
        whole_number("wait", &wait, 0..=MAX_WAIT_SECONDS)
    })?;
    let wait = Duration::from_secs(seconds);
    let report = if wait.is_zero() {
        state.results.latest(&camera).await?
    } else {
        let limit = deadline.within(Some(wait), "wait");
        let report = wait_for_newer(&state, &caller, &camera, &headers, limit).await?;
        // The key may have been removed during the wait.
        RequireRead::check_again(&state, &headers)?;
        report
    };
    let report = report.ok_or_else(|| unknown(&camera))?;
    let id = report.id.to_string();
    let about = [(ETAG, entity_tag(&id)), (CACHE_CONTROL, NO_CACHE)];
    if is_unmodified(&headers, &id)? {
        return Ok((StatusCode::NOT_MODIFIED, about).into_response());
    }
    let content_type = [(CONTENT_TYPE, "application/json")];
    Ok((about, content_type, report.report.json.clone()).into_response())
}

/// Returns the first report that the client does not have, or the latest one if none arrives in
/// time.
async fn wait_for_newer(
    state: &ApiState,
    caller: &Caller,
    camera: &str,
    headers: &HeaderMap,
    limit: Deadline,
) -> Result<Option<Arc<StoredReport>>, Problem> {
    // Subscribes before the first read, so no report is missed in between.
    let cameras = Cameras::One(camera.to_owned());
    let mut listening = state.results.listen(&caller.client, cameras).await?;
    let mut report = state.results.latest(camera).await?;
    let is_new = |report: &StoredReport| {
        let known = is_unmodified(headers, &report.id.to_string());
        known.map(|known| !known)
    };
    while !report.as_deref().map_or(Ok(false), is_new)?
        && let Ok(Some(notified)) = timeout_at(limit.at(), listening.next()).await
    {
        // A notification may be older than the report that was read.
        if report.as_ref().is_none_or(|now| notified.id > now.id) {
            report = Some(notified);
        }
    }
    Ok(report)
}

/// Only the client may cache the image, and must revalidate it before use.
const PRIVATE: HeaderValue = HeaderValue::from_static("private, no-cache");

/// Get the latest image
///
/// Returns the frame of the latest report as JPEG: upright, with the masks of the calibration, with
/// boxes or the layers in `draw`. Images are stored only for the cameras in the setting
/// `results.images`. `If-None-Match` with the `ETag` of a known image returns 304 while that is
/// the latest.
#[utoipa::path(
    get, path = "/results/{camera}/latest.jpg", tag = "results", operation_id = "get_latest_image",
    params(
        ("camera" = String, Path, description = "The camera's name."),
        AnnotationQuery,
        ("If-None-Match" = Option<String>, Header, nullable = false, pattern = r#"^(\*|"[!#-~]*")$"#,
            description = "The ETag of the known image."),
    ),
    security((), ("bearer" = ["read"]), ("api_key" = ["read"])),
    responses(
        (status = OK, description = "The annotated image.", content((inline(RawBytes) = "image/jpeg")),
         headers(
            ("ETag" = String, description = "The ID of the report of the image."),
            ("Cache-Control" = String, description = "`private, no-cache`."),
         )),
        (status = NOT_MODIFIED, description = "There is no newer image."),
    )
)]
pub(in crate::api) async fn get_latest_image(
    State(state): State<ApiState>,
    _reader: RequireRead,
    deadline: Deadline,
    caller: Caller,
    CameraAddress(camera): CameraAddress,
    headers: HeaderMap,
    uri: Uri,
) -> Result<Response, Problem> {
    let options = AnnotationOptions::parse(pairs(&query_parameters(&uri)?))?;
    let latest = state.results.latest(&camera).await?;
    let latest = latest.ok_or_else(|| unknown(&camera))?.id;
    // A client that has the latest image needs no other, so the image is not fetched from Redis.
    if is_unmodified(&headers, &latest.to_string())? {
        return Ok((StatusCode::NOT_MODIFIED, about(&latest.to_string())).into_response());
    }
    let kept = state.results.image(&camera).await?;
    let kept = kept.ok_or_else(|| none_kept(&camera))?;
    let id = kept.id.to_string();
    let drawing = state.workers.run(caller.ticket(), move |withdrawn| {
        kept.frame.annotated(&options, &|| withdrawn.is_cancelled())
    });
    let drawn = deadline
        .wait("the image was not drawn", "send fewer requests", drawing)
        .await?;
    let image = Bytes::from(drawn.map_err(|error| undrawn(&camera, error))?);
    Ok((about(&id), [(CONTENT_TYPE, "image/jpeg")], image).into_response())
}

fn about(id: &str) -> [(HeaderName, HeaderValue); 2] {
    [(ETAG, entity_tag(id)), (CACHE_CONTROL, PRIVATE)]
}

/// The stored data may be from another server or another program.
fn undrawn(camera: &str, error: StoredFrameError) -> Problem {
    if !matches!(
        error,
        StoredFrameError::Sketch(_) | StoredFrameError::Frame(_)
    ) {
        return Problem::internal(error);
    }
    let camera = Quoted(camera);
    let error = one_line(&error);
    let detail = format!(
        "the stored image of the camera {camera} cannot be used ({error}): the next frame of the \
         camera replaces it"
    );
    Problem::new(ProblemKind::ImageNotKept, detail)
}

fn none_kept(camera: &str) -> Problem {
    let camera = Quoted(camera);
    let detail = format!(
        "there is no image of the camera {camera}: images are stored from the next frame on, for the cameras in \
         the setting results.images (* for all) or with keep_image, for at most results.max_images cameras"
    );
    Problem::new(ProblemKind::ImageNotKept, detail)
}
