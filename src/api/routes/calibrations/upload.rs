//! An uploaded calibration file.

use axum::{
    extract::{FromRequest, Request},
    http::Uri,
};
use bytes::Bytes;
use lookdown_calibration::{CalibrationFile, native::NotAFrameSize};

use crate::{
    api::{
        ApiState,
        http::{
            context::RequestContext,
            problem::{Problem, ProblemKind},
            query::parameters_named,
        },
    },
    calibration_store::Reading,
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
