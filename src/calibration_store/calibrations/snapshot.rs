//! All calibrations at one moment.

use std::{
    collections::{BTreeMap, HashMap},
    sync::Arc,
};

use lookdown_calibration::CalibrationId;
use lookdown_calibration::revision::revision_of;
use lookdown_detect::metrics::{gauge_value, replace_info};

use super::{CalibrationEntry, load::LoadedFile, samples::sample};
use crate::metrics::Metrics;

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
