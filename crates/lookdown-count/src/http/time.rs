//! The parameters `from`, `to`, `step` and `time_zone`.

use jiff::{SignedDuration, Timestamp, ToSpan, Zoned, tz::TimeZone};
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
    /// The begin, in whole minutes, or `today`, `yesterday` or `week`; a day before `to` if absent.
    #[param(nullable = false)]
    from: Option<String>,
    /// The end; now if absent.
    #[param(format = DateTime, nullable = false)]
    to: Option<String>,
    /// A duration of whole minutes, up to a week, such as `1h`; `15m` if absent.
    #[param(nullable = false)]
    step: Option<String>,
    /// The time zone of `today`, `yesterday` and `week`, such as `Europe/Berlin`; that of this machine if absent.
    #[param(nullable = false)]
    time_zone: Option<String>,
    /// `json` or `csv`; `Accept: text/csv` if absent.
    #[param(nullable = false, pattern = "^(json|csv)$")]
    pub(super) format: Option<String>,
}

impl TimeParameters {
    /// Checks the parameters. The time ends now and has a day by default. Named days are those of
    /// this machine's time zone, unless the request has one.
    pub(super) fn span(&self) -> Result<Span, Problem> {
        let (from, until) = match self.from.as_deref() {
            Some(name @ ("today" | "yesterday" | "week")) => {
                let now = Timestamp::from_millisecond(now_ms()).unwrap_or(Timestamp::MAX);
                named(name, &now.to_zoned(self.zone()?))
            }
            from => (timestamp("from", from)?, None),
        };
        let step = match &self.step {
            None => DEFAULT_STEP,
            Some(text) => step(text)?,
        };
        // The last minute is included while it is not over.
        let end_of = |milliseconds: i64| (milliseconds + MINUTE_MS - 1).div_euclid(MINUTE_MS);
        let to = end_of(
            timestamp("to", self.to.as_deref())?
                .or(until)
                .unwrap_or_else(now_ms),
        );
        let from = match from {
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

    fn zone(&self) -> Result<TimeZone, Problem> {
        let Some(name) = &self.time_zone else {
            return Ok(TimeZone::system());
        };
        TimeZone::get(name).map_err(|_| {
            let fault = "it is not a time zone of this machine: give one like Europe/Berlin or UTC";
            Problem::of_parameter("time_zone", fault)
        })
    }
}

/// Returns the milliseconds at which a named time begins and ends; `None` is now. A week begins on
/// Monday.
fn named(name: &str, now: &Zoned) -> (Option<i64>, Option<i64>) {
    let start = |days: i64| {
        let day = now
            .checked_sub(days.days())
            .and_then(|day| day.start_of_day());
        day.ok().map(|day| day.timestamp().as_millisecond())
    };
    match name {
        "yesterday" => (start(1), start(0)),
        "week" => (start(now.weekday().to_monday_zero_offset().into()), None),
        _ => (start(0), None),
    }
}

fn timestamp(name: &str, text: Option<&str>) -> Result<Option<i64>, Problem> {
    let Some(text) = text else { return Ok(None) };
    match text.parse::<Timestamp>() {
        Ok(time) => Ok(Some(time.as_millisecond())),
        Err(_) => Err(Problem::of_parameter(
            name,
            "it is not a time: write it like 2026-11-22T10:00:00Z, with + as %2B; `from` may be \
             today, yesterday or week",
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

#[cfg(test)]
mod tests {
    use super::*;

    fn milliseconds(text: &str) -> i64 {
        text.parse::<Timestamp>().unwrap().as_millisecond()
    }

    #[test]
    fn named_days_begin_at_midnight_of_the_zone() {
        // The clocks went back by an hour on this Sunday.
        let now: Zoned = "2026-10-25T12:00[Europe/Berlin]".parse().unwrap();
        let today = Some(milliseconds("2026-10-24T22:00:00Z"));
        assert_eq!(named("today", &now), (today, None));
        let yesterday = Some(milliseconds("2026-10-23T22:00:00Z"));
        assert_eq!(named("yesterday", &now), (yesterday, today));
        let monday = Some(milliseconds("2026-10-18T22:00:00Z"));
        assert_eq!(named("week", &now), (monday, None));
        let later: Zoned = "2026-10-26T12:00[Europe/Berlin]".parse().unwrap();
        let day = (today, Some(milliseconds("2026-10-25T23:00:00Z")));
        assert_eq!(named("yesterday", &later), day, "25 hours");
    }
}
