//! Who may change what the server works with.

use axum::{extract::FromRequestParts, http::request::Parts};

use super::{
    ApiState,
    problem::{Problem, ProblemKind},
};

/// Whoever sent the request may change the models and the calibrations of the server.
pub(super) struct Administrator;

impl FromRequestParts<ApiState> for Administrator {
    type Rejection = Problem;

    async fn from_request_parts(_parts: &mut Parts, state: &ApiState) -> Result<Self, Problem> {
        if state.options.administration {
            return Ok(Self);
        }
        let detail = "models and calibrations are changed on the server's own machine only: this \
                      server listens to others, too (server.listen)";
        Err(Problem::new(ProblemKind::Forbidden, detail))
    }
}
