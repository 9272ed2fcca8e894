//! The fit of a camera to the straight edges of its frame.

use axum::{
    Json,
    extract::{FromRequest, Request, State},
    response::IntoResponse,
};
use lookdown_detect::imaging::{
    decode::{DecodeLimits, decode},
    room_fit::{RoomFrame, fit_room},
};
use lookdown_lens::{
    calibration::{
        CalibrationId,
        native::{NativeCalibration, NativeImage},
    },
    self_calibration::KnownCamera,
};
use serde::Serialize;
use utoipa::{IntoParams, ToSchema};

use super::address::NewCalibrationAddress;
use crate::{
    api::{
        ApiState,
        detect::upload::{Upload, use_among},
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
};

const CEILING: &str = "ceiling";
const NAMES: [&str; 3] = [LENS, FIELD_OF_VIEW_DEG, CEILING];

/// The known values of the camera, from its data sheet.
#[derive(IntoParams)]
#[into_params(parameter_in = Query)]
#[expect(
    dead_code,
    reason = "documents the parameters that `known_camera` parses"
)]
struct KnownCameraQuery {
    /// The projection of the lens. Cameras that look straight down need it. Most ceiling cameras
    /// are `equidistant`.
    #[param(pattern = "^(equidistant|equisolid|stereographic|orthographic)$")]
    lens: Option<String>,
    /// The field of view of the lens circle, degrees.
    #[param(minimum = 60, maximum = 300)]
    field_of_view_deg: Option<f64>,
    /// `true`: the camera is on a ceiling, even if one wall fills the image. Otherwise, a camera
    /// that may be on a wall is refused.
    ceiling: Option<bool>,
}

/// A frame, and the known values of its camera.
pub(in crate::api) struct FitRequest {
    upload: Upload,
    known: KnownCamera,
}

impl FromRequest<ApiState> for FitRequest {
    type Rejection = Problem;

    async fn from_request(request: Request, state: &ApiState) -> Result<Self, Problem> {
        let mut upload = Upload::accept(request, state, |name| use_among(&NAMES, name)).await?;
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
/// frame does not determine them. Known values are kept. Nothing is stored.
#[utoipa::path(
    post, path = "/calibrations/{id}/fit", tag = "calibrations", operation_id = "fit_calibration",
    params(
        ("id" = String, Path, pattern = "^[a-z0-9][a-z0-9_-]{0,63}$", description = "The ID of the new calibration."),
        KnownCameraQuery,
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
    FitRequest { upload, known }: FitRequest,
) -> Result<impl IntoResponse, Problem> {
    let (image, deadline) = (upload.image, upload.context.deadline);
    let limits = state.workers.engine().options().decode_limits;
    let fitting = state.workers.run(upload.caller.ticket(), move |_| {
        fitted(&limits, &id, &image, known)
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
    known: KnownCamera,
) -> Result<FittedCamera, Problem> {
    let refused =
        |fault: String| Problem::of_parameter(ProblemKind::InvalidParameter, "image", &fault);
    let decoded = decode(image, limits).map_err(|error| refused(error.to_string()))?;
    let frame = decoded.frame;
    let size = NativeImage {
        width: frame.width(),
        height: frame.height(),
    };
    let fit = fit_room(&[RoomFrame::of(&frame)], known);
    let fit = fit.map_err(|error| refused(error.to_string()))?;
    Ok(FittedCamera {
        calibration: room_calibration(id, size, &fit, known),
        lens: FoundLens::from(&fit),
    })
}
