//! The latest picture of a camera, with what was found drawn into it as whoever asks wants it.

use axum::{
    extract::State,
    http::{
        HeaderMap, HeaderName, HeaderValue, StatusCode, Uri,
        header::{CACHE_CONTROL, CONTENT_TYPE, ETAG},
    },
    response::{IntoResponse, Response},
};
use bytes::Bytes;

use super::{address::CameraAddress, unknown};
use crate::{
    annotated_picture::{KeptFrame, PictureOptions},
    api::{
        ApiState,
        access::Reader,
        deadline::Deadline,
        entity_tags::{entity_tag, is_unmodified},
        openapi::{PictureQuery, RawBytes},
        parameters::pairs,
        problem::{Problem, ProblemKind},
        upload::query_parameters,
    },
    quoted::Quoted,
};

/// For the eyes of who has asked, who may keep it, but must ask each time whether it is still right.
const PRIVATE: HeaderValue = HeaderValue::from_static("private, no-cache");

/// Get the latest picture of a camera.
///
/// The frame of its latest report as JPEG, upright, masked where the calibration says so, with boxes or
/// whatever `draw` names. Pictures are kept only of the cameras that the setting `results.pictures` names.
/// `If-None-Match` with the `ETag` of the picture one has is answered 304 while that is the latest.
#[utoipa::path(
    get, path = "/results/{camera}/latest.jpg", tag = "results", operation_id = "get_latest_picture",
    params(
        ("camera" = String, Path, description = "The camera's name."),
        PictureQuery,
        ("If-None-Match" = Option<String>, Header, nullable = false, pattern = r#"^(\*|"[!#-~]*")$"#,
            description = "The ETag of the picture that is there already."),
    ),
    security((), ("bearer" = ["read"]), ("api_key" = ["read"])),
    responses(
        (status = OK, description = "The picture.", content((inline(RawBytes) = "image/jpeg")),
         headers(
            ("ETag" = String, description = "The ID of the picture's report."),
            ("Cache-Control" = String, description = "`private, no-cache`."),
         )),
        (status = NOT_MODIFIED, description = "There is none newer than the one asked with."),
    )
)]
pub(in crate::api) async fn get_picture(
    State(state): State<ApiState>,
    _reader: Reader,
    deadline: Deadline,
    CameraAddress(camera): CameraAddress,
    headers: HeaderMap,
    uri: Uri,
) -> Result<Response, Problem> {
    let options = PictureOptions::parse(pairs(&query_parameters(&uri)?))?;
    let latest = state.results.latest(&camera).await?;
    let latest = latest.ok_or_else(|| unknown(&camera))?.id;
    // Who has the latest report's picture needs no other, and Redis need not send it.
    if is_unmodified(&headers, &latest.to_string())? {
        return Ok((StatusCode::NOT_MODIFIED, about(&latest.to_string())).into_response());
    }
    let kept = state.results.picture(&camera).await?;
    let kept = kept.ok_or_else(|| none_kept(&camera))?;
    let id = kept.id.to_string();
    let frame = KeptFrame {
        jpeg: kept.picture.frame.clone(),
        sketch: kept.picture.sketch.clone(),
    };
    let drawing = state
        .workers
        .run(move |withdrawn| frame.annotated(&options, &|| withdrawn.is_cancelled()));
    let drawn = deadline.wait("the picture was not drawn", drawing).await?;
    let picture = Bytes::from(drawn.map_err(Problem::internal)?);
    Ok((about(&id), [(CONTENT_TYPE, "image/jpeg")], picture).into_response())
}

fn about(id: &str) -> [(HeaderName, HeaderValue); 2] {
    [(ETAG, entity_tag(id)), (CACHE_CONTROL, PRIVATE)]
}

fn none_kept(camera: &str) -> Problem {
    let camera = Quoted(camera);
    let detail = format!(
        "no picture of the camera {camera} is kept: pictures are kept from the next frame on of the cameras that \
         the setting results.pictures names (* is all of them), but of no more than results.max_pictures"
    );
    Problem::new(ProblemKind::PictureNotKept, detail)
}
