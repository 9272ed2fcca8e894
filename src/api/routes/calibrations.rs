//! The calibration resources: the scope `read` reads them, the scope `admin` changes them.

pub(in crate::api) mod fit;
mod row;
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
use lookdown_http::entity_tags::{entity_tag, is_unmodified};

use self::{
    row::CalibrationInfo,
    upload::CalibrationUpload,
    upload::write_condition,
    upload::{CalibrationAddress, NewCalibrationAddress},
};
use crate::{
    api::{
        ApiState,
        http::{
            deadline::{CALIBRATIONS, Deadline},
            problem::{Problem, ProblemKind},
        },
        openapi::RawBytes,
        require_scope::{RequireAdmin, RequireRead},
    },
    calibration_store::ChangeError,
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
