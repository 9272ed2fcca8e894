//! The declaration of settings: `settings!` makes the struct, its defaults, its reader and its rows
//! of the reference from one list.

use super::{SettingsError, form::Form, values::Values};

/// A setting as the reference shows it.
#[derive(Debug, Clone)]
#[cfg_attr(
    not(test),
    expect(
        dead_code,
        reason = "only the tests that generate the reference read all of it"
    )
)]
pub(super) struct Entry {
    /// The key with its table, such as `server.tls.certificate`.
    pub(super) key: &'static str,
    /// The documentation, one line of the source after the other.
    pub(super) help: &'static [&'static str],
    /// The values that are accepted, as a phrase.
    pub(super) kind: String,
    /// The default as TOML.
    pub(super) default: toml::Value,
    /// The value that the settings file shows in a comment, where an empty value is refused.
    pub(super) example: Option<&'static str>,
}

impl Entry {
    pub(super) fn new<T>(
        key: &'static str,
        help: &'static [&'static str],
        form: &Form<T>,
        default: &T,
    ) -> Self {
        Self {
            key,
            help,
            kind: form.kind.clone(),
            default: (form.write)(default),
            example: form.example,
        }
    }

    /// The table and the key in it.
    pub(super) fn split(&self) -> (&'static str, &'static str) {
        self.key.rsplit_once('.').unwrap_or(("", self.key))
    }
}

/// Settings of one table, or some of them.
pub(super) trait Table: Sized {
    /// The settings in `values`, and the defaults for all others.
    fn read(values: &Values) -> Result<Self, SettingsError>;

    /// The rows of the reference.
    fn entries() -> Vec<Entry>;
}

/// Declares settings of one table.
///
/// ```ignore
/// settings! {
///     /// The documentation of the struct.
///     #[derive(Debug, Clone, PartialEq)]
///     pub struct ServerSettings in "server" {
///         /// The documentation of the setting, in the code, the settings file and the reference.
///         request_timeout as "request_timeout_millis": Duration = Duration::from_secs(30)
///             => millis(1..=600_000);
///     }
/// }
/// ```
///
/// Without `as`, the key is the name of the field. A struct of another module is filled with
/// `in "server" fill ConnectionLimits { /// … max_headers => whole(16..=1024); }`: its defaults are
/// those of its `Default`.
macro_rules! settings {
    (
        $(#[doc = $about:literal])*
        #[derive($($derive:ident),+)]
        $visibility:vis struct $name:ident in $table:literal {
            $(
                $(#[doc = $help:literal])*
                $field:ident $(as $key:literal)?: $type:ty = $default:expr => $form:expr;
            )*
        }
    ) => {
        $(#[doc = $about])*
        #[derive($($derive),+)]
        $visibility struct $name {
            $($(#[doc = $help])* pub $field: $type,)*
        }

        impl Default for $name {
            fn default() -> Self {
                Self { $($field: $default,)* }
            }
        }

        settings! {
            in $table fill $name { $($(#[doc = $help])* $field $(as $key)? => $form;)* }
        }
    };
    (
        in $table:literal fill $name:ident {
            $(
                $(#[doc = $help:literal])*
                $field:ident $(as $key:literal)? => $form:expr;
            )*
        }
    ) => {
        impl $crate::settings::declare::Table for $name {
            fn read(
                values: &$crate::settings::values::Values,
            ) -> Result<Self, $crate::settings::SettingsError> {
                let defaults = Self::default();
                Ok(Self {
                    $($field: values
                        .get(settings!(@key $table, $field $($key)?), &$form)?
                        .unwrap_or(defaults.$field),)*
                })
            }

            fn entries() -> Vec<$crate::settings::declare::Entry> {
                let defaults = Self::default();
                vec![$($crate::settings::declare::Entry::new(
                    settings!(@key $table, $field $($key)?),
                    &[$($help),*],
                    &$form,
                    &defaults.$field,
                )),*]
            }
        }
    };
    (@key $table:literal, $field:ident) => { concat!($table, ".", stringify!($field)) };
    (@key $table:literal, $field:ident $key:literal) => { concat!($table, ".", $key) };
}

pub(super) use settings;
