//! The fit of a camera to the straight edges of its frame.

use axum::{
    Json,
    extract::{FromRequest, Request, State},
    response::IntoResponse,
};
use bytes::Bytes;
use lookdown_calibration::{
    CalibrationId,
    native::{NativeCalibration, NativeImage},
};
use lookdown_imaging::{
    decode::{DecodeLimits, decode},
    room_fit::{RoomFrame, fit_room},
};
use lookdown_lens::self_calibration::KnownCamera;
use serde::Serialize;
use tokio_util::sync::CancellationToken;
use utoipa::ToSchema;

use super::{
    address::NewCalibrationAddress,
    fit_form::{CEILING, FitForm, KnownCameraQuery},
};
use crate::{
    api::{
        ApiState,
        detect::upload::{Upload, frames_among},
        http::{
            problem::{Problem, ProblemKind},
            query::values_named,
        },
        openapi::RawBytes,
        routes::found_lens::FoundLens,
    },
    room_calibration::{
        known::{FIELD_OF_VIEW_DEG, LENS, parsed},
        known_camera, room_calibration,
    },
    suggestions::FRAMES,
};

const NAMES: [&str; 3] = [LENS, FIELD_OF_VIEW_DEG, CEILING];

/// Frames of one camera, and its known values.
pub(in crate::api) struct FitRequest {
    upload: Upload,
    known: KnownCamera,
}

impl FromRequest<ApiState> for FitRequest {
    type Rejection = Problem;

    async fn from_request(request: Request, state: &ApiState) -> Result<Self, Problem> {
        let mut upload = Upload::accept(request, state, |name| frames_among(&NAMES, name)).await?;
        let [lens, field_of_view, ceiling] =
            values_named(std::mem::take(&mut upload.parameters), NAMES)?;
        let is_on_ceiling = parsed(CEILING, ceiling.as_deref(), "true or false")?;
        let known = known_camera(
            lens.as_deref(),
            field_of_view.as_deref(),
            is_on_ceiling.unwrap_or_default(),
        )?;
        Ok(Self { upload, known })
    }
}

/// A fitted camera.
#[derive(Serialize, ToSchema)]
pub(in crate::api) struct FittedCamera {
    /// The calibration in the native format. Its `sources` have the standard deviations: of `lens`
    /// in percent of the radius, of `center` in pixels, of `world_up` in degrees.
    #[schema(value_type = Object)]
    calibration: NativeCalibration,
    #[serde(flatten)]
    lens: FoundLens,
}

/// Find the lens
///
/// Fits lens, center and level to the straight edges of a frame of the camera, or says why the
/// frame does not determine them. A form may have up to five frames of different times. Known
/// values are kept. Nothing is stored, and the answer has nothing of a stored calibration of this
/// ID. A problem of frames that do not determine the camera has the kind of the refusal in
/// `refusal`: those of `reason` in a suggested calibration.
#[utoipa::path(
    post, path = "/calibrations/{id}/fit", tag = "calibrations", operation_id = "fit_calibration",
    params(
        ("id" = String, Path, pattern = "^[a-z0-9][a-z0-9_-]{0,63}$", description = "The ID of the new calibration."),
        KnownCameraQuery,
    ),
    request_body(
        description = "Frames in a form, or one frame alone: JPEG, PNG or WebP, with the lights on.",
        content(
            (FitForm = "multipart/form-data"),
            (inline(RawBytes) = "application/octet-stream"), (inline(RawBytes) = "image/jpeg"),
        ),
    ),
    security((), ("bearer" = ["detect"]), ("api_key" = ["detect"])),
    responses((status = OK, description = "The fitted camera.", body = FittedCamera))
)]
pub(in crate::api) async fn fit(
    State(state): State<ApiState>,
    NewCalibrationAddress(id): NewCalibrationAddress,
    FitRequest { upload, known }: FitRequest,
) -> Result<impl IntoResponse, Problem> {
    let (image, deadline) = (upload.image, upload.context.deadline);
    let images: Vec<_> = [image].into_iter().chain(upload.further_images).collect();
    if images.len() > FRAMES {
        let fault = format!("the form has more than {FRAMES} frames: send fewer");
        return Err(refused(&fault));
    }
    let limits = state.workers.engine().options().decode_limits;
    let ticket = upload.caller.ticket();
    let fitting = async {
        let turn = match state.fits.next().await {
            Ok(turn) => turn,
            Err(problem) => return Ok(Err(problem)),
        };
        let work = move |_: &CancellationToken| {
            let _turn = turn;
            fitted(&limits, &id, &images, known)
        };
        state.workers.run(ticket, work).await
    };
    let remedy = "send fewer requests at a time, use a smaller frame";
    let fitted = deadline.wait("no fit", remedy, fitting).await?;
    Ok(Json(fitted?))
}

/// Decodes the frames, one after the other, and fits the camera.
fn fitted(
    limits: &DecodeLimits,
    id: &CalibrationId,
    images: &[Bytes],
    known: KnownCamera,
) -> Result<FittedCamera, Problem> {
    let mut frames: Vec<RoomFrame> = Vec::with_capacity(images.len());
    for image in images {
        let decoded = decode(image, limits).map_err(|error| refused(&error.to_string()))?;
        let frame = RoomFrame::new(&decoded.frame);
        if let Some(first) = frames.first()
            && first.size() != frame.size()
        {
            return Err(refused(
                "the frames differ in size: send frames of one camera",
            ));
        }
        frames.push(frame);
    }
    let fit = fit_room(&frames, known).map_err(|refusal| {
        refused(&refusal.to_string()).with_member("refusal", refusal.reason())
    })?;
    let (width, height) = frames[0].size();
    Ok(FittedCamera {
        calibration: room_calibration(id, NativeImage { width, height }, &fit, known),
        lens: FoundLens::from(&fit),
    })
}

fn refused(fault: &str) -> Problem {
    Problem::for_parameter(ProblemKind::InvalidParameter, "image", fault)
}
