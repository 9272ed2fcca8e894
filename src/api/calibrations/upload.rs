//! An uploaded calibration file.

use axum::extract::{FromRequest, Request};
use bytes::Bytes;
use tokio::time::timeout;

use crate::{
    api::{
        ApiState,
        problem::{Problem, ProblemKind},
        upload::{BodyReader, one_parameter},
    },
    calibration::CalibrationFile,
};

/// An uploaded calibration file.
pub(in crate::api) struct CalibrationUpload {
    /// The file.
    pub(super) content: Bytes,
    /// The camera chosen of it.
    pub(super) camera: Option<String>,
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
        Ok(Self {
            content: content.into_bytes(),
            camera: one_parameter(&parts.uri, "camera")?,
        })
    }
}
