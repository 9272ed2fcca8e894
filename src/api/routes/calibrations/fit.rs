//! The fit of a camera to the straight edges of its frame.
//!
//! The OpenAPI description of what `POST /calibrations/{id}/fit` takes.

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
use lookdown_lens::self_calibration::{FieldOfView, IdealLens, KnownCamera};
use serde::Serialize;
use strum::VariantNames;
use tokio_util::sync::CancellationToken;
use utoipa::{
    IntoParams, PartialSchema, ToSchema,
    openapi::{
        KnownFormat, Object, ObjectBuilder, RefOr, Required, Schema, SchemaFormat,
        path::{Parameter, ParameterBuilder, ParameterIn},
        schema::{AdditionalProperties, ArrayBuilder, Type},
    },
};

use super::upload::NewCalibrationAddress;
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
            values_named(std::mem::take(&mut upload.form.parameters), NAMES)?;
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
    let (form, deadline) = (upload.form, upload.context.deadline);
    let images = [form.image].into_iter().chain(form.further_images);
    let images: Vec<_> = images.collect();
    if images.len() > FRAMES {
        let fault = format!("the form has more than {FRAMES} frames: send fewer");
        return Err(refused(&fault));
    }
    let limits = state.workers.engine().options.decode_limits;
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

/// The parameter of cameras on a ceiling.
pub(super) const CEILING: &str = "ceiling";

/// Returns the known values of a camera, from its data sheet, by the name of their parameter.
fn known_values() -> [(&'static str, Object); 3] {
    let lenses = ObjectBuilder::new()
        .schema_type(Type::String)
        .pattern(Some(format!("^({})$", IdealLens::VARIANTS.join("|"))))
        .description(Some(
            "The projection of the lens, from its data sheet. Cameras that look straight down \
             need it.",
        ));
    let field_of_view = ObjectBuilder::new()
        .schema_type(Type::Number)
        .format(Some(SchemaFormat::KnownFormat(KnownFormat::Double)))
        .minimum(Some(FieldOfView::MIN_DEGREES))
        .maximum(Some(FieldOfView::MAX_DEGREES))
        .description(Some("The field of view of the lens circle, degrees."));
    let ceiling = ObjectBuilder::new()
        .schema_type(Type::Boolean)
        .description(Some(
            "`true`: the camera is on a ceiling, even if one wall fills the image. Otherwise, a \
             camera that may be on a wall is refused.",
        ));
    [
        (LENS, lenses.build()),
        (FIELD_OF_VIEW_DEG, field_of_view.build()),
        (CEILING, ceiling.build()),
    ]
}

/// The known values in the query.
pub(super) struct KnownCameraQuery;

impl IntoParams for KnownCameraQuery {
    fn into_params(_: impl Fn() -> Option<ParameterIn>) -> Vec<Parameter> {
        let in_query = |(name, mut value): (&str, Object)| {
            ParameterBuilder::new()
                .name(name)
                .parameter_in(ParameterIn::Query)
                .required(Required::False)
                .description(value.description.take())
                .schema(Some(value))
                .build()
        };
        known_values().map(in_query).into()
    }
}

/// Frames in a form, with the known values as further fields.
pub(super) struct FitForm;

impl ToSchema for FitForm {
    fn schemas(_: &mut Vec<(String, RefOr<Schema>)>) {}
}

impl PartialSchema for FitForm {
    fn schema() -> RefOr<Schema> {
        // Clients in Go of openapi-generator do not compile with limits on the number of files.
        let frames = ArrayBuilder::new()
            .description(Some(format!(
                "1 to {FRAMES} frames of one camera at different times: JPEG, PNG or WebP files."
            )))
            .items(RawBytes::schema());
        let form = ObjectBuilder::new()
            .description(Some("Frames, and the known values of the query."))
            .property("img", frames)
            .required("img")
            .additional_properties(Some(AdditionalProperties::<Schema>::FreeForm(false)));
        let values = known_values().into_iter();
        values
            .fold(form, |form, (name, value)| form.property(name, value))
            .into()
    }
}
