//! Errors in the content of a calibration file.

/// The content of a calibration file that cannot be used. Every message is one sentence with the
/// remedy.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum FormatError {
    /// The content is in no format that is read, or broken.
    #[error("not a calibration file: {0}")]
    Malformed(String),
    /// A field makes no camera.
    #[error("{field}: {problem}")]
    Invalid {
        /// The field, with the fields around it.
        field: String,
        /// The value and what would be right.
        problem: String,
    },
    /// The file has no frame size, and neither has the request.
    #[error(
        "size: the file has no frame size: convert it with `lookdown calibration convert --size \
         WIDTHxHEIGHT`, or PUT it with ?size=WIDTHxHEIGHT"
    )]
    MissingSize,
}

impl FormatError {
    /// The parameter that the client should send, or the field of the file at fault.
    pub fn parameter(&self) -> Option<&str> {
        match self {
            Self::Malformed(_) => None,
            Self::Invalid { field, .. } => Some(field),
            Self::MissingSize => Some("size"),
        }
    }

    /// Content that is in no format that is read, or broken.
    pub(super) fn malformed(problem: impl Into<String>) -> Self {
        Self::Malformed(shortened(problem.into()))
    }

    /// A field that makes no camera.
    pub fn invalid(field: impl Into<String>, problem: impl Into<String>) -> Self {
        Self::Invalid {
            field: shortened(field.into()),
            problem: shortened(problem.into()),
        }
    }
}

/// Most characters of a part of a message: files of a mebibyte are quoted in it.
const MAX_CHARS: usize = 600;

/// At most as many characters as a message may have.
fn shortened(mut text: String) -> String {
    if let Some((end, _)) = text.char_indices().nth(MAX_CHARS) {
        text.truncate(end);
        text.push('…');
    }
    text
}
