//! The incoming trace of a request, according to W3C Trace Context.
//! Source: W3C Recommendation "Trace Context", section 3, "Trace Context HTTP Headers Format".

use opentelemetry::{
    Context,
    propagation::{Extractor, TextMapPropagator},
};
use opentelemetry_sdk::propagation::TraceContextPropagator;

/// Lengths of version, trace ID, parent ID and flags.
const PART_LENGTHS: [usize; 4] = [2, 32, 16, 2];

/// The trace headers of a request.
#[derive(Debug, Clone, Copy, Default)]
pub struct IncomingTrace<'a> {
    /// `traceparent`. `None` also if there are several.
    pub parent: Option<&'a str>,
    /// `tracestate`. Several are joined with commas.
    pub state: Option<&'a str>,
}

impl IncomingTrace<'_> {
    /// Returns a context with the caller's span as parent, or without a span if the headers name
    /// none.
    pub(super) fn context(&self) -> Context {
        if self.parent.is_none() {
            return Context::new();
        }
        TraceContextPropagator::new().extract_with_context(&Context::new(), self)
    }
}

impl Extractor for IncomingTrace<'_> {
    fn get(&self, key: &str) -> Option<&str> {
        match key {
            "traceparent" => self.parent.filter(|parent| is_well_formed(parent)),
            "tracestate" => self.state,
            _ => None,
        }
    }

    fn keys(&self) -> Vec<&str> {
        vec!["traceparent", "tracestate"]
    }
}

/// Returns true if all parts are present. The propagator validates their values.
fn is_well_formed(parent: &str) -> bool {
    let mut parts = parent.split('-');
    PART_LENGTHS.into_iter().all(|length| {
        parts.next().is_some_and(|part| {
            part.len() == length && part.bytes().all(|byte| byte.is_ascii_hexdigit())
        })
    })
}

#[cfg(test)]
mod tests {
    use opentelemetry::trace::TraceContextExt;

    use super::*;

    fn trace_of(parent: &str, state: Option<&str>) -> Option<(String, String)> {
        let parent = Some(parent);
        let context = IncomingTrace { parent, state }.context();
        let span = context.span();
        let span = span.span_context();
        span.is_valid()
            .then(|| (span.trace_id().to_string(), span.trace_state().header()))
    }

    #[test]
    fn a_parent_is_known_and_so_is_one_of_a_later_version() {
        let trace = "4bf92f3577b34da6a3ce929d0e0e4736";
        for parent in [
            format!("00-{trace}-00f067aa0ba902b7-01"),
            format!("cc-{trace}-00f067aa0ba902b7-00-more"),
        ] {
            let known = trace_of(&parent, Some("a=1,b=2")).unwrap();
            assert_eq!(known, (trace.to_owned(), "a=1,b=2".to_owned()));
            // An invalid state is ignored without affecting the parent.
            let known = trace_of(&parent, Some("nonsense")).unwrap();
            assert_eq!(known, (trace.to_owned(), String::new()));
        }
    }

    #[test]
    fn an_invalid_parent_is_ignored() {
        for parent in [
            "",
            "00",
            "00-1-1-01",
            "00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7",
            "00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01-more",
            "ff-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01",
            "00-4BF92F3577B34DA6A3CE929D0E0E4736-00f067aa0ba902b7-01",
            "00-+bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01",
            "00-00000000000000000000000000000000-00f067aa0ba902b7-01",
            "00-4bf92f3577b34da6a3ce929d0e0e4736-0000000000000000-01",
            "00-4bf92f3577b34da6a3ce929d0e0e473\u{e9}-00f067aa0ba902b7-01",
        ] {
            assert_eq!(trace_of(parent, None), None, "{parent}");
        }
    }
}
