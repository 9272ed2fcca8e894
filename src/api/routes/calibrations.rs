//! The calibration resources: the scope `read` reads them, the scope `admin` changes them. A camera
//! is fitted to the straight edges of its frame.

mod upload;
pub(in crate::api) mod views;

use axum::{
    Json,
    extract::{FromRequest, Request, State},
    http::{
        HeaderMap, StatusCode,
        header::{CONTENT_TYPE, ETAG, LOCATION},
    },
    response::{IntoResponse, Response},
};
use bytes::Bytes;
use lookdown_calibration::{
    AreaShare, CalibrationId,
    native::{NativeCalibration, NativeImage},
};
use lookdown_common::report::ReportWarning;
use lookdown_http::entity_tags::{entity_tag, unless_known};
use lookdown_imaging::{
    decode::{DecodeLimits, decode},
    room_fit::{RoomFrame, fit_room},
};
use lookdown_lens::self_calibration::{FieldOfView, IdealLens, KnownCamera};
use serde::Serialize;
use strum::VariantNames;
use tokio_util::sync::CancellationToken;
use upload::{CalibrationAddress, CalibrationUpload, NewCalibrationAddress, write_condition};
use utoipa::{
    IntoParams, PartialSchema, ToSchema,
    openapi::{
        KnownFormat, Object, ObjectBuilder, RefOr, Required, Schema, SchemaFormat,
        path::{Parameter, ParameterBuilder, ParameterIn},
        schema::{AdditionalProperties, ArrayBuilder, Type},
    },
};

use super::found_lens::FoundLens;
use crate::{
    api::{
        ApiState,
        detect::{
            report::to_warning,
            upload::{Upload, frames_among},
        },
        http::{
            deadline::{CALIBRATIONS, Deadline},
            problem::{Problem, ProblemKind},
            query::values_named,
        },
        openapi::RawBytes,
        require_scope::{RequireAdmin, RequireRead},
    },
    calibration_store::{CalibrationEntry, CalibrationRow, ChangeError},
    room_calibration::{FIELD_OF_VIEW_DEG, LENS, known_camera, parsed, room_calibration},
    suggestions::FRAMES,
};

/// List calibrations
///
/// Includes calibrations whose file cannot be used, with the reason. Those of the sample frames
/// (`sample-office`, `sample-canteen`, `sample-lounge`) are built in and not listed.
#[utoipa::path(
    get, path = "/calibrations", tag = "calibrations", operation_id = "list_calibrations",
    security((), ("bearer" = ["read"]), ("api_key" = ["read"])),
    responses(
        (status = OK, description = "By ID.", body = Vec<CalibrationInfo>),
    )
)]
pub(in crate::api) async fn list(
    State(state): State<ApiState>,
    _reader: RequireRead,
) -> Json<Vec<CalibrationInfo>> {
    let rows = state.calibrations.rows();
    Json(rows.into_iter().map(CalibrationInfo::from).collect())
}

/// Get a calibration
///
/// Returns the native format, whatever the format of the file. `If-None-Match` returns 304 while
/// the revision is unchanged.
#[utoipa::path(
    get, path = "/calibrations/{id}", tag = "calibrations", operation_id = "get_calibration",
    params(("id" = String, Path, pattern = "^[a-z0-9][a-z0-9_-]{0,63}$", description = "The calibration's ID.")),
    security((), ("bearer" = ["read"]), ("api_key" = ["read"])),
    responses(
        (status = OK, description = "The calibration in the native format.", body = Object,
         headers(("ETag" = String, description = "The revision, as in reports."))),
        (status = NOT_MODIFIED, description = "The revision is unchanged."),
    )
)]
pub(in crate::api) async fn get(
    State(state): State<ApiState>,
    _reader: RequireRead,
    CalibrationAddress(id): CalibrationAddress,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    let entry = state
        .calibrations
        .entry(&id)
        .ok_or_else(|| unknown(&state, &id))?;
    let revision = entry.calibration.revision();
    let tag = [(ETAG, entity_tag(revision))];
    let content_type = [(CONTENT_TYPE, "application/json")];
    let answer = || (content_type, entry.native_file());
    Ok(unless_known(&headers, revision, tag, answer)?)
}

/// Create or replace a calibration
///
/// Accepts the native format as JSON, YAML or TOML, or the file of another program. `camera`
/// selects a camera of a file with several; `size` states the frame size for formats without one.
/// The calibration is checked, stored in the native format and in use when the response arrives.
/// `If-Match` replaces only the given revision, `If-None-Match: *` only creates.
#[utoipa::path(
    put, path = "/calibrations/{id}", tag = "calibrations", operation_id = "put_calibration",
    params(
        ("id" = String, Path, pattern = "^[a-z0-9][a-z0-9_-]{0,63}$", description = "The calibration's ID."),
        ("camera" = Option<String>, Query, description = "The name of the camera in the file."),
        ("size" = Option<String>, Query, description = "The size of the camera's frames in pixels, such as \
            `1280x960`, for formats that do not state it.", pattern = "^[0-9]+x[0-9]+$"),
        ("If-Match" = Option<String>, Header, nullable = false, pattern = r#"^(\*|"[!#-~]*")$"#,
            description = "The revision to replace, or `*`. Cannot be combined with `If-None-Match`."),
        ("If-None-Match" = Option<String>, Header, nullable = false, pattern = r"^\*$",
            description = "`*`: create only."),
    ),
    request_body(
        description = "A calibration file of at most 1 MiB. Its content decides the format, not the content type.",
        content((Object = "application/json"), (inline(RawBytes) = "application/octet-stream")),
    ),
    security((), ("bearer" = ["admin"]), ("api_key" = ["admin"])),
    responses(
        (status = OK, description = "Replaced.", body = CalibrationInfo,
         headers(("ETag" = String, description = "The revision, as in reports."))),
        (status = CREATED, description = "Created.", body = CalibrationInfo,
         headers(("ETag" = String, description = "The revision, as in reports."))),
    )
)]
pub(in crate::api) async fn put(
    State(state): State<ApiState>,
    _administrator: RequireAdmin,
    deadline: Deadline,
    NewCalibrationAddress(id): NewCalibrationAddress,
    headers: HeaderMap,
    upload: CalibrationUpload,
) -> Result<Response, Problem> {
    let condition = write_condition(&headers)?;
    let location = format!("/calibrations/{id}");
    let put = deadline.using(&CALIBRATIONS, move || {
        let CalibrationUpload { content, reading } = upload;
        state.calibrations.put(&id, &content, &reading, &condition)
    });
    let put = put.await?;
    let tag = [(ETAG, entity_tag(put.entry.calibration.revision()))];
    let info = Json(CalibrationInfo::from(&*put.entry));
    Ok(if put.created {
        (StatusCode::CREATED, tag, [(LOCATION, location)], info).into_response()
    } else {
        (tag, info).into_response()
    })
}

/// Delete a calibration
///
/// Frames that were accepted earlier still use it. `If-Match` deletes only the given revision.
#[utoipa::path(
    delete, path = "/calibrations/{id}", tag = "calibrations", operation_id = "delete_calibration",
    params(
        ("id" = String, Path, pattern = "^[a-z0-9][a-z0-9_-]{0,63}$", description = "The calibration's ID."),
        ("If-Match" = Option<String>, Header, nullable = false, pattern = r#"^(\*|"[!#-~]*")$"#,
            description = "The revision to delete, or `*`."),
    ),
    security((), ("bearer" = ["admin"]), ("api_key" = ["admin"])),
    responses((status = NO_CONTENT, description = "The calibration is deleted."))
)]
pub(in crate::api) async fn delete(
    State(state): State<ApiState>,
    _administrator: RequireAdmin,
    deadline: Deadline,
    CalibrationAddress(id): CalibrationAddress,
    headers: HeaderMap,
) -> Result<StatusCode, Problem> {
    let condition = write_condition(&headers)?;
    let delete = deadline.using(&CALIBRATIONS, move || {
        state.calibrations.delete(&id, &condition)
    });
    delete.await?;
    Ok(StatusCode::NO_CONTENT)
}

/// Returns the problem of a calibration ID that is not in use.
fn unknown(state: &ApiState, id: &lookdown_calibration::CalibrationId) -> Problem {
    let rows = state.calibrations.rows();
    let row = rows.into_iter().find(|row| row.id == *id);
    let detail = match row.and_then(|row| Some((row.file, row.problem?))) {
        Some((file, problem)) => format!("{file} cannot be used: {problem}"),
        None => ChangeError::Unknown { id: id.clone() }.to_string(),
    };
    Problem::new(ProblemKind::UnknownCalibration, detail)
}

/// A calibration.
#[derive(Serialize, ToSchema)]
#[schema(example = json!({
    "id": "lobby", "revision": "6b2a0c51f7d3", "file": "lobby.json",
    "image": { "width": 1680, "height": 1680 }, "lens": "equidistant"
}))]
pub(in crate::api) struct CalibrationInfo {
    /// The ID of the calibration.
    id: String,
    /// The revision in use, as in reports; absent when no revision is in use.
    #[serde(skip_serializing_if = "Option::is_none")]
    revision: Option<String>,
    /// The name of the file.
    file: String,
    /// The size of the frames that the calibration was made for.
    #[serde(skip_serializing_if = "Option::is_none")]
    image: Option<ImageSize>,
    /// The lens model.
    #[serde(skip_serializing_if = "Option::is_none")]
    lens: Option<&'static str>,
    /// The reason why the newest version of the file is not used.
    #[serde(skip_serializing_if = "Option::is_none")]
    problem: Option<String>,
    /// The shares of the frame that zones, masks, areas and ignored places in the frame cover.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    coverage: Vec<Coverage>,
    /// Assumptions made when the file was read, and implausible properties.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    warnings: Vec<ReportWarning>,
}

/// The share of the frame that an area covers.
#[derive(Serialize, ToSchema)]
struct Coverage {
    /// The field of the area, such as `masks[0]`.
    field: String,
    /// The share, percent.
    percent: f64,
}

/// A frame size.
#[derive(Serialize, ToSchema)]
struct ImageSize {
    /// Pixels.
    width: u32,
    /// Pixels.
    height: u32,
}

impl From<&CalibrationEntry> for CalibrationInfo {
    fn from(entry: &CalibrationEntry) -> Self {
        let calibration = &entry.calibration;
        let (width, height) = calibration.image_size();
        let mut warnings: Vec<_> = entry.notes.iter().map(to_warning).collect();
        warnings.extend(calibration.warnings().iter().map(to_warning));
        let shares = calibration.areas().shares(width, height).into_iter();
        let coverage = shares.map(|AreaShare { field, percent }| Coverage {
            field,
            percent: (percent * 1000.0).round() / 1000.0,
        });
        Self {
            id: calibration.id().to_string(),
            revision: Some(calibration.revision().to_owned()),
            file: entry.file.clone(),
            image: Some(ImageSize { width, height }),
            lens: Some(calibration.lens().model()),
            problem: None,
            coverage: coverage.collect(),
            warnings,
        }
    }
}

impl From<CalibrationRow> for CalibrationInfo {
    fn from(row: CalibrationRow) -> Self {
        let known = row.entry.as_deref().map(Self::from);
        Self {
            problem: row.problem,
            ..known.unwrap_or(Self {
                id: row.id.to_string(),
                revision: None,
                file: row.file,
                image: None,
                lens: None,
                problem: None,
                coverage: Vec::new(),
                warnings: Vec::new(),
            })
        }
    }
}

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
struct FittedCamera {
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
const CEILING: &str = "ceiling";

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
struct KnownCameraQuery;

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
struct FitForm;

impl ToSchema for FitForm {}

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
