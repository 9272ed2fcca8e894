//! Calibration IDs.

use std::{fmt, str::FromStr};

use lookdown_common::{
    plain_name::{MAX_CHARS, is_plain},
    text::{Quoted, shortened},
};

use crate::FormatError;

/// The ID of a calibration: `[a-z0-9][a-z0-9_-]{0,63}`. Safe in file names and URLs.
#[derive(Debug, Clone, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct CalibrationId(String);

/// A text that is not a calibration ID.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{} is not {}", Quoted(.0), CalibrationId::RULE)]
pub struct InvalidCalibrationId(String);

impl CalibrationId {
    /// A regular expression that IDs match.
    pub const PATTERN: &'static str = "^[a-z0-9][a-z0-9_-]{0,63}$";
    /// Completes "… is not" where an ID is needed.
    pub const RULE: &'static str = "a calibration ID: use 1 to 64 of a-z, 0-9, _ and -, beginning \
                                    with a letter or digit";

    /// The ID as text.
    pub fn as_str(&self) -> &str {
        &self.0
    }

    /// A file's name, and that of a camera in it, with every letter that an ID may not have
    /// replaced and the file's name cut to leave room; an ID unless nothing is left at its
    /// beginning.
    pub(super) fn from_names(file: &str, camera: Option<&str>) -> String {
        let allowed = |name: &str, at_most: usize| -> String {
            let letters = name
                .chars()
                .map(|letter| match letter.to_ascii_lowercase() {
                    letter @ ('a'..='z' | '0'..='9' | '_' | '-') => letter,
                    _ => '-',
                });
            letters.take(at_most).collect()
        };
        let camera = camera.map_or(String::new(), |name| {
            format!("-{}", allowed(name, MAX_CHARS / 2))
        });
        let file = allowed(file, MAX_CHARS - camera.len());
        format!("{file}{camera}")
            .trim_start_matches(['-', '_'])
            .to_owned()
    }
}

impl FromStr for CalibrationId {
    type Err = InvalidCalibrationId;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        if is_plain(text) {
            Ok(Self(text.to_owned()))
        } else {
            Err(InvalidCalibrationId(shortened(text).to_owned()))
        }
    }
}

impl fmt::Display for CalibrationId {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(&self.0)
    }
}

/// Checks the name in a field of a calibration file.
pub(super) fn check_name(field: &str, name: &str) -> Result<(), FormatError> {
    if is_plain(name) {
        return Ok(());
    }
    let shown: String = name.chars().take(MAX_CHARS).collect();
    let problem = format!(
        "it is {shown:?}: use 1 to {MAX_CHARS} of a-z, 0-9, _ and -, beginning with a letter or \
         digit"
    );
    Err(FormatError::invalid(field, problem))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_files_and_cameras_become_ids() {
        for (file, camera, expected) in [
            ("lobby", None, "lobby"),
            ("lobby", Some("cam0"), "lobby-cam0"),
            ("Camera 1 (old)", None, "camera-1--old-"),
            ("-x", Some("Axis"), "x-axis"),
        ] {
            assert_eq!(CalibrationId::from_names(file, camera), expected);
        }
        let long = CalibrationId::from_names(&"x".repeat(99), Some("cam0"));
        assert!(long.ends_with("x-cam0") && long.parse::<CalibrationId>().is_ok());
    }

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
