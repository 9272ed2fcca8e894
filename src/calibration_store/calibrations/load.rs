//! A file of the store as it was last read, with what it held before where it is broken now.
//!
//! The files of a store that are calibrations, and their IDs.

use std::{collections::BTreeMap, sync::Arc};

use lookdown_calibration::CalibrationId;

use super::content::{CalibrationEntry, cameras};
use crate::calibration_store::{ListedFile, StoreError};

/// A file of the store.
#[derive(Debug)]
pub(super) struct LoadedFile {
    /// The version that was read.
    pub(super) named: NamedFile,
    /// Its calibrations that serve, from this version or the last that could be used.
    pub(super) cameras: BTreeMap<CalibrationId, Arc<CalibrationEntry>>,
    /// True when the last version that could be read holds several cameras.
    pub(super) holds_several: bool,
    /// Reasons why this version, or cameras of it, cannot be used, one sentence each.
    pub(super) problems: Vec<String>,
}

impl LoadedFile {
    /// The file of the ID `stem`; what cannot be used stays as it is in `before`.
    pub(super) fn new(
        stem: &CalibrationId,
        mut named: NamedFile,
        content: Result<Vec<u8>, StoreError>,
        before: Option<&Self>,
    ) -> Self {
        let found = match content {
            Ok(content) => {
                cameras(stem, &named.file.name, &content).map_err(|error| error.to_string())
            }
            Err(error) => {
                // So that it is tried again, although it may never change.
                named.file.stamp.clear();
                Err(error.to_string())
            }
        };
        let found = match found {
            Ok(found) => found,
            Err(problem) => {
                return Self {
                    named,
                    cameras: before.map(|file| file.cameras.clone()).unwrap_or_default(),
                    holds_several: before.is_some_and(|file| file.holds_several),
                    problems: vec![problem],
                };
            }
        };
        let holds_several = found.len() > 1;
        let (mut cameras, mut problems) = (BTreeMap::new(), Vec::new());
        for (name, outcome) in found {
            // A lone camera is that of the file, whatever it calls itself.
            let id = if holds_several {
                name.parse().ok()
            } else {
                Some(stem.clone())
            };
            match (id, outcome) {
                (Some(id), Ok(entry)) => {
                    cameras.insert(id, Arc::new(entry));
                }
                (id, Err(problem)) => {
                    let of_which = if holds_several {
                        format!("{name}: ")
                    } else {
                        String::new()
                    };
                    problems.push(format!("{of_which}{problem}"));
                    let last_good = id.and_then(|id| before?.cameras.get_key_value(&id));
                    cameras.extend(last_good.map(|(id, entry)| (id.clone(), Arc::clone(entry))));
                }
                // Its ID was checked with the rest.
                (None, Ok(_)) => {}
            }
        }
        Self {
            named,
            cameras,
            holds_several,
            problems,
        }
    }

    /// Returns true for a result that differs from `before`: a repeated read failure does not
    /// differ.
    pub(super) fn is_changed(&self, before: Option<&Self>) -> bool {
        self.problems.is_empty()
            || before
                .is_none_or(|before| before.problems != self.problems || before.named != self.named)
    }

    /// Logs the changes of this version.
    pub(super) fn log(&self, before: Option<&Self>) {
        let file = &self.named.file.name;
        for problem in &self.problems {
            let serving = if self.cameras.is_empty() {
                "no calibration is loaded from it"
            } else {
                "calibrations loaded from it stay in use"
            };
            tracing::error!(file, "calibration not used, {serving}: {problem}");
        }
        for (id, entry) in &self.cameras {
            let replaced = before.and_then(|before| before.cameras.get(id));
            let replaced = replaced.map(|entry| entry.calibration.revision());
            let revision = entry.calibration.revision();
            if replaced != Some(revision) {
                tracing::info!(calibration = %id, revision, replaced, file, "calibration loaded");
            }
        }
    }
}

/// File endings that are read; of several files of one ID the first in this order counts.
const ENDINGS: [&str; 6] = ["json", "yaml", "yml", "toml", "xml", "txt"];

/// The file of an ID.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct NamedFile {
    /// The file that counts.
    pub(super) file: ListedFile,
    /// Names of files of the same ID that it hides.
    pub(super) hidden: Vec<String>,
}

/// The name of the files that are written.
pub(super) fn written_name(id: &CalibrationId) -> String {
    format!("{id}.{}", ENDINGS[0])
}

/// The files that are called `<id>.<ending>`; others are none of ours.
pub(super) fn by_id(files: Vec<ListedFile>) -> BTreeMap<CalibrationId, NamedFile> {
    let mut ranked: Vec<_> = files
        .into_iter()
        .filter_map(|file| {
            let (stem, ending) = file.name.rsplit_once('.')?;
            let rank = ENDINGS.iter().position(|known| *known == ending)?;
            Some((stem.parse::<CalibrationId>().ok()?, rank, file))
        })
        .collect();
    ranked.sort_by(|(left, left_rank, _), (right, right_rank, _)| {
        (left, left_rank).cmp(&(right, right_rank))
    });
    let mut named: BTreeMap<CalibrationId, NamedFile> = BTreeMap::new();
    for (id, _, file) in ranked {
        if let Some(first) = named.get_mut(&id) {
            first.hidden.push(file.name);
        } else {
            let hidden = Vec::new();
            named.insert(id, NamedFile { file, hidden });
        }
    }
    named
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_without_an_id_are_skipped_and_endings_are_ranked() {
        let names = [
            "lobby.yaml",
            "lobby.json",
            "..data",
            "README.md",
            "Hall.json",
            ".lobby.json.1-0.lookdown-unfinished",
            "yard.txt",
        ];
        let files = names.map(|name| ListedFile {
            name: name.to_owned(),
            stamp: String::new(),
        });
        let files_by_id = by_id(files.to_vec());
        let found: Vec<_> = files_by_id
            .iter()
            .map(|(id, named)| (id.as_str(), named.file.name.as_str(), named.hidden.clone()))
            .collect();
        assert_eq!(
            found,
            [
                ("lobby", "lobby.json", vec!["lobby.yaml".to_owned()]),
                ("yard", "yard.txt", vec![]),
            ]
        );
    }
}
