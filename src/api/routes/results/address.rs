//! The camera name in the path.

use axum::{
    extract::{FromRequestParts, Path},
    http::request::Parts,
};

use super::unknown;
use crate::api::{ApiState, http::problem::Problem};

/// The name of a camera; it need not have reports.
pub(in crate::api) struct CameraAddress(pub(super) String);

impl FromRequestParts<ApiState> for CameraAddress {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, state: &ApiState) -> Result<Self, Problem> {
        let camera = Path::from_request_parts(parts, state).await;
        // A path segment that is not UTF-8 is not a name.
        let Path(camera) = camera.map_err(|_| unknown(parts.uri.path()))?;
        Ok(Self(camera))
    }
}
