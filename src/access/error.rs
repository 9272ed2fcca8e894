//! Errors of keys that cannot be used.

use std::{io, path::PathBuf};

use lookdown_detect::fairness::PriorityLevel;

/// Keys that cannot be used. No message repeats the input: it may be a key in the wrong position.
#[derive(Debug, thiserror::Error)]
pub enum KeyError {
    /// The file cannot be read.
    #[error("access.keys_file: {} cannot be read ({cause}): check its path and its permissions", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// The cause.
        cause: io::Error,
    },
    /// The file has keys that cannot be used.
    #[error("access.keys_file: {} cannot be used: {problem}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// The problem.
        problem: Box<KeyError>,
    },
    /// The text has another form.
    #[error(
        "line {line}: a key is a line of the form name = {{ scopes = [\"detect\"], sha256 = \
         \"64 hexadecimal digits\" }}, as `lookdown key new` prints it"
    )]
    Shape {
        /// The line, from 1.
        line: usize,
    },
    /// An entry of the environment has another form.
    #[error(
        "key {position} is not of the form name:scope+scope:sha256, as `lookdown key new` prints it"
    )]
    Entry {
        /// The position of the key, from 1.
        position: usize,
    },
    /// The name is invalid.
    #[error("key {position}: {}", super::InvalidKeyName)]
    Name {
        /// The position of the key, from 1.
        position: usize,
    },
    /// A scope is unknown, or there is none.
    #[error("key {position}: give one or more of the scopes detect, read, view and admin")]
    Scopes {
        /// The position of the key, from 1.
        position: usize,
    },
    /// The digest is invalid.
    #[error(
        "key {position}: sha256 must be the 64 hexadecimal digits that `lookdown key new` prints, \
         never the key itself"
    )]
    Digest {
        /// The position of the key, from 1.
        position: usize,
    },
    /// The priority is not a level.
    #[error(
        "key {position}: highest_priority must be {} (highest) to {}; without it, it is {}",
        PriorityLevel::HIGHEST,
        PriorityLevel::LOWEST,
        PriorityLevel::DEFAULT
    )]
    Priority {
        /// The position of the key, from 1.
        position: usize,
    },
    /// Two keys have the same name.
    #[error("key {position}: its name is used twice: give each key its own name")]
    Repeated {
        /// The position of the key, from 1.
        position: usize,
    },
    /// There are too many keys.
    #[error("there are more than {most} keys: remove unused ones")]
    TooMany {
        /// The maximum number.
        most: usize,
    },
}
