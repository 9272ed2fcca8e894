//! Calibration IDs.

use std::{fmt, str::FromStr};

const MAX_CHARS: usize = 64;

/// The ID of a calibration: `[a-z0-9][a-z0-9_-]{0,63}`. Safe in file names and URLs.
#[derive(Debug, Clone, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct CalibrationId(String);

/// A text that is no calibration ID.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "{0:?} is not a calibration ID: use 1 to 64 of a-z, 0-9, _ and -, beginning with a letter or \
     digit"
)]
pub struct InvalidCalibrationId(String);

impl CalibrationId {
    /// The ID as text.
    #[must_use]
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

impl FromStr for CalibrationId {
    type Err = InvalidCalibrationId;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let letter_or_digit = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit();
        let valid = text.len() <= MAX_CHARS
            && text.starts_with(letter_or_digit)
            && text
                .chars()
                .all(|c| letter_or_digit(c) || c == '_' || c == '-');
        if valid {
            Ok(Self(text.to_owned()))
        } else {
            // Enough to recognise it by, not enough to fill a log.
            Err(InvalidCalibrationId(
                text.chars().take(MAX_CHARS + 1).collect(),
            ))
        }
    }
}

impl fmt::Display for CalibrationId {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(&self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_id_cannot_leave_its_folder_or_hide() {
        for good in ["lobby", "0", "a-b_c", &"x".repeat(64)] {
            assert_eq!(good.parse::<CalibrationId>().unwrap().as_str(), good);
        }
        for bad in [
            "",
            "../etc",
            "Lobby",
            "-x",
            "_x",
            "a.b",
            "a/b",
            "ä",
            &"x".repeat(65),
        ] {
            assert!(bad.parse::<CalibrationId>().is_err(), "{bad:?}");
        }
    }
}
