//! Forms of values: the text or TOML value that a setting is written as, and the checked type that
//! it becomes.

mod numbers;
mod texts;
mod written;

pub(super) use numbers::{
    MAX_BYTES, MAX_TIMEOUT_MILLIS, count, duration, flag, millis, poll_seconds, rate, seconds,
    share, whole, zero_is_none,
};
pub(super) use texts::{
    address, choice, given_path, list, names, optional, optional_text, parsed, path, secret, text,
    variant, web_address,
};
pub(super) use written::{Refusal, Written};

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
