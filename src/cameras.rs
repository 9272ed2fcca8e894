//! The cameras of `lookdown run` that are added over HTTP: a file in the state folder, with each
//! password in a file of its own, and the states of all cameras.

mod error;
mod state_folder;

use std::{
    collections::{BTreeMap, BTreeSet},
    path::PathBuf,
    sync::Arc,
    time::Duration,
};

use lookdown_common::{ConfigError, OwnCameras, Secret, StoredFile, plain_name};
use lookdown_watch::{CameraEntry, CameraState, Frame, Location, Metrics, first_frame};
use parking_lot::{Mutex, RwLock};
use secrecy::ExposeSecret;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};
use state_folder::StateFolder;

pub use error::CameraError;

/// Longest wait for the frame of a test.
const TEST_TIMEOUT: Duration = Duration::from_secs(15);
/// The name in the path of a test, which no camera has.
const TEST: &str = "test";
/// Most stored cameras.
const MAX_CAMERAS: usize = 256;
/// The file of the cameras in the state folder.
const FILE: &str = "cameras.json";
/// The file with the names of the cameras of the settings that are paused, in the state folder.
const PAUSED: &str = "paused.json";

/// A camera as it is stored, without its password.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StoredCamera {
    /// The URL of the source.
    pub url: String,
    /// The user name.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub user: Option<String>,
    /// The interval between two frames.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub every: Option<String>,
    /// The ID of the calibration.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub calibration: Option<String>,
    /// The profile.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub profile: Option<String>,
    /// True if no frames are read.
    #[serde(default)]
    pub paused: bool,
}

impl StoredCamera {
    /// Returns the source without its query, which may hold a token.
    #[must_use]
    pub fn shown_source(&self) -> String {
        shown_source(&self.url)
    }
}

/// Returns a source without its credentials and its query, which may hold a token.
fn shown_source(url: &str) -> String {
    let location = Location::parse(url);
    location.map_or_else(|_| String::new(), |(location, _)| location.to_string())
}

/// Stored cameras by name.
pub type Stored = BTreeMap<String, StoredCamera>;

/// The content of the file of the cameras.
#[derive(Serialize)]
struct CameraFile<'a> {
    version: u8,
    #[serde(flatten)]
    cameras: &'a Stored,
}

/// The cameras of this process.
pub struct Cameras {
    folder: StateFolder,
    /// Locked while the file is changed.
    changing: Mutex<()>,
    /// The cameras of the settings file and the command line.
    configured: RwLock<BTreeMap<String, CameraEntry>>,
    /// The names of all cameras.
    own: OwnCameras,
    metrics: Arc<Metrics>,
}

impl Cameras {
    /// Creates the cameras of a state folder, which may be missing.
    #[must_use]
    pub fn new(folder: PathBuf, own: OwnCameras, metrics: Arc<Metrics>) -> Self {
        Self {
            folder: StateFolder::new(folder),
            changing: Mutex::default(),
            configured: RwLock::default(),
            own,
            metrics,
        }
    }

    /// Returns the names of all cameras.
    pub(crate) fn own(&self) -> &OwnCameras {
        &self.own
    }

    /// Returns the states of the cameras that are watched: those of the settings and these stored
    /// ones. A camera that was deleted may still end.
    #[must_use]
    pub fn states(&self, stored: &Stored) -> Vec<CameraState> {
        let configured = self.configured.read();
        let mut states = self.metrics.states();
        states.retain(|state| {
            stored.contains_key(&state.name) || configured.contains_key(&state.name)
        });
        states
    }

    /// Returns the paused cameras of the settings with their sources. Blocks.
    ///
    /// # Errors
    /// [`ConfigError`].
    pub fn paused_of_settings(&self) -> Result<BTreeMap<String, String>, ConfigError> {
        let paused = self.paused()?;
        let configured = self.configured.read();
        let of_settings = configured.iter().filter(|(name, _)| paused.contains(*name));
        let with_source = of_settings.map(|(name, entry)| {
            let url = entry.url.as_deref().unwrap_or_default();
            (name.clone(), shown_source(url))
        });
        Ok(with_source.collect())
    }

    /// Returns all cameras by name, and whether their frames are read. Blocks.
    ///
    /// # Errors
    /// [`ConfigError`].
    pub fn detection(&self) -> Result<BTreeMap<String, bool>, ConfigError> {
        let stored = self.stored()?;
        let mut states: BTreeMap<_, _> = stored
            .into_iter()
            .map(|(name, camera)| (name, !camera.paused))
            .collect();
        let paused = self.paused()?;
        for name in self.configured.read().keys() {
            states.insert(name.clone(), !paused.contains(name));
        }
        Ok(states)
    }

    /// Pauses a camera or resumes it; it stays so after a restart. Returns false for an unknown
    /// camera. Blocks.
    ///
    /// # Errors
    /// [`CameraError`].
    pub fn set_detection(&self, name: &str, is_on: bool) -> Result<bool, CameraError> {
        let _changing = self.changing.lock();
        let configured: BTreeSet<_> = self.configured.read().keys().cloned().collect();
        if configured.contains(name) {
            let mut paused = self.paused()?;
            // Names that the settings no longer have are dropped, so that the file stays small.
            paused.retain(|paused| configured.contains(paused) && paused != name);
            if !is_on {
                paused.insert(name.to_owned());
            }
            let content = serde_json::to_string(&paused).unwrap_or_default();
            self.folder.write(&self.folder.file(PAUSED), &content)?;
            return Ok(true);
        }
        let mut stored = self.stored()?;
        let Some(camera) = stored.get_mut(name) else {
            return Ok(false);
        };
        camera.paused = !is_on;
        self.store(&stored)?;
        Ok(true)
    }

    /// Adds the stored cameras that are not paused to those of the settings, which have precedence,
    /// and removes those of the settings that are paused.
    ///
    /// # Errors
    /// [`ConfigError`] if the file of the cameras cannot be used. Blocks.
    pub fn add_to(&self, cameras: &mut Vec<CameraEntry>) -> Result<(), ConfigError> {
        let named = cameras.iter().filter_map(|camera| {
            let name = camera.name.clone().or_else(|| camera.calibration.clone())?;
            Some((name, camera.clone()))
        });
        let configured: BTreeMap<_, _> = named.collect();
        let paused = self.paused()?;
        cameras.retain(|camera| {
            let name = camera.name.as_ref().or(camera.calibration.as_ref());
            name.is_none_or(|name| !paused.contains(name))
        });
        let stored = self.stored()?;
        self.own
            .set(configured.keys().chain(stored.keys()).cloned().collect());
        for (name, camera) in stored {
            if !camera.paused && !configured.contains_key(&name) {
                cameras.push(self.entry(&name, &camera));
            }
        }
        *self.configured.write() = configured;
        Ok(())
    }

    /// Returns the stored cameras by name. Blocks.
    ///
    /// # Errors
    /// [`ConfigError`].
    pub fn stored(&self) -> Result<Stored, ConfigError> {
        let mut cameras: Map<String, Value> = self.folder.read(FILE)?;
        if let Some(version) = cameras.remove(StoredFile::KEY) {
            let checked = StoredFile::Cameras.check(&version.to_string());
            checked.map_err(|problem| self.folder.refused(FILE, &problem))?;
        }
        Stored::deserialize(Value::Object(cameras))
            .map_err(|error| self.folder.malformed(FILE, &error))
    }

    /// Returns the names of the paused cameras of the settings, possibly also of earlier settings.
    fn paused(&self) -> Result<BTreeSet<String>, ConfigError> {
        self.folder.read(PAUSED)
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
        let _changing = self.changing.lock();
        let mut stored = self.stored()?;
        let before = stored.get(name);
        if let (true, Some(before)) = (camera.url.is_empty(), before) {
            camera.url.clone_from(&before.url);
        }
        self.check(name, &camera)?;
        if before.is_none() && stored.len() >= MAX_CAMERAS {
            let problem = "256 cameras are stored: delete one first";
            return Err(ConfigError::problem("name", &problem).into());
        }
        let is_same_login = before.is_some_and(|before| {
            before.user == camera.user && origin(&before.url) == origin(&camera.url)
        });
        match password {
            Some(password) => self
                .folder
                .write(&self.folder.password(name), password.expose_secret())?,
            None if !is_same_login => StateFolder::remove(&self.folder.password(name))?,
            None => {}
        }
        let is_new = stored.insert(name.to_owned(), camera).is_none();
        self.store(&stored)?;
        Ok(is_new)
    }

    /// Deletes a camera with its password. Returns false if there is none. Blocks.
    ///
    /// # Errors
    /// [`CameraError`].
    pub fn delete(&self, name: &str) -> Result<bool, CameraError> {
        let _changing = self.changing.lock();
        let mut stored = self.stored()?;
        if stored.remove(name).is_none() {
            if self.configured.read().contains_key(name) {
                return Err(CameraError::Configured(name.to_owned()));
            }
            return Ok(false);
        }
        self.store(&stored)?;
        StateFolder::remove(&self.folder.password(name))?;
        Ok(true)
    }

    /// Returns the first frame of a camera that is not stored.
    ///
    /// # Errors
    /// [`CameraError`].
    pub async fn test(
        camera: &StoredCamera,
        password: Option<Secret>,
    ) -> Result<Frame, CameraError> {
        let mut checked = checked("test", camera)?;
        if let (Some(credentials), Some(password)) = (&mut checked.credentials, password) {
            credentials.password = password;
        }
        Ok(first_frame(&checked, TEST_TIMEOUT).await?)
    }

    /// Returns the camera with this name, paused or not. Blocks: reads the file of its password.
    ///
    /// # Errors
    /// [`ConfigError`].
    pub fn get(&self, name: &str) -> Result<Option<lookdown_watch::Camera>, ConfigError> {
        let configured = self.configured.read().get(name).cloned();
        let entry = if configured.is_some() {
            configured
        } else {
            let stored = self.stored()?;
            stored.get(name).map(|camera| self.entry(name, camera))
        };
        entry.map(|entry| entry.check("")).transpose()
    }

    /// Returns the present frame of a camera.
    ///
    /// # Errors
    /// [`CameraError`].
    pub async fn frame(camera: &lookdown_watch::Camera) -> Result<Frame, CameraError> {
        if let Location::Http(_) | Location::Rtsp(_) = camera.location {
            return Ok(first_frame(camera, TEST_TIMEOUT).await?);
        }
        let problem = "it is not a URL, so its frames cannot be read twice: set results.images to \
                       keep its latest image";
        Err(ConfigError::problem("url", &problem).into())
    }

    fn check(&self, name: &str, camera: &StoredCamera) -> Result<(), CameraError> {
        if !plain_name::is_plain(name) || [TEST, StoredFile::KEY].contains(&name) {
            let remedy =
                "is not a name of 1 to 64 of a-z, 0-9, '_' and '-', and not test or version";
            return Err(ConfigError::value("name", name, remedy).into());
        }
        if self.configured.read().contains_key(name) {
            return Err(CameraError::Configured(name.to_owned()));
        }
        checked(name, camera).map(drop)
    }

    /// Returns the entry of a stored camera with the file of its password.
    fn entry(&self, name: &str, camera: &StoredCamera) -> CameraEntry {
        let password = self.folder.password(name);
        CameraEntry {
            password_file: (camera.user.is_some() && password.exists()).then_some(password),
            ..entry(name, camera)
        }
    }

    fn store(&self, stored: &Stored) -> Result<(), CameraError> {
        let content = serde_json::to_string_pretty(&CameraFile {
            version: StoredFile::Cameras.version(),
            cameras: stored,
        });
        self.folder
            .write(&self.folder.file(FILE), &content.unwrap_or_default())
    }
}

fn entry(name: &str, camera: &StoredCamera) -> CameraEntry {
    CameraEntry {
        name: Some(name.to_owned()),
        url: Some(camera.url.clone()),
        user: camera.user.clone(),
        every: camera.every.clone(),
        calibration: camera.calibration.clone(),
        profile: camera.profile.clone(),
        ..CameraEntry::default()
    }
}

/// Checks a camera: only URLs of cameras are permitted, without credentials in them.
fn checked(name: &str, camera: &StoredCamera) -> Result<lookdown_watch::Camera, CameraError> {
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
        return Err(ConfigError::problem("url", &problem).into());
    }
    Ok(entry(name, camera).check("")?)
}

/// Returns the scheme, host and port of a URL.
fn origin(url: &str) -> Option<(String, String, Option<u16>)> {
    let url = url::Url::parse(url).ok()?;
    let host = url.host_str()?.to_owned();
    Some((url.scheme().to_owned(), host, url.port_or_known_default()))
}

#[cfg(test)]
pub(crate) mod tests;
