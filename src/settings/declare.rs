//! The declaration of settings: `settings!` makes the struct, its defaults, its reader and its rows
//! of the reference from one list.

use super::{SettingsError, entry::Entry, values::Values};

/// Settings of one table, or some of them.
pub(super) trait Table: Sized {
    /// The settings in `values`, and the defaults for all others.
    fn read(values: &Values) -> Result<Self, SettingsError>;

    /// The rows of the reference.
    fn entries() -> Vec<Entry>;
}

/// Declares settings of one table.
///
/// ```text
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

            fn entries() -> Vec<$crate::settings::entry::Entry> {
                let defaults = Self::default();
                vec![$($crate::settings::entry::Entry::new(
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
