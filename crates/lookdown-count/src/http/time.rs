//! The parameters `from`, `to` and `step`.

use jiff::{SignedDuration, Timestamp};
use lookdown_http::problem::Problem;
use serde::Deserialize;
use utoipa::IntoParams;

use super::shared::now_ms;
use crate::{store::Span, sums::MINUTE_MS};

/// Most steps of an answer.
const MAX_STEPS: i64 = 10_000;
/// Minutes of the longest step.
const MAX_STEP: i64 = 7 * 24 * 60;
/// Defaults: minutes.
const DEFAULT_SPAN: i64 = 24 * 60;
const DEFAULT_STEP: i64 = 15;

/// The parameters as they are sent.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub(super) struct TimeParameters {
    /// The begin, in whole minutes; a day before `to` if absent.
    #[param(format = DateTime, nullable = false)]
    from: Option<String>,
    /// The end; now if absent.
    #[param(format = DateTime, nullable = false)]
    to: Option<String>,
    /// A duration of whole minutes, up to a week, such as `1h`; `15m` if absent.
    #[param(nullable = false)]
    step: Option<String>,
    /// `json` or `csv`; `Accept: text/csv` if absent.
    #[param(nullable = false, pattern = "^(json|csv)$")]
    pub(super) format: Option<String>,
}

impl TimeParameters {
    /// Checks the parameters. The time ends now and has a day by default.
    pub(super) fn span(&self) -> Result<Span, Problem> {
        let step = match &self.step {
            None => DEFAULT_STEP,
            Some(text) => step(text)?,
        };
        // The last minute is included while it is not over.
        let end_of = |milliseconds: i64| (milliseconds + MINUTE_MS - 1).div_euclid(MINUTE_MS);
        let to = end_of(timestamp("to", self.to.as_deref())?.unwrap_or_else(now_ms));
        let from = match timestamp("from", self.from.as_deref())? {
            Some(from) => from.div_euclid(MINUTE_MS),
            // Steps begin at their multiples since midnight UTC.
            None => (to - DEFAULT_SPAN).div_euclid(step) * step,
        };
        if from >= to {
            return Err(Problem::of_parameter(
                "from",
                "it is not before `to`: give an earlier time",
            ));
        }
        if (to - from + step - 1) / step > MAX_STEPS {
            let fault = "the time has more than 10000 steps: give a later time, or a longer step";
            return Err(Problem::of_parameter("from", fault));
        }
        Ok(Span { from, to, step })
    }
}

fn timestamp(name: &str, text: Option<&str>) -> Result<Option<i64>, Problem> {
    let Some(text) = text else { return Ok(None) };
    match text.parse::<Timestamp>() {
        Ok(time) => Ok(Some(time.as_millisecond())),
        Err(_) => Err(Problem::of_parameter(
            name,
            "it is not a time: write it like 2026-11-22T10:00:00Z, with + as %2B",
        )),
    }
}

/// Parses a step in whole minutes.
fn step(text: &str) -> Result<i64, Problem> {
    let parsed = text.parse::<SignedDuration>().ok();
    let minutes = parsed.and_then(|step| {
        let is_whole = step.as_secs() % 60 == 0 && step.subsec_nanos() == 0;
        is_whole.then_some(step.as_secs() / 60)
    });
    let minutes = minutes.filter(|minutes| (1..=MAX_STEP).contains(minutes));
    minutes.ok_or_else(|| {
        let fault =
            "it is not a duration of whole minutes from 1m to 168h: write it like 15m or 24h";
        Problem::of_parameter("step", fault)
    })
}
