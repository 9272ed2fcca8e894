//! An uploaded calibration file.

use axum::extract::{FromRequest, Request};
use bytes::Bytes;
use tokio::time::timeout;

use crate::{
    api::{
        ApiState,
        problem::{Problem, ProblemKind},
        upload::{BodyReader, parameters_named},
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
        let reader = BodyReader {
            max_bytes: CalibrationFile::MAX_BYTES,
            remedy: "a calibration file is far smaller",
            budget: &state.uploads,
        };
        let reading = timeout(
            state.options.request_timeout,
            reader.read(&parts.headers, body),
        );
        let content = reading.await.map_err(|_| {
            let detail = "the file did not arrive in time: send it again";
            Problem::new(ProblemKind::SlowUpload, detail)
        })??;
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
