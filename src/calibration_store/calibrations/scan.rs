//! Scans the store for changed files and reads them.

use std::{collections::BTreeMap, sync::Arc};

use lookdown_lens::calibration::{CalibrationFile, CalibrationId};
use parking_lot::MutexGuard;

use super::{
    Calibrations,
    load::LoadedFile,
    named_file::{NamedFile, by_id},
    snapshot::Snapshot,
};
use crate::calibration_store::{READ_AT_ONCE, StoreError};

/// Batches in a row of which no file is answered, after which a scan ends: the store is silent.
const MAX_SILENT: usize = 2;

/// The files of a store by the ID in their names.
type Files = BTreeMap<CalibrationId, Arc<LoadedFile>>;

impl Calibrations {
    /// Lists the store and reads the files that have changed. Failures are logged, reported by
    /// [`Calibrations::health`], and leave the affected calibrations unchanged. Blocks.
    pub fn refresh(&self) {
        let changing = self.lock();
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
        let (mut files, mut changed) = (Files::new(), Vec::new());
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
        // Those that could not be read at the last scan come last, so that they stop no others.
        changed.sort_by_key(|(id, _)| before.files.get(id).is_none_or(|file| file.has_been_read()));
        let problem = self.load(changed, &before.files, &mut files);
        for gone in gone {
            tracing::info!(calibration = %gone, "its file is gone");
        }
        match (&problem, &before.store_problem) {
            (None, Some(_)) => tracing::info!("calibrations can be read again"),
            (Some(problem), known) if known.as_ref() != Some(problem) => {
                tracing::error!("some calibrations are not read yet: {problem}");
            }
            _ => {}
        }
        let now = Snapshot::of(files);
        self.replace(match problem {
            Some(problem) => now.with_store_problem(problem),
            None => now,
        });
        Ok(())
    }

    /// Reads files, as they are listed, into `files`. When several batches in a row are not
    /// answered, the rest stays as it is in `before`. Returns the reason in that case.
    fn load(
        &self,
        mut listed: Vec<(CalibrationId, NamedFile)>,
        before: &Files,
        files: &mut Files,
    ) -> Option<String> {
        let mut silent = 0;
        while !listed.is_empty() {
            let some = listed.split_off(listed.len().saturating_sub(READ_AT_ONCE));
            let names: Vec<_> = some.iter().map(|(_, named)| &*named.file.name).collect();
            // One byte more than is accepted, so that a larger file is known for one.
            let contents = self.store.read(&names, CalibrationFile::MAX_BYTES + 1);
            let unanswered = |content: &Result<_, _>| match content {
                Err(error @ StoreError::Unreachable { .. }) => Some(error.to_string()),
                _ => None,
            };
            let reasons: Vec<_> = contents.iter().filter_map(unanswered).collect();
            let is_silent = reasons.len() == contents.len();
            silent = if is_silent { silent + 1 } else { 0 };
            for ((id, named), content) in some.into_iter().zip(contents) {
                let known = before.get(&id).map(Arc::as_ref);
                let loaded = LoadedFile::new(&self.reader, &id, named, content, known);
                self.record_change(&loaded, known);
                files.insert(id, Arc::new(loaded));
            }
            if silent == MAX_SILENT && !listed.is_empty() {
                let rest = listed.into_iter().filter_map(|(id, _)| {
                    let known = before.get(&id)?;
                    Some((id, Arc::clone(known)))
                });
                files.extend(rest);
                return reasons.into_iter().next();
            }
        }
        None
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
