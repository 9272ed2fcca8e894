//! The calibration resources: the scope `read` reads them, the scope `admin` changes them.

pub(in crate::api) mod fit;
mod upload;
pub(in crate::api) mod views;

use axum::{
    Json,
    extract::State,
    http::{
        HeaderMap, StatusCode,
        header::{CONTENT_TYPE, ETAG, LOCATION},
    },
    response::{IntoResponse, Response},
};
use lookdown_calibration::AreaShare;
use lookdown_common::report::ReportWarning;
use lookdown_http::entity_tags::{entity_tag, is_unmodified};
use serde::Serialize;
use utoipa::ToSchema;

use crate::{
    api::{
        ApiState,
        detect::report::to_warning,
        http::{
            deadline::{CALIBRATIONS, Deadline},
            problem::{Problem, ProblemKind},
        },
        openapi::RawBytes,
        require_scope::{RequireAdmin, RequireRead},
    },
    calibration_store::{CalibrationEntry, CalibrationRow, ChangeError},
};

use upload::{CalibrationAddress, CalibrationUpload, NewCalibrationAddress, write_condition};

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
    let tag = [(ETAG, entity_tag(entry.calibration.revision()))];
    if is_unmodified(&headers, entry.calibration.revision())? {
        return Ok((StatusCode::NOT_MODIFIED, tag).into_response());
    }
    let content_type = [(CONTENT_TYPE, "application/json")];
    Ok((tag, content_type, entry.native_file()).into_response())
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
