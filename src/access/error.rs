//! Keys that cannot be used.

use std::{io, path::PathBuf};

/// Keys that cannot be used. No message repeats what was given: somebody may have written a key
/// where something else belongs.
#[derive(Debug, thiserror::Error)]
pub enum KeyError {
    /// The file cannot be read.
    #[error("access.keys_file: {} cannot be read ({cause}): check its path and who may read it", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// Why.
        cause: io::Error,
    },
    /// The file has keys that cannot be used.
    #[error("access.keys_file: {} cannot be used: {problem}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        problem: Box<KeyError>,
    },
    /// The text has another shape.
    #[error(
        "line {line}: a key is a line of the form name = {{ scopes = [\"detect\"], sha256 = \
         \"64 hexadecimal digits\" }}, as `lookdown key new` prints it"
    )]
    Shape {
        /// The line, from 1.
        line: usize,
    },
    /// An entry of the environment has another shape.
    #[error(
        "key {position} is not of the form name:scope+scope:sha256, as `lookdown key new` prints it"
    )]
    Entry {
        /// Which it is, from 1.
        position: usize,
    },
    /// A name that is none.
    #[error("key {position}: {}", super::InvalidKeyName)]
    Name {
        /// Which key it is, from 1.
        position: usize,
    },
    /// A scope that is none, or no scope.
    #[error("key {position}: give one or more of the scopes detect, read and admin")]
    Scopes {
        /// Which key it is, from 1.
        position: usize,
    },
    /// A digest that is none.
    #[error(
        "key {position}: sha256 must be the 64 hexadecimal digits that `lookdown key new` prints, \
         never the key itself"
    )]
    Digest {
        /// Which key it is, from 1.
        position: usize,
    },
    /// Two keys of the same name.
    #[error("key {position}: its name is another key's, too: give each key its own")]
    Repeated {
        /// Which key it is, from 1.
        position: usize,
    },
    /// More keys than anybody needs.
    #[error("there are more than {most} keys: remove those that nobody uses")]
    TooMany {
        /// Most there may be.
        most: usize,
    },
}
