//! The current keys: those of the environment, and those of a file that may change.

use std::{
    path::{Path, PathBuf},
    sync::Arc,
};

use anyhow::anyhow;
use lookdown_common::{
    LogOnce,
    files::{self, MAX_SETTINGS_BYTES},
};
use parking_lot::{Mutex, RwLock};

use super::key_list::{Holder, KeyList};

/// The current keys.
#[derive(Debug)]
pub struct AccessKeys {
    /// The keys that do not depend on the file.
    lasting: KeyList,
    file: Option<PathBuf>,
    known: RwLock<Arc<KeyList>>,
    /// The last logged problem of the file. Locked while the file is read.
    problem_log: Mutex<LogOnce>,
}

impl AccessKeys {
    /// Creates the keys of `lasting` and of `file`, if one is given.
    ///
    /// # Errors
    /// If the file cannot be used.
    pub fn open(lasting: KeyList, file: Option<&Path>) -> anyhow::Result<Self> {
        let known = match file {
            Some(file) => read(file, &lasting)?,
            None => lasting.clone(),
        };
        Ok(Self {
            lasting,
            file: file.map(Path::to_owned),
            known: RwLock::new(Arc::new(known)),
            problem_log: Mutex::default(),
        })
    }

    /// Reads the file again. If it cannot be used, the keys stay unchanged, and the reason is
    /// logged once.
    pub fn refresh(&self) {
        let Some(file) = &self.file else { return };
        let mut problem_log = self.problem_log.lock();
        match read(file, &self.lasting) {
            Ok(list) => {
                problem_log.clear();
                if *self.known() != list {
                    tracing::info!(keys = list.len(), "the keys have changed");
                    *self.known.write() = Arc::new(list);
                }
            }
            Err(error) => {
                let problem = error.to_string();
                if problem_log.should_log(&problem) {
                    tracing::error!("{problem}; the previous keys stay in use");
                }
            }
        }
    }

    /// Returns the holder of this key, or `None` if the key is unknown.
    pub fn holder_of(&self, key: &[u8]) -> Option<Holder> {
        self.known().holder_of(key).cloned()
    }

    /// The keys that are known now.
    pub fn known(&self) -> Arc<KeyList> {
        Arc::clone(&self.known.read())
    }
}

fn read(path: &Path, lasting: &KeyList) -> anyhow::Result<KeyList> {
    let (key, file) = ("access.keys_file", path.display());
    let text = files::read_text(path, MAX_SETTINGS_BYTES).map_err(|cause| {
        anyhow!("{key}: {file} cannot be read ({cause}): check its path and its permissions")
    })?;
    let list = KeyList::from_toml(&text).and_then(|list| lasting.clone().with(&list));
    list.map_err(|problem| anyhow!("{key}: {file} cannot be used: {problem}"))
}
