//! The latest annotated image of a camera, drawn as the request specifies.

use axum::{
    extract::State,
    http::{
        HeaderMap, HeaderName, HeaderValue, StatusCode, Uri,
        header::{CACHE_CONTROL, CONTENT_TYPE, ETAG},
    },
    response::{IntoResponse, Response},
};
use bytes::Bytes;
use lookdown_common::text::{Quoted, one_line};
use lookdown_http::entity_tags::{entity_tag, is_unmodified};

use super::{address::CameraAddress, unknown};
use crate::{
    annotated_image::{AnnotationOptions, StoredFrameError},
    api::{
        ApiState,
        http::{
            caller::Caller,
            deadline::Deadline,
            problem::{Problem, ProblemKind},
            query::{pairs, query_parameters},
        },
        openapi::{AnnotationQuery, RawBytes},
        require_scope::RequireRead,
    },
};

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
