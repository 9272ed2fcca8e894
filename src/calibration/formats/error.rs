//! Why the content of a calibration file cannot be used.

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
        /// Which field, with the fields it lies in.
        field: String,
        /// The value and what would be right.
        problem: String,
    },
}

impl FormatError {
    /// A field that makes no camera.
    pub(in crate::calibration) fn invalid(
        field: impl Into<String>,
        problem: impl Into<String>,
    ) -> Self {
        Self::Invalid {
            field: field.into(),
            problem: problem.into(),
        }
    }
}
