//! The calibration ID in the path.

use axum::{
    extract::{FromRequestParts, Path},
    http::request::Parts,
};
use lookdown_calibration::CalibrationId;

use crate::api::{
    ApiState,
    http::problem::{Problem, ProblemKind},
};

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
