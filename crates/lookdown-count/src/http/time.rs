//! The parameters `from`, `to`, `step` and `time_zone`.

use jiff::{SignedDuration, Timestamp, ToSpan, Zoned, tz::TimeZone};
use lookdown_common::text::shortened;
use lookdown_http::problem::Problem;
use serde::Deserialize;
use utoipa::IntoParams;

use super::shared::now_ms;
use crate::{now::time_of, store::Span, sums::MINUTE_MS};

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
    /// The time zone of `today`, `yesterday` and `week`, such as `Europe/Berlin`; that of this
    /// machine if absent.
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
        let given = self.from.as_deref();
        let (from, until) = match given.and_then(Day::named) {
            Some(day) => day.span(&time_of(now_ms()).to_zoned(self.zone()?)),
            None => (timestamp("from", given)?, None),
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
            let from = time_of(from * MINUTE_MS);
            let fault = format!("{from} is not before `to`: give an earlier time");
            return Err(Problem::for_parameter("from", &fault));
        }
        if (to - from + step - 1) / step > MAX_STEPS {
            let fault = "the time has more than 10000 steps: give a later time, or a longer step";
            return Err(Problem::for_parameter("from", fault));
        }
        Ok(Span {
            from_minute: from,
            to_minute: to,
            step_minutes: step,
        })
    }

    fn zone(&self) -> Result<TimeZone, Problem> {
        let Some(name) = &self.time_zone else {
            return Ok(TimeZone::system());
        };
        TimeZone::get(name).map_err(|_| {
            let remedy = "a time zone of this machine: give one like Europe/Berlin or UTC";
            is_not("time_zone", name, remedy)
        })
    }
}

/// A time with a name.
#[derive(Clone, Copy)]
enum Day {
    Today,
    Yesterday,
    /// Since Monday.
    Week,
}

impl Day {
    fn named(name: &str) -> Option<Self> {
        match name {
            "today" => Some(Self::Today),
            "yesterday" => Some(Self::Yesterday),
            "week" => Some(Self::Week),
            _ => None,
        }
    }

    /// Returns the milliseconds at which it begins and ends; `None` is now.
    fn span(self, now: &Zoned) -> (Option<i64>, Option<i64>) {
        let start = |days: i64| {
            let day = now
                .checked_sub(days.days())
                .and_then(|day| day.start_of_day());
            day.ok().map(|day| day.timestamp().as_millisecond())
        };
        match self {
            Self::Today => (start(0), None),
            Self::Yesterday => (start(1), start(0)),
            Self::Week => (start(now.weekday().to_monday_zero_offset().into()), None),
        }
    }
}

/// Parses a time, milliseconds since the Unix epoch.
pub(super) fn timestamp(name: &str, text: Option<&str>) -> Result<Option<i64>, Problem> {
    let Some(text) = text else { return Ok(None) };
    let time: Timestamp = text.parse().map_err(|_| {
        let remedy = "a time: write it like 2026-11-22T10:00:00Z, with + as %2B; `from` may be \
                      today, yesterday or week";
        is_not(name, text, remedy)
    })?;
    Ok(Some(time.as_millisecond()))
}

/// Returns the problem of a value. `remedy` completes "… is not".
fn is_not(name: &str, value: &str, remedy: &str) -> Problem {
    let fault = format!("{:?} is not {remedy}", shortened(value));
    Problem::for_parameter(name, &fault)
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
        let remedy = "a duration of whole minutes from 1m to 168h: write it like 15m or 24h";
        is_not("step", text, remedy)
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
        assert_eq!(Day::Today.span(&now), (today, None));
        let yesterday = Some(milliseconds("2026-10-23T22:00:00Z"));
        assert_eq!(Day::Yesterday.span(&now), (yesterday, today));
        let monday = Some(milliseconds("2026-10-18T22:00:00Z"));
        assert_eq!(Day::Week.span(&now), (monday, None));
        let later: Zoned = "2026-10-26T12:00[Europe/Berlin]".parse().unwrap();
        let day = (today, Some(milliseconds("2026-10-25T23:00:00Z")));
        assert_eq!(Day::Yesterday.span(&later), day, "25 hours");
    }
}
