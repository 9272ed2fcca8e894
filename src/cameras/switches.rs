//! The switches of cameras: whether frames are read, and whether the latest image is kept.

use std::collections::{BTreeMap, BTreeSet};

use lookdown_common::ConfigError;

use super::{CameraError, Cameras, PAUSED, WITH_IMAGE};

impl Cameras {
    /// Returns the paused cameras of the settings with their sources. Blocks.
    ///
    /// # Errors
    /// [`ConfigError`].
    pub fn paused_of_settings(&self) -> Result<BTreeMap<String, String>, ConfigError> {
        let paused = self.listed(PAUSED)?;
        let configured = self.configured.read();
        let of_settings = configured.iter().filter(|(name, _)| paused.contains(*name));
        let with_source =
            of_settings.map(|(name, camera)| (name.clone(), camera.location.to_string()));
        Ok(with_source.collect())
    }

    /// Returns true if the latest image of the camera is kept.
    pub fn keeps_image(&self, name: &str) -> bool {
        self.with_image.read().contains(name)
    }

    /// Returns all cameras by name, and whether their frames are read. Blocks.
    ///
    /// # Errors
    /// [`ConfigError`].
    pub fn detection(&self) -> Result<BTreeMap<String, bool>, ConfigError> {
        let stored = self.stored()?;
        let mut states: BTreeMap<_, _> = stored
            .into_iter()
            .map(|(name, camera)| {
                let is_on = !camera.paused || self.is_watched(&name);
                (name, is_on)
            })
            .collect();
        let paused = self.listed(PAUSED)?;
        for name in self.configured.read().keys() {
            let is_on = !paused.contains(name) || self.is_watched(name);
            states.insert(name.clone(), is_on);
        }
        Ok(states)
    }

    /// Pauses a camera or resumes it; it stays so after a restart. Returns false for an unknown
    /// camera. Blocks.
    ///
    /// # Errors
    /// [`CameraError`].
    pub fn set_detection(&self, name: &str, is_on: bool) -> Result<bool, CameraError> {
        self.change(name, Some(!is_on), None)
    }

    /// Pauses or resumes a camera, and switches whether its latest image is kept; `None` leaves it.
    /// Returns false for an unknown camera. Blocks.
    ///
    /// # Errors
    /// [`CameraError`].
    pub fn change(
        &self,
        name: &str,
        paused: Option<bool>,
        keep_image: Option<bool>,
    ) -> Result<bool, CameraError> {
        let _locked = self.folder.lock()?;
        let configured: BTreeSet<_> = self.configured.read().keys().cloned().collect();
        if configured.contains(name) {
            for (list, is_listed) in [(PAUSED, paused), (WITH_IMAGE, keep_image)] {
                let Some(is_listed) = is_listed else { continue };
                let mut names = self.listed(list)?;
                // Names that the settings no longer have are dropped, so that the file stays small.
                names.retain(|other| configured.contains(other) && other != name);
                if is_listed {
                    names.insert(name.to_owned());
                }
                let content = serde_json::to_string(&names).unwrap_or_default();
                self.folder.write(&self.folder.file(list), &content)?;
            }
            self.set_with_image(name, keep_image);
            return Ok(true);
        }
        let mut file = self.file()?;
        let Some(camera) = file.cameras.get_mut(name) else {
            return Ok(false);
        };
        camera.paused = paused.unwrap_or(camera.paused);
        camera.keep_image = keep_image.unwrap_or(camera.keep_image);
        self.store(&file)?;
        self.set_with_image(name, keep_image);
        Ok(true)
    }

    /// Switches at once whether the latest image of a camera is kept.
    pub(super) fn set_with_image(&self, name: &str, keep_image: Option<bool>) {
        let mut with_image = self.with_image.write();
        match keep_image {
            Some(true) => drop(with_image.insert(name.to_owned())),
            Some(false) => drop(with_image.remove(name)),
            None => {}
        }
    }

    /// Returns the names in a list of cameras of the settings, possibly also of earlier settings.
    pub(super) fn listed(&self, list: &str) -> Result<BTreeSet<String>, ConfigError> {
        self.folder.read(list)
    }
}
