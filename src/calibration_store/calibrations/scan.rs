//! Scans the store for changed files and reads them.

use std::{collections::BTreeMap, sync::Arc};

use lookdown_calibration::CalibrationFile;
use parking_lot::MutexGuard;

use super::{
    Calibrations,
    load::{LoadedFile, by_id},
    snapshot::Snapshot,
};
use crate::calibration_store::StoreError;

impl Calibrations {
    /// Lists the store and reads the files that have changed. Failures are logged, reported by
    /// [`Calibrations::health`], and leave the affected calibrations unchanged. Blocks.
    pub fn refresh(&self) {
        let changing = self.changing.lock();
        if let Err(error) = self.scan(&changing) {
            self.keep_all(&error);
        }
    }

    /// Logs and reports that the store cannot be read.
    pub(super) fn keep_all(&self, error: &StoreError) {
        let problem = error.to_string();
        let now = self.now();
        if now.store_problem.as_ref() != Some(&problem) {
            tracing::error!("calibrations cannot be read, the loaded ones stay in use: {problem}");
            self.replace(now.with_store_problem(problem));
        }
    }

    /// Lists the store and reads what has changed.
    pub(super) fn scan(&self, _changing: &MutexGuard<'_, ()>) -> Result<(), StoreError> {
        let before = self.now();
        let listed = by_id(self.store.list()?);
        let gone = before.files.keys().filter(|id| !listed.contains_key(id));
        let gone: Vec<_> = gone.cloned().collect();
        let (mut files, mut changed) = (BTreeMap::new(), Vec::new());
        for (id, named) in listed {
            match before.files.get(&id) {
                Some(known) if known.named == named => {
                    files.insert(id, Arc::clone(known));
                }
                _ => changed.push((id, named)),
            }
        }
        if before.store_problem.is_none() && gone.is_empty() && changed.is_empty() {
            return Ok(());
        }
        for (id, named) in changed {
            let known = before.files.get(&id).map(Arc::as_ref);
            // One byte more than is accepted, so that a larger file is known for one.
            let content = self
                .store
                .read(&named.file.name, CalibrationFile::MAX_BYTES + 1);
            let loaded = LoadedFile::new(&id, named, content, known);
            self.record_change(&loaded, known);
            files.insert(id, Arc::new(loaded));
        }
        for gone in gone {
            tracing::info!(calibration = %gone, "its file is gone");
        }
        if before.store_problem.is_some() {
            tracing::info!("calibrations can be read again");
        }
        self.replace(Snapshot::new(files));
        Ok(())
    }

    /// Counts and logs what a file changes.
    fn record_change(&self, loaded: &LoadedFile, known: Option<&LoadedFile>) {
        if !loaded.is_changed(known) {
            return;
        }
        let result = if loaded.problems.is_empty() {
            "success"
        } else {
            "failure"
        };
        let loads = &self.metrics.calibration_loads;
        loads.with_label_values(&[result]).inc();
        loaded.log(known);
    }
}
