//! The camera in the address.

use axum::{
    extract::{FromRequestParts, Path},
    http::request::Parts,
};

use super::unknown;
use crate::api::{ApiState, problem::Problem};

/// The name of a camera that may have reports.
pub(in crate::api) struct CameraAddress(pub(super) String);

impl FromRequestParts<ApiState> for CameraAddress {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, state: &ApiState) -> Result<Self, Problem> {
        let camera = Path::from_request_parts(parts, state).await;
        // Bytes that are no text are no name.
        let Path(camera) = camera.map_err(|_| unknown(parts.uri.path()))?;
        Ok(Self(camera))
    }
}
