//! An uploaded calibration file.
//!
//! Conditional changes of calibrations (RFC 9110, section 13.1). The entity tag is the revision.
//!
//! The calibration ID in the path.

use axum::{
    extract::{FromRequest, FromRequestParts, Path, Request},
    http::{
        HeaderMap, Uri,
        header::{IF_MATCH, IF_NONE_MATCH},
        request::Parts,
    },
};
use bytes::Bytes;
use lookdown_calibration::{CalibrationFile, CalibrationId, native::NotAFrameSize};
use lookdown_http::entity_tags::{Named, named};

use crate::{
    api::{
        ApiState,
        http::{
            context::RequestContext,
            problem::{Problem, ProblemKind},
            query::parameters_named,
        },
    },
    calibration_store::{Reading, WriteCondition},
};

/// An uploaded calibration file with the options to read it.
pub(in crate::api) struct CalibrationUpload {
    /// The content of the file.
    pub(super) content: Bytes,
    /// The options to read it.
    pub(super) reading: Reading,
}

/// An uploaded calibration file and the view plan to preview.
pub(in crate::api) struct CalibrationTrial {
    /// The uploaded file.
    pub(super) upload: CalibrationUpload,
    /// The requested profile.
    pub(super) profile: Option<String>,
    /// The requested grid.
    pub(super) grid: Option<String>,
}

impl FromRequest<ApiState> for CalibrationUpload {
    type Rejection = Problem;

    async fn from_request(request: Request, state: &ApiState) -> Result<Self, Problem> {
        let (content, uri) = content(request, state).await?;
        let [camera, size] = parameters_named(&uri, ["camera", "size"])?;
        Self::new(content, camera, size)
    }
}

impl FromRequest<ApiState> for CalibrationTrial {
    type Rejection = Problem;

    async fn from_request(request: Request, state: &ApiState) -> Result<Self, Problem> {
        let (content, uri) = content(request, state).await?;
        let names = ["profile", "grid", "camera", "size"];
        let [profile, grid, camera, size] = parameters_named(&uri, names)?;
        Ok(Self {
            upload: CalibrationUpload::new(content, camera, size)?,
            profile,
            grid,
        })
    }
}

impl CalibrationUpload {
    fn new(content: Bytes, camera: Option<String>, size: Option<String>) -> Result<Self, Problem> {
        let size = size.map(|text| text.parse()).transpose();
        let size = size.map_err(|error: NotAFrameSize| {
            Problem::for_parameter(ProblemKind::InvalidParameter, "size", &error.to_string())
        })?;
        Ok(Self {
            content,
            reading: Reading { camera, size },
        })
    }
}

async fn content(request: Request, state: &ApiState) -> Result<(Bytes, Uri), Problem> {
    let (parts, body) = request.into_parts();
    let context = RequestContext::from_extensions(&parts.extensions)?;
    let remedy = "send a calibration file";
    let max_bytes = CalibrationFile::MAX_BYTES;
    let reader = state.body_reader(&context, max_bytes, remedy);
    let bytes = reader.read(&parts.headers, body).await?;
    Ok((bytes.into_bytes(), parts.uri))
}

/// Returns the condition of a change.
pub(super) fn write_condition(headers: &HeaderMap) -> Result<WriteCondition, Problem> {
    let if_match = named(headers, &IF_MATCH, false)?;
    let if_none_match = named(headers, &IF_NONE_MATCH, true)?;
    match (if_match, if_none_match) {
        (None, None) => Ok(WriteCondition::Always),
        (None, Some(Named::Any)) => Ok(WriteCondition::IfAbsent),
        (Some(Named::Any), None) => Ok(WriteCondition::IfPresent),
        (Some(Named::Tags(tags)), None) => Ok(WriteCondition::IfRevision(tags)),
        _ => {
            let detail = "send If-Match with the known ETag, or If-None-Match: *, or neither";
            Err(Problem::new(ProblemKind::MalformedRequest, detail))
        }
    }
}

/// The ID of an existing calibration; it need not exist.
pub(in crate::api) struct CalibrationAddress(pub(super) CalibrationId);

/// The ID of a calibration to create or replace.
pub(in crate::api) struct NewCalibrationAddress(pub(super) CalibrationId);

impl FromRequestParts<ApiState> for CalibrationAddress {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, state: &ApiState) -> Result<Self, Problem> {
        id(parts, state, ProblemKind::UnknownCalibration)
            .await
            .map(Self)
    }
}

impl FromRequestParts<ApiState> for NewCalibrationAddress {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, state: &ApiState) -> Result<Self, Problem> {
        id(parts, state, ProblemKind::InvalidCalibration)
            .await
            .map(Self)
    }
}

async fn id(
    parts: &mut Parts,
    state: &ApiState,
    kind: ProblemKind,
) -> Result<CalibrationId, Problem> {
    // A path segment that is not UTF-8 is not an ID.
    let id = Path::<String>::from_request_parts(parts, state).await;
    let id = id.map(|Path(id)| id).unwrap_or_default();
    id.parse()
        .map_err(|error| Problem::new(kind, format!("{error}")))
}
