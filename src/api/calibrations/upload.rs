//! An uploaded calibration file.

use axum::extract::{FromRequest, Request};
use bytes::Bytes;

use crate::{
    api::{
        ApiState,
        deadline::Deadline,
        problem::{Problem, ProblemKind},
        upload::parameters_named,
    },
    calibration::{CalibrationFile, Reading, native::NotAFrameSize},
};

/// An uploaded calibration file.
pub(in crate::api) struct CalibrationUpload {
    /// The file.
    pub(super) content: Bytes,
    /// How to read it.
    pub(super) reading: Reading,
}

impl FromRequest<ApiState> for CalibrationUpload {
    type Rejection = Problem;

    async fn from_request(request: Request, state: &ApiState) -> Result<Self, Problem> {
        let (parts, body) = request.into_parts();
        let deadline = Deadline::of(&parts, state);
        let remedy = "a calibration file is far smaller";
        let reader = state.body_reader(CalibrationFile::MAX_BYTES, remedy, deadline);
        let content = reader.read(&parts.headers, body).await?;
        let [camera, size] = parameters_named(&parts.uri, ["camera", "size"])?;
        let size = size.map(|text| text.parse()).transpose();
        let size = size.map_err(|error: NotAFrameSize| {
            Problem::new(ProblemKind::InvalidParameter, format!("size: {error}"))
        })?;
        Ok(Self {
            content: content.into_bytes(),
            reading: Reading { camera, size },
        })
    }
}
