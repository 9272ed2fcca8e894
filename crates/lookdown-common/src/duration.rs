//! Durations as users write them: `500ms`, `10s`, `15m`.

use std::{ops::RangeInclusive, time::Duration};

use jiff::SignedDuration;

use crate::ConfigError;

/// Parses a duration with its unit, such as `500ms`. Returns `None` outside of the limits.
pub fn parse_duration(text: &str, limits: RangeInclusive<Duration>) -> Option<Duration> {
    let parsed = Duration::try_from(text.parse::<SignedDuration>().ok()?).ok()?;
    limits.contains(&parsed).then_some(parsed)
}

/// Parses the duration of a setting if it is given.
///
/// # Errors
/// [`ConfigError`] for a text that is not a duration within the limits.
pub fn optional_duration(
    field: &str,
    text: Option<&str>,
    limits: RangeInclusive<Duration>,
) -> Result<Option<Duration>, ConfigError> {
    let Some(text) = text else { return Ok(None) };
    let (least, most) = (limits.start().as_secs_f64(), limits.end().as_secs_f64());
    parse_duration(text, limits).map(Some).ok_or_else(|| {
        let remedy =
            format!("is not a duration from {least} s to {most} s: write it like 10s or 500ms");
        ConfigError::value(field, text, &remedy)
    })
}
