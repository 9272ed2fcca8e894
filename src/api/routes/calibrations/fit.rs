//! The fit of a camera to the straight edges of its frame.

use axum::{Json, extract::State, response::IntoResponse};
use lookdown_detect::imaging::{
    decode::{DecodeLimits, decode},
    room_fit::{RoomFrame, fit_room},
};
use lookdown_lens::{
    calibration::{
        CalibrationId,
        native::{NativeCalibration, NativeImage},
    },
    self_calibration::KnownLens,
};
use serde::Serialize;
use utoipa::ToSchema;

use super::address::NewCalibrationAddress;
use crate::{
    api::{
        ApiState,
        detect::upload::Upload,
        http::problem::{Problem, ProblemKind},
        openapi::RawBytes,
        routes::found_lens::FoundLens,
    },
    room_calibration::room_calibration,
};

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
/// frame does not determine them. Nothing is stored.
#[utoipa::path(
    post, path = "/calibrations/{id}/fit", tag = "calibrations", operation_id = "fit_calibration",
    params(
        ("id" = String, Path, pattern = "^[a-z0-9][a-z0-9_-]{0,63}$", description = "The ID of the new calibration."),
    ),
    request_body(
        description = "A frame: JPEG, PNG or WebP, with the lights on.",
        content((inline(RawBytes) = "application/octet-stream"), (inline(RawBytes) = "image/jpeg")),
    ),
    security((), ("bearer" = ["detect"]), ("api_key" = ["detect"])),
    responses((status = OK, description = "The fitted camera.", body = FittedCamera))
)]
pub(in crate::api) async fn fit(
    State(state): State<ApiState>,
    NewCalibrationAddress(id): NewCalibrationAddress,
    upload: Upload,
) -> Result<impl IntoResponse, Problem> {
    if let Some((name, _)) = upload.parameters.first() {
        let fault = "it has no effect here: remove it";
        return Err(Problem::of_parameter(
            ProblemKind::InvalidParameter,
            name,
            fault,
        ));
    }
    let (image, deadline) = (upload.image, upload.context.deadline);
    let limits = state.workers.engine().options().decode_limits;
    let fitting = state.workers.run(upload.caller.ticket(), move |_| {
        fitted(&limits, &id, &image)
    });
    let remedy = "send fewer requests at a time, use a smaller frame";
    let fitted = deadline.wait("no fit", remedy, fitting).await?;
    Ok(Json(fitted?))
}

/// Decodes the frame and fits the camera.
fn fitted(
    limits: &DecodeLimits,
    id: &CalibrationId,
    image: &[u8],
) -> Result<FittedCamera, Problem> {
    let refused =
        |fault: String| Problem::of_parameter(ProblemKind::InvalidParameter, "image", &fault);
    let decoded = decode(image, limits).map_err(|error| refused(error.to_string()))?;
    let frame = decoded.frame;
    let size = NativeImage {
        width: frame.width(),
        height: frame.height(),
    };
    let fit = fit_room(&[RoomFrame::of(&frame)], KnownLens::default());
    let fit = fit.map_err(|error| refused(error.to_string()))?;
    Ok(FittedCamera {
        calibration: room_calibration(id, size, &fit),
        lens: FoundLens::from(&fit),
    })
}
