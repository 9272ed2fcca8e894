//! Numbers, times and switches.

use std::{
    num::{NonZeroU32, NonZeroU64, NonZeroUsize},
    ops::RangeInclusive,
    time::Duration,
};

use lookdown_common::parse_duration;
use toml::Value;

use super::{Form, Refusal, parsed};

/// 1 TiB: more memory than any machine spends on one setting.
pub(in crate::settings) const MAX_BYTES: u64 = 1 << 40;
/// Ten minutes.
pub(in crate::settings) const MAX_TIMEOUT_MILLIS: u64 = 600_000;
/// A day.
const MAX_POLL_SECONDS: u64 = 86_400;
/// A larger count can only be a mistake.
const MAX_COUNT: u64 = 65_536;

/// A type that holds whole numbers.
pub(in crate::settings) trait Whole: Sized + 'static {
    /// The value; `None` for a number that the type cannot hold.
    fn from_u64(number: u64) -> Option<Self>;

    /// The number.
    fn to_u64(&self) -> u64;
}

macro_rules! whole_types {
    ($($type:ty: |$number:ident| $from:expr, |$value:ident| $to:expr;)*) => {$(
        impl Whole for $type {
            fn from_u64($number: u64) -> Option<Self> {
                $from
            }

            fn to_u64(&self) -> u64 {
                let $value = *self;
                $to
            }
        }
    )*};
}

whole_types! {
    u64: |number| Some(number), |value| value;
    u32: |number| u32::try_from(number).ok(), |value| u64::from(value);
    usize: |number| usize::try_from(number).ok(), |value| value as u64;
    NonZeroU32: |number| NonZeroU32::new(u32::try_from(number).ok()?), |value| u64::from(value.get());
    NonZeroUsize: |number| NonZeroUsize::new(usize::try_from(number).ok()?), |value| value.get() as u64;
    // 0 means none.
    Option<NonZeroU64>: |number| Some(NonZeroU64::new(number)), |value| value.map_or(0, NonZeroU64::get);
    Option<NonZeroUsize>: |number| Some(NonZeroUsize::new(usize::try_from(number).ok()?)),
        |value| value.map_or(0, |value| value.get() as u64);
}

/// A whole number within a range.
pub(in crate::settings) fn whole<T: Whole>(range: RangeInclusive<u64>) -> Form<T> {
    within("whole number", range)
}

fn within<T: Whole>(unit: &str, range: RangeInclusive<u64>) -> Form<T> {
    let kind = format!("{unit} from {} to {}", range.start(), range.end());
    let remedy = format!(
        "give a whole number from {} to {}",
        range.start(),
        range.end()
    );
    Form::new(
        kind,
        move |written| {
            let number = written.whole().filter(|number| range.contains(number));
            number
                .and_then(T::from_u64)
                .ok_or_else(|| Refusal::Shown(remedy.clone()))
        },
        |value| integer(value.to_u64()),
    )
}

fn integer(number: u64) -> Value {
    Value::Integer(i64::try_from(number).unwrap_or(i64::MAX))
}

/// A count: at least one if the type cannot hold 0.
pub(in crate::settings) fn count<T: Whole>() -> Form<T> {
    let least = u64::from(T::from_u64(0).is_none());
    whole(least..=MAX_COUNT)
}

/// A time in milliseconds.
pub(in crate::settings) fn millis(range: RangeInclusive<u64>) -> Form<Duration> {
    within("milliseconds", range).map(Duration::from_millis, |time| {
        u64::try_from(time.as_millis()).unwrap_or(u64::MAX)
    })
}

/// A time in seconds.
pub(in crate::settings) fn seconds(range: RangeInclusive<u64>) -> Form<Duration> {
    within("seconds", range).map(Duration::from_secs, Duration::as_secs)
}

/// A time with its unit, such as `10s`.
pub(in crate::settings) fn duration(range: RangeInclusive<Duration>) -> Form<Duration> {
    let (least, most) = (
        written_duration(range.start()),
        written_duration(range.end()),
    );
    let remedy = format!("give a duration from {least} to {most}, such as 10s or 500ms");
    parsed(
        format!("duration from {least} to {most}"),
        move |text| {
            let duration = parse_duration(text, range.clone());
            duration.ok_or_else(|| Refusal::Shown(remedy.clone()))
        },
        written_duration,
    )
}

/// A duration in its largest whole unit.
fn written_duration(duration: &Duration) -> String {
    let millis = duration.as_millis();
    let units = [(3_600_000, "h"), (60_000, "m"), (1000, "s")];
    let unit = units
        .iter()
        .find(|(size, _)| millis > 0 && millis.is_multiple_of(*size));
    match unit {
        Some((size, unit)) => format!("{}{unit}", millis / size),
        None => format!("{millis}ms"),
    }
}

/// An optional time; 0 means none.
pub(in crate::settings) fn zero_is_none(form: Form<Duration>) -> Form<Option<Duration>> {
    form.map(
        |time| (!time.is_zero()).then_some(time),
        |value| value.unwrap_or_default(),
    )
}

/// The interval at which files are checked for changes, in seconds; 0 means never.
pub(in crate::settings) fn poll_seconds() -> Form<Option<NonZeroU64>> {
    within("seconds", 0..=MAX_POLL_SECONDS)
}

/// A share from 0 to 1.
pub(in crate::settings) fn share() -> Form<f64> {
    number("number from 0 to 1".to_owned(), |number| {
        (0.0..=1.0).contains(&number).then_some(number)
    })
}

/// An optional rate; 0 means none.
pub(in crate::settings) fn rate(range: RangeInclusive<f64>) -> Form<Option<f64>> {
    let kind = format!("number from {} to {}, or 0", range.start(), range.end());
    number(kind, move |number| {
        (number == 0.0 || range.contains(&number)).then_some(number)
    })
    .map(
        |number| (number != 0.0).then_some(number),
        |value| value.unwrap_or_default(),
    )
}

fn number(kind: String, check: impl Fn(f64) -> Option<f64> + 'static) -> Form<f64> {
    let remedy = format!("give a {kind}");
    Form::new(
        kind,
        move |written| {
            let number = written.number().and_then(&check);
            number.ok_or_else(|| Refusal::Shown(remedy.clone()))
        },
        |number| Value::Float(*number),
    )
}

/// A switch.
pub(in crate::settings) fn flag() -> Form<bool> {
    Form::new(
        "`true` or `false`",
        |written| {
            let flag = match written {
                super::Written::Toml(Value::Boolean(flag)) => Some(*flag),
                _ => match written.text().map(str::to_ascii_lowercase).as_deref() {
                    Some("true" | "1" | "on" | "yes") => Some(true),
                    Some("false" | "0" | "off" | "no") => Some(false),
                    _ => None,
                },
            };
            flag.ok_or_else(|| Refusal::Shown("give true or false".to_owned()))
        },
        |flag| Value::Boolean(*flag),
    )
}
