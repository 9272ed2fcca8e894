//! All calibrations at one moment.
//!
//! A file of the store as it was last read, with what it held before where it is broken now.
//!
//! The calibrations of the sample frames, built into the program as `sample-NAME`: the first
//! request and the web page show floor positions with them. Lists of calibrations leave them out. A
//! file of the same ID in the store takes their place.

use std::{
    collections::{BTreeMap, HashMap},
    sync::{Arc, LazyLock},
};

use lookdown_calibration::{CalibrationId, native::NativeCalibration, revision::revision_of};
use lookdown_detect::metrics::{gauge_value, replace_info};

use super::{
    Reading,
    content::{CalibrationEntry, cameras, import},
};
use crate::{
    calibration_store::{ListedFile, StoreError},
    metrics::Metrics,
    samples::SAMPLES,
};

/// All calibrations at one moment; never changed, only replaced.
#[derive(Debug, Clone, Default)]
pub(super) struct Snapshot {
    /// The files, by the ID in their names.
    pub(super) files: BTreeMap<CalibrationId, Arc<LoadedFile>>,
    by_id: HashMap<CalibrationId, Arc<CalibrationEntry>>,
    revision: String,
    /// The reason why the store could not be read, if it could not.
    pub(super) store_problem: Option<String>,
}

/// A calibration that serves or should.
#[derive(Debug, Clone)]
pub struct CalibrationRow {
    /// Its ID.
    pub id: CalibrationId,
    /// The name of its file in the store.
    pub file: String,
    /// The calibration that serves; `None` when no version could be used so far.
    pub entry: Option<Arc<CalibrationEntry>>,
    /// The reason why the newest version of its file, or a camera of it, is not used.
    pub problem: Option<String>,
}

/// The health of the calibrations of a store.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct CalibrationsHealth {
    /// The number that serve.
    pub serving: usize,
    /// Changes whenever any of those that serve does; equal where equal ones serve.
    pub revision: String,
    /// Files whose newest version cannot be used, by name, and why.
    pub problems: Vec<(String, String)>,
    /// The reason why the store could not be read, if it could not.
    pub store_problem: Option<String>,
}

impl Snapshot {
    /// The calibrations of these files. A file that has an ID's name goes before one that has it
    /// among others.
    pub(super) fn new(files: BTreeMap<CalibrationId, Arc<LoadedFile>>) -> Self {
        let mut by_id = HashMap::new();
        for (id, file) in &files {
            if let Some(entry) = file.cameras.get(id) {
                by_id.insert(id.clone(), Arc::clone(entry));
            }
        }
        for (id, entry) in files.values().flat_map(|file| &file.cameras) {
            if !files.contains_key(id) {
                by_id.entry(id.clone()).or_insert_with(|| Arc::clone(entry));
            }
        }
        Self {
            revision: revision_of_all(&by_id),
            files,
            by_id,
            store_problem: None,
        }
    }

    /// Returns the same snapshot with the reason why the store cannot be read.
    pub(super) fn with_store_problem(&self, problem: String) -> Self {
        Self {
            store_problem: Some(problem),
            ..self.clone()
        }
    }

    pub(super) fn entry(&self, id: &CalibrationId) -> Option<&Arc<CalibrationEntry>> {
        self.by_id.get(id)
    }

    /// Returns the entry of `id`; that of a sample frame if the store has no file of this name.
    pub(super) fn entry_or_sample(&self, id: &CalibrationId) -> Option<&Arc<CalibrationEntry>> {
        let own_sample = || sample(id).filter(|_| !self.files.contains_key(id));
        self.entry(id).or_else(own_sample)
    }

    /// The file that has this ID's name, and why it gives no calibration of this ID.
    pub(super) fn why_unusable(&self, id: &CalibrationId) -> Option<(String, String)> {
        let file = self.files.get(id)?;
        let several = || {
            let ids: Vec<_> = file.cameras.keys().map(CalibrationId::as_str).collect();
            format!(
                "the file holds {}: name one of {}",
                ids.len(),
                ids.join(", ")
            )
        };
        let problem = file.problems.first().cloned().unwrap_or_else(several);
        Some((file.named.file.name.clone(), problem))
    }

    pub(super) fn rows(&self) -> Vec<CalibrationRow> {
        let mut rows = BTreeMap::new();
        for (id, file) in &self.files {
            let problem = file.problems.first().cloned();
            let row = |id: &CalibrationId, entry| CalibrationRow {
                id: id.clone(),
                file: file.named.file.name.clone(),
                entry,
                problem: problem.clone(),
            };
            if file.cameras.is_empty() {
                rows.insert(id.clone(), row(id, None));
            }
            for (id, entry) in &file.cameras {
                let serves = self
                    .entry(id)
                    .is_some_and(|known| Arc::ptr_eq(known, entry));
                if serves {
                    rows.insert(id.clone(), row(id, Some(Arc::clone(entry))));
                }
            }
        }
        rows.into_values().collect()
    }

    /// Publishes this snapshot, which replaces `before`, in the metrics.
    pub(super) fn publish(&self, metrics: &Metrics, before: Option<&Self>) {
        let broken = self.files.values().filter(|file| !file.problems.is_empty());
        let before = before.map(|before| [&*before.revision]);
        replace_info(
            &metrics.calibrations_info,
            before.as_ref().map(<[_; 1]>::as_slice),
            &[&self.revision],
        );
        metrics.calibrations.set(gauge_value(self.by_id.len()));
        let up = i64::from(self.store_problem.is_none());
        metrics.calibration_store_up.set(up);
        let broken = gauge_value(broken.count());
        metrics.calibration_files_broken.set(broken);
    }

    /// Returns the health of the calibrations.
    pub(super) fn health(&self) -> CalibrationsHealth {
        let problems = self.files.values().flat_map(|file| {
            let name = &file.named.file.name;
            file.problems.iter().map(|why| (name.clone(), why.clone()))
        });
        CalibrationsHealth {
            serving: self.by_id.len(),
            revision: self.revision.clone(),
            problems: problems.collect(),
            store_problem: self.store_problem.clone(),
        }
    }
}

/// One revision for all calibrations, whatever order they are in.
fn revision_of_all(by_id: &HashMap<CalibrationId, Arc<CalibrationEntry>>) -> String {
    let mut all: Vec<_> = by_id
        .iter()
        .map(|(id, entry)| format!("{id} {}\n", entry.calibration.revision()))
        .collect();
    all.sort_unstable();
    revision_of(all.concat().as_bytes())
}

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

static ENTRIES: LazyLock<HashMap<CalibrationId, Arc<CalibrationEntry>>> = LazyLock::new(|| {
    let files = SAMPLES.iter().map(|sample| sample.calibration);
    files.filter_map(read).collect()
});

/// Returns the calibration of the sample frame `id`, such as `sample-office`.
pub(super) fn sample(id: &CalibrationId) -> Option<&'static Arc<CalibrationEntry>> {
    ENTRIES.get(id)
}

fn read(file: &str) -> Option<(CalibrationId, Arc<CalibrationEntry>)> {
    let mut native: NativeCalibration = serde_json::from_str(file).ok()?;
    native.id = format!("sample-{}", native.id);
    let id = native.id.parse().ok()?;
    let content = serde_json::to_vec(&native).ok()?;
    let (entry, _) = import(&id, &written_name(&id), &content, &Reading::default()).ok()?;
    Some((id, Arc::new(entry)))
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

    #[test]
    fn each_sample_has_its_calibration() {
        for name in crate::samples::NAMES {
            let id: CalibrationId = format!("sample-{name}").parse().unwrap();
            let entry = sample(&id).unwrap();
            assert_eq!(entry.calibration.id(), &id);
            assert_eq!(entry.native.mount.height_m, Some(2.9));
        }
    }
}
