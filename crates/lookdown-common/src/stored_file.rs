//! The versions of the files that outlive the program that wrote them.

/// A kind of file that later versions of the program read.
///
/// Its content has the key `version` ([`StoredFile::KEY`]). A file without the key has version 1. A
/// kind gets the next version when earlier programs would misread its files: read the earlier
/// versions on, and keep a file of each in `tests/fixtures/upgrade`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StoredFile {
    /// The settings file.
    Settings,
    /// A calibration in the native format.
    Calibration,
    /// The cameras of `lookdown run` that are added over HTTP.
    Cameras,
    /// The straight views of cameras.
    Views,
    /// The counts: `user_version` of the `SQLite` file.
    Counts,
    /// The state of a tracker in the counts: its first byte.
    Tracks,
}

impl StoredFile {
    /// The key of the version.
    pub const KEY: &str = "version";

    /// Returns the newest version, which is the one that this program writes.
    pub const fn version(self) -> u8 {
        match self {
            Self::Settings | Self::Calibration | Self::Cameras | Self::Views | Self::Counts => 1,
            Self::Tracks => 4,
        }
    }

    /// Checks the version of a file, as it is written there.
    ///
    /// # Errors
    /// The end of a sentence about the file, if this program does not read the version.
    pub fn check(self, written: &str) -> Result<(), String> {
        let newest = self.version();
        let is_read = |version: u8| (1..=newest).contains(&version);
        if written.parse().is_ok_and(is_read) {
            return Ok(());
        }
        let versions = match newest {
            1 => "version 1".to_owned(),
            _ => format!("versions 1 to {newest}"),
        };
        let written: String = written.chars().take(MAX_CHARS).collect();
        Err(format!(
            "has the version {written}, and this program reads {versions}: use the Lookdown that \
             wrote it, or the copy from before its upgrade"
        ))
    }
}

/// Most characters of a version that are repeated.
const MAX_CHARS: usize = 20;

#[cfg(test)]
mod tests {
    use super::StoredFile;

    #[test]
    fn a_version_is_read_up_to_the_newest_one() {
        for kind in [StoredFile::Counts, StoredFile::Tracks] {
            let newest = kind.version();
            for version in 1..=newest {
                assert_eq!(kind.check(&version.to_string()), Ok(()));
            }
            for wrong in [&(newest + 1).to_string(), "0", "-1", "1.0", "\"1\"", "257"] {
                let refused = kind.check(wrong).unwrap_err();
                assert!(refused.contains(&format!("has the version {wrong},")));
                assert!(refused.contains(&newest.to_string()), "{refused}");
            }
        }
    }
}
