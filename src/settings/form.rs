//! Forms of values: the text or TOML value that a setting is written as, and the checked type that
//! it becomes.

use std::{
    fmt::Display,
    net::SocketAddr,
    num::{NonZeroU32, NonZeroU64, NonZeroUsize},
    ops::RangeInclusive,
    path::PathBuf,
    str::FromStr,
    time::Duration,
};

use lookdown_common::parse_duration;
use secrecy::SecretString;
use strum::VariantNames;
use toml::Value;
use url::Url;

type Read<T> = Box<dyn Fn(Written<'_>) -> Result<T, Refusal>>;

/// The form of a setting's value.
pub(super) struct Form<T> {
    /// The values that are accepted, as a phrase that follows "give a" or stands alone.
    pub(super) kind: String,
    /// Reads a value.
    pub(super) read: Read<T>,
    /// Writes a value as TOML.
    pub(super) write: Box<dyn Fn(&T) -> toml::Value>,
    /// The value that the settings file shows in a comment, where an empty value is refused.
    pub(super) example: Option<&'static str>,
}

impl<T: 'static> Form<T> {
    fn new(
        kind: impl Into<String>,
        read: impl Fn(Written<'_>) -> Result<T, Refusal> + 'static,
        write: impl Fn(&T) -> toml::Value + 'static,
    ) -> Self {
        Self {
            kind: kind.into(),
            read: Box::new(read),
            write: Box::new(write),
            example: None,
        }
    }

    /// The same values in another type.
    fn map<U: 'static>(
        self,
        to: impl Fn(T) -> U + 'static,
        from: impl Fn(&U) -> T + 'static,
    ) -> Form<U> {
        let (read, write) = (self.read, self.write);
        Form {
            kind: self.kind,
            read: Box::new(move |written| read(written).map(&to)),
            write: Box::new(move |value| write(&from(value))),
            example: self.example,
        }
    }
}

/// A value as it is written.
#[derive(Clone, Copy)]
pub(super) enum Written<'a> {
    /// In the settings file.
    Toml(&'a toml::Value),
    /// In an environment variable.
    Variable(&'a str),
}

impl<'a> Written<'a> {
    /// The text of a variable or of a TOML string.
    pub(super) fn text(self) -> Option<&'a str> {
        match self {
            Self::Toml(value) => value.as_str(),
            Self::Variable(text) => Some(text),
        }
    }

    /// The whole number, which may also be in a string.
    pub(super) fn whole(self) -> Option<u64> {
        match self {
            Self::Toml(toml::Value::Integer(number)) => u64::try_from(*number).ok(),
            _ => self.text()?.trim().parse().ok(),
        }
    }

    /// The number, which may also be in a string.
    pub(super) fn number(self) -> Option<f64> {
        match self {
            Self::Toml(toml::Value::Float(number)) => Some(*number),
            Self::Toml(toml::Value::Integer(number)) => Some(*number as f64),
            _ => self.text()?.trim().parse().ok(),
        }
    }

    /// The value as a message shows it.
    pub(in crate::settings) fn shown(self) -> String {
        match self.text() {
            Some("") => "empty".to_owned(),
            Some(text) => format!("{text:?}"),
            None => match self {
                Self::Toml(value) => value.to_string().replace('\n', " "),
                Self::Variable(text) => text.to_owned(),
            },
        }
    }
}

/// The refusal of a value.
#[derive(Debug)]
pub(super) enum Refusal {
    /// The remedy for a value that the message repeats.
    Shown(String),
    /// The remedy for a part of the value, which the message repeats.
    Part(String, String),
    /// The problem with a value that the message does not repeat, since it may hold a secret.
    Hidden(String),
}

/// 1 TiB: more memory than any machine spends on one setting.
pub(super) const MAX_BYTES: u64 = 1 << 40;
/// Ten minutes.
pub(super) const MAX_TIMEOUT_MILLIS: u64 = 600_000;
/// A day.
const MAX_POLL_SECONDS: u64 = 86_400;
/// A larger count can only be a mistake.
const MAX_COUNT: u64 = 65_536;

/// A type that holds whole numbers.
pub(super) trait Whole: Sized + 'static {
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
pub(super) fn whole<T: Whole>(range: RangeInclusive<u64>) -> Form<T> {
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
pub(super) fn count<T: Whole>() -> Form<T> {
    let least = u64::from(T::from_u64(0).is_none());
    whole(least..=MAX_COUNT)
}

/// A time in milliseconds.
pub(super) fn millis(range: RangeInclusive<u64>) -> Form<Duration> {
    within("milliseconds", range).map(Duration::from_millis, |time| {
        u64::try_from(time.as_millis()).unwrap_or(u64::MAX)
    })
}

/// A time in seconds.
pub(super) fn seconds(range: RangeInclusive<u64>) -> Form<Duration> {
    within("seconds", range).map(Duration::from_secs, Duration::as_secs)
}

/// A time with its unit, such as `10s`.
pub(super) fn duration(range: RangeInclusive<Duration>) -> Form<Duration> {
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
pub(super) fn zero_is_none(form: Form<Duration>) -> Form<Option<Duration>> {
    form.map(
        |time| (!time.is_zero()).then_some(time),
        |value| value.unwrap_or_default(),
    )
}

/// The interval at which files are checked for changes, in seconds; 0 means never.
pub(super) fn poll_seconds() -> Form<Option<NonZeroU64>> {
    within("seconds", 0..=MAX_POLL_SECONDS)
}

/// A share from 0 to 1.
pub(super) fn share() -> Form<f64> {
    number("number from 0 to 1".to_owned(), |number| {
        (0.0..=1.0).contains(&number).then_some(number)
    })
}

/// An optional rate; 0 means none.
pub(super) fn rate(range: RangeInclusive<f64>) -> Form<Option<f64>> {
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
pub(super) fn flag() -> Form<bool> {
    Form::new(
        "`true` or `false`",
        |written| {
            let flag = match written {
                Written::Toml(Value::Boolean(flag)) => Some(*flag),
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

/// A text that `read` parses to a value.
pub(super) fn parsed<T: 'static>(
    kind: impl Into<String>,
    read: impl Fn(&str) -> Result<T, Refusal> + 'static,
    write: impl Fn(&T) -> String + 'static,
) -> Form<T> {
    let kind = kind.into();
    let remedy = format!("give a string: {kind}");
    Form::new(
        kind,
        move |written| match written.text() {
            Some(text) => read(text),
            None => Err(Refusal::Shown(remedy.clone())),
        },
        move |value| Value::String(write(value)),
    )
}

/// A text that `check` accepts.
pub(super) fn text(kind: &'static str, check: impl Fn(&str) -> bool + 'static) -> Form<String> {
    parsed(
        kind,
        move |text| {
            let text = check(text).then(|| text.to_owned());
            text.ok_or_else(|| Refusal::Shown(format!("give {kind}")))
        },
        String::clone,
    )
}

/// An optional value; the empty text means none.
pub(super) fn optional<T: 'static>(form: Form<T>) -> Form<Option<T>> {
    let (read, write) = (form.read, form.write);
    Form {
        kind: format!("{}, or empty", form.kind),
        read: Box::new(move |written| match written.text() {
            Some("") => Ok(None),
            _ => read(written).map(Some),
        }),
        write: Box::new(move |value| match value {
            Some(value) => write(value),
            None => Value::String(String::new()),
        }),
        example: form.example,
    }
}

/// An optional value of any simple type, as text; the empty text means none.
pub(super) fn optional_text(
    kind: String,
    read: impl Fn(&str) -> Result<String, Refusal> + 'static,
) -> Form<Option<String>> {
    let remedy = format!("give {kind}");
    let form = Form::new(
        kind,
        move |written| match written {
            Written::Variable(text) => read(text),
            Written::Toml(Value::String(text)) => read(text),
            Written::Toml(value @ (Value::Boolean(_) | Value::Integer(_) | Value::Float(_))) => {
                read(&value.to_string())
            }
            Written::Toml(_) => Err(Refusal::Shown(remedy.clone())),
        },
        |text: &String| Value::String(text.clone()),
    );
    optional(form)
}

/// An address with a port.
pub(super) fn address() -> Form<SocketAddr> {
    parsed(
        "IP address and port",
        |text| {
            // A name is not looked up, because it may stand for several addresses.
            let ip = text
                .strip_prefix("localhost:")
                .map(|port| format!("127.0.0.1:{port}"));
            ip.as_deref().unwrap_or(text).parse().map_err(|_| {
                let remedy = "give an IP address and a port, such as 127.0.0.1:8080 or [::]:8080";
                Refusal::Shown(remedy.to_owned())
            })
        },
        SocketAddr::to_string,
    )
}

/// A URL of HTTP.
pub(super) fn web_address() -> Form<Url> {
    parsed(
        "URL",
        |text| {
            let url = text.parse::<Url>().ok();
            let url = url.filter(|url| matches!(url.scheme(), "http" | "https"));
            url.ok_or_else(|| {
                Refusal::Shown("give an address such as http://lookdown.local:8080".to_owned())
            })
        },
        Url::to_string,
    )
}

/// The path of a file or folder.
pub(super) fn path() -> Form<PathBuf> {
    parsed(
        "path",
        |text| {
            if text.contains("-----BEGIN") {
                // It may be a private key.
                let problem = "it is PEM text: write that to a file and give the path of the file";
                return Err(Refusal::Hidden(problem.to_owned()));
            }
            if text.is_empty() {
                let remedy = "give a path, or leave the key out";
                return Err(Refusal::Shown(remedy.to_owned()));
            }
            if text.contains("://") {
                // It may hold a password.
                let remedy = "give a path on this machine, and mount other storage as a volume";
                return Err(Refusal::Part("a URL".to_owned(), remedy.to_owned()));
            }
            Ok(PathBuf::from(text))
        },
        |path| path.display().to_string(),
    )
}

/// An optional path, without a key for none. An empty path is refused: by mistake it would disable
/// a feature. `example` appears in the settings file.
pub(super) fn given_path(example: &'static str) -> Form<Option<PathBuf>> {
    let mut form = path().map(Some, |path| path.clone().unwrap_or_default());
    form.example = Some(example);
    form
}

/// One of several names.
pub(super) fn choice<T: Copy + PartialEq + 'static>(
    choices: &'static [(&'static str, T)],
) -> Form<T> {
    let names: Vec<_> = choices.iter().map(|(name, _)| *name).collect();
    one_of(
        &names,
        |text| {
            let chosen = choices.iter().find(|(name, _)| *name == text);
            chosen.map(|(_, choice)| *choice)
        },
        |value| {
            let mut choices = choices.iter();
            let name = choices.find_map(|(name, choice)| (choice == value).then_some(*name));
            name.unwrap_or_default().to_owned()
        },
    )
}

/// One of the names of an enum.
pub(super) fn variant<T: FromStr + Display + VariantNames + 'static>() -> Form<T> {
    one_of(T::VARIANTS, |text| text.parse().ok(), T::to_string)
}

fn one_of<T: 'static>(
    names: &[&str],
    read: impl Fn(&str) -> Option<T> + 'static,
    write: impl Fn(&T) -> String + 'static,
) -> Form<T> {
    let remedy = format!("use one of {}", names.join(", "));
    let kind: Vec<_> = names.iter().map(|name| format!("`{name}`")).collect();
    parsed(
        kind.join(" or "),
        move |text| read(text).ok_or_else(|| Refusal::Shown(remedy.clone())),
        write,
    )
}

/// A list of texts that `read` parses: an array in TOML, separated by commas in a variable.
pub(super) fn list<T: 'static>(
    items: &'static str,
    read: impl Fn(&[&str]) -> Result<T, Refusal> + 'static,
    write: impl Fn(&T) -> Vec<String> + 'static,
) -> Form<T> {
    Form::new(
        format!("array of {items}"),
        move |written| {
            let texts: Option<Vec<&str>> = match written {
                Written::Variable(text) => {
                    let texts = text.split(',').map(str::trim);
                    Some(texts.filter(|text| !text.is_empty()).collect())
                }
                Written::Toml(Value::Array(values)) => values.iter().map(Value::as_str).collect(),
                Written::Toml(_) => None,
            };
            // The value is not repeated: it may hold an API key.
            let texts = texts.ok_or_else(|| {
                let remedy =
                    format!("it must be an array of {items}, such as [\"a\", \"b\"] or []");
                Refusal::Hidden(remedy)
            })?;
            read(&texts)
        },
        move |value| Value::Array(write(value).into_iter().map(Value::String).collect()),
    )
}

/// A list of names.
pub(super) fn names() -> Form<Vec<String>> {
    let owned = |names: &[&str]| Ok(names.iter().map(|&name| name.to_owned()).collect());
    list("names", owned, Vec::clone)
}

/// A text that no message and no log line shows. The empty text means none.
pub(super) fn secret(kind: &'static str) -> Form<Option<SecretString>> {
    Form::new(
        format!("{kind}, or empty"),
        move |written| match written.text() {
            Some(text) => Ok((!text.is_empty()).then(|| SecretString::from(text))),
            None => Err(Refusal::Hidden(format!("it must be a string: {kind}"))),
        },
        // A default is never a secret.
        |_| Value::String(String::new()),
    )
}
