//! Conditional changes of calibrations (RFC 9110, section 13.1). The entity tag is the revision.

use axum::http::{
    HeaderMap,
    header::{IF_MATCH, IF_NONE_MATCH},
};

use lookdown_http::entity_tags::{Named, named};

use crate::{
    api::http::problem::{Problem, ProblemKind},
    calibration_store::WriteCondition,
};

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
