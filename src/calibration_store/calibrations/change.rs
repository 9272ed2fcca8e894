//! Creating, replacing and deleting calibrations.

use std::sync::Arc;

use lookdown_calibration::CalibrationId;

use super::{
    CalibrationEntry, Calibrations, ChangeError, Reading,
    content::import,
    load::{LoadedFile, written_name},
    samples::sample,
};
use crate::calibration_store::{ListedFile, Replaces};

/// The precondition of a change to a calibration.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum WriteCondition {
    /// No precondition.
    Always,
    /// The calibration must not exist.
    IfAbsent,
    /// The calibration must exist.
    IfPresent,
    /// The calibration must exist at one of these revisions.
    IfRevision(Vec<String>),
}

/// A calibration that was written.
#[derive(Debug, Clone)]
pub struct Put {
    /// The calibration that serves now.
    pub entry: Arc<CalibrationEntry>,
    /// True when there was none before.
    pub created: bool,
}

impl Calibrations {
    /// Reads `content` as the calibration `id`, by the rules of [`Calibrations::put`]; nothing is
    /// stored.
    ///
    /// # Errors
    /// [`ChangeError`] for content that cannot be a calibration.
    pub fn check(
        id: &CalibrationId,
        content: &[u8],
        reading: &Reading,
    ) -> Result<CalibrationEntry, ChangeError> {
        import(id, &written_name(id), content, reading).map(|(entry, _)| entry)
    }

    /// Checks `content`, a calibration file in any format with one camera or with that called
    /// `camera`, and stores it as the calibration `id`, in the native format. It serves when this
    /// returns. Blocks.
    ///
    /// # Errors
    /// [`ChangeError`]; then nothing has changed, but for [`ChangeError::Unseen`].
    pub fn put(
        &self,
        id: &CalibrationId,
        content: &[u8],
        reading: &Reading,
        condition: &WriteCondition,
    ) -> Result<Put, ChangeError> {
        if !self.writable {
            return Err(ChangeError::NotWritable);
        }
        let name = written_name(id);
        let (entry, written) = import(id, &name, content, reading)?;
        let changing = self.lock();
        // What others have stored since the last look counts, too.
        self.scan(&changing)?;
        let before = self.now();
        let replaced = before.entry_or_sample(id);
        condition.check(replaced.map(Arc::as_ref))?;
        let file = before.files.get(id);
        if let Some(shared) = file.filter(|file| file.holds_several) {
            return Err(shared_file(shared));
        }
        let expected = condition.replaces(file.map(|file| &file.named.file), &name);
        self.store.write(&name, written.as_bytes(), expected)?;
        // It hides the others, so that neither a kill nor a failure from here on does harm.
        let others = file.into_iter().flat_map(|file| file.names());
        others
            .filter(|other| *other != name)
            .try_for_each(|hidden| self.store.delete(hidden))
            .and_then(|()| self.scan(&changing))
            .map_err(ChangeError::Unseen)?;
        Ok(Put {
            entry: Arc::new(entry),
            created: replaced.is_none(),
        })
    }

    /// Deletes the calibration `id` with its file. Blocks.
    ///
    /// # Errors
    /// [`ChangeError`].
    pub fn delete(
        &self,
        id: &CalibrationId,
        condition: &WriteCondition,
    ) -> Result<(), ChangeError> {
        if !self.writable {
            return Err(ChangeError::NotWritable);
        }
        let changing = self.lock();
        self.scan(&changing)?;
        let before = self.now();
        let entry = before.entry(id);
        let file = before.files.get(id);
        if entry.is_none() && file.is_none() {
            let id = id.clone();
            return Err(match sample(&id) {
                Some(_) => ChangeError::Sample { id },
                None => ChangeError::Unknown { id },
            });
        }
        condition.check(entry.map(Arc::as_ref))?;
        let holder = || {
            before
                .files
                .values()
                .find(|file| file.cameras.contains_key(id))
        };
        let Some(file) = file.or_else(holder).filter(|file| !file.holds_several) else {
            let shared = file.or_else(holder).map(|file| shared_file(file));
            return Err(shared.unwrap_or(ChangeError::Unknown { id: id.clone() }));
        };
        // The one that counts last: until then it hides the others.
        for name in file.names().rev() {
            self.store.delete(name)?;
        }
        self.scan(&changing).map_err(ChangeError::Unseen)
    }
}

impl LoadedFile {
    /// The names of the files of its ID, the one that counts first.
    fn names(&self) -> impl DoubleEndedIterator<Item = &str> {
        let hidden = self.named.hidden.iter().map(String::as_str);
        std::iter::once(self.named.file.name.as_str()).chain(hidden)
    }
}

fn shared_file(file: &LoadedFile) -> ChangeError {
    ChangeError::Shared {
        file: file.named.file.name.clone(),
        ids: file.cameras.keys().map(ToString::to_string).collect(),
    }
}

impl WriteCondition {
    /// Returns the content that the file called `name` may replace under this condition, when
    /// `known` is that of its ID: no change that was made after the condition was checked.
    fn replaces<'a>(&self, known: Option<&'a ListedFile>, name: &str) -> Replaces<'a> {
        match known {
            _ if *self == Self::Always => Replaces::Anything,
            Some(file) if file.name == name => Replaces::Stamp(&file.stamp),
            _ => Replaces::Nothing,
        }
    }

    fn check(&self, now: Option<&CalibrationEntry>) -> Result<(), ChangeError> {
        let revision = now.map(|entry| entry.calibration.revision());
        let is_met = match self {
            Self::Always => true,
            Self::IfAbsent => revision.is_none(),
            Self::IfPresent => revision.is_some(),
            Self::IfRevision(wanted) => {
                revision.is_some_and(|revision| wanted.iter().any(|wanted| wanted == revision))
            }
        };
        if is_met {
            return Ok(());
        }
        let now = revision.map_or("not there".to_owned(), |revision| {
            format!("at revision {revision}")
        });
        Err(ChangeError::Outdated { now })
    }
}
