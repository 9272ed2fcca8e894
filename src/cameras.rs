//! The cameras of `lookdown run` that are added over HTTP: a file in the state folder, with each
//! password in a file of its own, and the states of all cameras.
//!
//! The switches of cameras: whether frames are read, and whether the latest image is kept.

mod state_folder;
#[cfg(test)]
pub(crate) mod tests;

use std::{
    collections::{BTreeMap, BTreeSet},
    path::PathBuf,
    sync::Arc,
    time::Duration,
};

use lookdown_common::{ConfigError, OwnCameras, Secret};
use lookdown_watch::{
    Camera, CameraEntry, CameraState, Frame, Location, MAX_CAMERAS, Metrics, Viewers, first_frame,
};
use parking_lot::RwLock;
use secrecy::ExposeSecret;
use tokio::sync::Semaphore;

pub use state_folder::{CameraError, Stored, StoredCamera};

pub(crate) use state_folder::StateFolder;

use self::state_folder::{CameraFile, FILE, TEST, check_name, entry};

/// Longest wait for the frame of a test.
const TEST_TIMEOUT: Duration = Duration::from_secs(15);
/// The problem of a camera beyond the limit.
const TOO_MANY: &str = "there are 256 cameras: delete one first";
/// Most cameras that are tested at a time: each may start a decoder.
const MAX_TESTS: usize = 4;

/// The files with the names of the cameras of the settings that are paused, and whose latest image
/// is kept, in the state folder.
const PAUSED: &str = "paused.json";
const WITH_IMAGE: &str = "images.json";

/// The cameras of this process.
pub struct Cameras {
    folder: StateFolder,
    /// The cameras of the settings file and the command line.
    configured: RwLock<BTreeMap<String, Camera>>,
    /// The values of keys that a stored camera does not have.
    defaults: RwLock<CameraEntry>,
    /// The stored cameras that cannot be watched, with the reasons.
    problems: RwLock<BTreeMap<String, String>>,
    /// The cameras whose latest image is kept.
    with_image: RwLock<BTreeSet<String>>,
    /// The permits of tests.
    tests: Semaphore,
    /// The names of all cameras.
    pub(crate) own: OwnCameras,
    metrics: Arc<Metrics>,
}

impl Cameras {
    /// Creates the cameras of a state folder, which may be missing.
    pub fn new(folder: PathBuf, own: OwnCameras, metrics: Arc<Metrics>) -> Self {
        Self {
            folder: StateFolder::new(folder),
            configured: RwLock::default(),
            defaults: RwLock::default(),
            problems: RwLock::default(),
            with_image: RwLock::default(),
            tests: Semaphore::new(MAX_TESTS),
            own,
            metrics,
        }
    }

    /// Returns the viewers of the cameras.
    pub fn viewers(&self) -> &Arc<Viewers> {
        self.metrics.viewers()
    }

    /// Returns the states of the cameras that are watched: those of the settings and these stored
    /// ones. A camera that was deleted may still end.
    pub fn states(&self, stored: &Stored) -> Vec<CameraState> {
        let configured = self.configured.read();
        let mut states = self.metrics.states();
        states.retain(|state| {
            stored.contains_key(&state.name) || configured.contains_key(&state.name)
        });
        states
    }

    /// Returns the stored cameras that cannot be watched, with the reasons.
    pub fn problems(&self) -> BTreeMap<String, String> {
        self.problems.read().clone()
    }

    /// Returns true while frames of the camera are read.
    pub fn is_watched(&self, name: &str) -> bool {
        self.metrics.states().iter().any(|state| state.name == name)
    }

    /// Adds the stored cameras that are not paused to those of the settings, which have precedence,
    /// and removes those of the settings that are paused. `defaults` has the values of keys that a
    /// stored camera does not have. A stored camera that cannot be watched gets a problem.
    ///
    /// # Errors
    /// [`ConfigError`] if a file in the state folder is none of this program. Blocks.
    pub fn add_to(
        &self,
        cameras: &mut Vec<Camera>,
        defaults: &CameraEntry,
    ) -> Result<(), ConfigError> {
        self.defaults.write().clone_from(defaults);
        // No URL is read with a password that another request has just changed.
        let _locked = self.folder.lock_to_read();
        let named = cameras
            .iter()
            .map(|camera| (camera.name.clone(), camera.clone()));
        let configured: BTreeMap<_, _> = named.collect();
        let paused = self.listed(PAUSED)?;
        let mut with_image = self.listed(WITH_IMAGE)?;
        with_image.retain(|name| configured.contains_key(name));
        let file = self.file()?;
        let stored = file.cameras.iter().filter(|(_, camera)| camera.keep_image);
        with_image.extend(stored.map(|(name, _)| name.clone()));
        *self.with_image.write() = with_image;
        let stored = file.cameras.iter();
        let mut own: BTreeMap<_, _> = stored
            .map(|(name, camera)| (name.clone(), camera.paused))
            .collect();
        for name in configured.keys() {
            own.insert(name.clone(), paused.contains(name));
        }
        self.own.set(own);
        cameras.retain(|camera| !paused.contains(&camera.name));
        let malformed = |name| {
            (
                name,
                "it is not a camera: delete it, or replace it".to_owned(),
            )
        };
        let mut problems: BTreeMap<_, _> = file
            .invalid
            .into_iter()
            .map(|(name, _)| malformed(name))
            .collect();
        let stored = file.cameras.into_iter();
        for (name, camera) in stored.filter(|(name, _)| !configured.contains_key(name)) {
            match self.loaded(&name, &camera) {
                Ok(_) if camera.paused => {}
                Ok(camera) if cameras.len() < MAX_CAMERAS => cameras.push(camera),
                Ok(_) => drop(problems.insert(name, TOO_MANY.to_owned())),
                Err(problem) => drop(problems.insert(name, problem.to_string())),
            }
        }
        *self.configured.write() = configured;
        let mut known = self.problems.write();
        for (camera, problem) in &problems {
            if known.get(camera) != Some(problem) {
                tracing::warn!(camera, "the camera is not watched: {problem}");
            }
        }
        *known = problems;
        Ok(())
    }

    /// Returns the stored cameras by name. Blocks.
    ///
    /// # Errors
    /// [`ConfigError`].
    pub fn stored(&self) -> Result<Stored, ConfigError> {
        Ok(self.file()?.cameras)
    }

    /// Reads the file of the cameras.
    fn file(&self) -> Result<CameraFile, ConfigError> {
        CameraFile::read(&self.folder)
    }

    /// Creates or replaces a camera, and returns true if it is new. Without a URL, the stored one
    /// stays; without a password, that of the same user at the same host. Blocks.
    ///
    /// # Errors
    /// [`CameraError`].
    pub fn put(
        &self,
        name: &str,
        mut camera: StoredCamera,
        password: Option<&Secret>,
    ) -> Result<bool, CameraError> {
        let _locked = self.folder.lock()?;
        let mut file = self.file()?;
        let before = file.cameras.get(name);
        if let (true, Some(before)) = (camera.url.is_empty(), before) {
            camera.url.clone_from(&before.url);
        }
        check_name(name)?;
        let configured = self.configured.read();
        if configured.contains_key(name) {
            return Err(CameraError::Configured(name.to_owned()));
        }
        self.checked(name, &camera)?;
        if before.is_none() && file.cameras.len() + configured.len() >= MAX_CAMERAS {
            return Err(ConfigError::problem("name", &TOO_MANY).into());
        }
        let is_same_login = before.is_some_and(|before| {
            before.user == camera.user && origin(&before.url) == origin(&camera.url)
        });
        file.invalid.remove(name);
        let keep_image = camera.keep_image;
        let is_new = file.cameras.insert(name.to_owned(), camera).is_none();
        // No moment has a URL with the password of another one, however the writing ends.
        let path = self.folder.password(name);
        let [new, old] =
            ["new~", "old~"].map(|ending| self.folder.password(&format!("{name}{ending}")));
        for unfinished in [&new, &old] {
            StateFolder::remove(unfinished)?;
        }
        if let Some(password) = password {
            self.folder.write(&new, password.expose_secret())?;
        }
        if !is_same_login {
            StateFolder::rename(&path, &old)?;
        }
        if let Err(error) = self.store(&file) {
            StateFolder::rename(&old, &path)?;
            StateFolder::remove(&new)?;
            return Err(error);
        }
        StateFolder::rename(&new, &path)?;
        StateFolder::remove(&old)?;
        self.set_with_image(name, Some(keep_image));
        Ok(is_new)
    }

    /// Deletes a camera with its password. Returns false if there is none. Blocks.
    ///
    /// # Errors
    /// [`CameraError`].
    pub fn delete(&self, name: &str) -> Result<bool, CameraError> {
        let _locked = self.folder.lock()?;
        let mut file = self.file()?;
        if file.cameras.remove(name).is_none() && file.invalid.remove(name).is_none() {
            if self.configured.read().contains_key(name) {
                return Err(CameraError::Configured(name.to_owned()));
            }
            return Ok(false);
        }
        self.store(&file)?;
        // The others are those of a change that did not end.
        for ending in ["", "new~", "new~.part", "old~"] {
            StateFolder::remove(&self.folder.password(&format!("{name}{ending}")))?;
        }
        Ok(true)
    }

    /// Returns the first frame of a camera that is not stored.
    ///
    /// # Errors
    /// [`CameraError`].
    pub async fn test(
        &self,
        camera: &StoredCamera,
        password: Option<Secret>,
    ) -> Result<Frame, CameraError> {
        let mut checked = self.checked(TEST, camera)?;
        if let (Some(credentials), Some(password)) = (&mut checked.credentials, password) {
            credentials.password = password;
        }
        self.first_frame(&checked).await
    }

    async fn first_frame(&self, camera: &Camera) -> Result<Frame, CameraError> {
        let permit = self.tests.try_acquire();
        let _permit = permit.map_err(|_| CameraError::Busy)?;
        Ok(first_frame(camera, TEST_TIMEOUT).await?)
    }

    /// Returns the camera with this name, paused or not. Blocks: reads the file of its password.
    ///
    /// # Errors
    /// [`ConfigError`].
    pub fn get(&self, name: &str) -> Result<Option<Camera>, ConfigError> {
        let configured = self.configured.read().get(name).cloned();
        if configured.is_some() {
            return Ok(configured);
        }
        let _locked = self.folder.lock_to_read();
        let stored = self.stored()?;
        let loaded = stored.get(name).map(|camera| self.loaded(name, camera));
        loaded.transpose()
    }

    /// Returns the present frame of a camera.
    ///
    /// # Errors
    /// [`CameraError`].
    pub async fn frame(&self, camera: &Camera) -> Result<Frame, CameraError> {
        if let Location::Http(_) | Location::Rtsp(_) = camera.location {
            return self.first_frame(camera).await;
        }
        let problem = "it is not a URL, so its frames cannot be read twice: set results.images to \
                       keep its latest image";
        Err(ConfigError::problem("url", &problem).into())
    }

    /// Returns the stored camera with its password.
    fn loaded(&self, name: &str, camera: &StoredCamera) -> Result<Camera, ConfigError> {
        check_name(name)?;
        let mut loaded = self.checked(name, camera)?;
        if let (Some(_), Some(credentials)) = (&camera.user, &mut loaded.credentials) {
            credentials.password = self.folder.read_password(name)?;
        }
        Ok(loaded)
    }

    /// Checks a camera, without its password: only URLs of cameras are permitted, without
    /// credentials in them.
    fn checked(&self, name: &str, camera: &StoredCamera) -> Result<Camera, ConfigError> {
        let is_url = camera.url.contains("://");
        let location = is_url.then(|| Location::parse(&camera.url));
        let problem = match location {
            Some(Ok((Location::Http(_) | Location::Rtsp(_), None))) => None,
            Some(Ok((_, Some(_)))) => {
                Some("it has a user name: give user and password as fields".to_owned())
            }
            Some(Err(error)) => Some(error.to_string()),
            _ => Some("it is not the URL of a camera: use rtsp, rtsps, http or https".to_owned()),
        };
        if let Some(problem) = problem {
            return Err(ConfigError::problem("url", &problem));
        }
        let mut entry = entry(name, camera).or(&self.defaults.read());
        if camera.user.is_some() {
            entry.password_file = None;
        }
        entry.check("")
    }

    fn store(&self, file: &CameraFile) -> Result<(), CameraError> {
        let content = serde_json::to_string_pretty(file).unwrap_or_default();
        self.folder.write(&self.folder.file(FILE), &content)
    }
}

/// Returns the scheme, host and port of a URL.
fn origin(url: &str) -> Option<(String, String, Option<u16>)> {
    let url = url::Url::parse(url).ok()?;
    let host = url.host_str()?.to_owned();
    Some((url.scheme().to_owned(), host, url.port_or_known_default()))
}

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
    fn set_with_image(&self, name: &str, keep_image: Option<bool>) {
        let mut with_image = self.with_image.write();
        match keep_image {
            Some(true) => drop(with_image.insert(name.to_owned())),
            Some(false) => drop(with_image.remove(name)),
            None => {}
        }
    }

    /// Returns the names in a list of cameras of the settings, possibly also of earlier settings.
    fn listed(&self, list: &str) -> Result<BTreeSet<String>, ConfigError> {
        self.folder.read(list)
    }
}
