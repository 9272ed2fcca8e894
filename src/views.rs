//! Straight live views of cameras: directions, panoramas and a person that is followed, rendered
//! from the newest frame. They are stored in the state folder, by the name of the camera.

mod follower;
mod live;
mod view;

use std::{
    collections::BTreeMap,
    fmt,
    path::PathBuf,
    sync::{Arc, OnceLock},
    time::{Duration, Instant},
};

use lookdown_common::{ConfigError, StoredFile, plain_name};
use lookdown_detect::pipeline::{DetectedFrame, JobImage};
use lookdown_imaging::{annotate::Concealment, decode::DecodeLimits};
use lookdown_watch::{Viewers, Viewing};
use parking_lot::RwLock;
use serde::{Deserialize, Serialize};
use tokio::sync::Semaphore;

use crate::cameras::{CameraError, StateFolder};

pub use live::{LiveCamera, LiveFrame, Rendering, ViewError};
pub use view::{View, ViewKind};

/// The file of the views in the state folder.
const FILE: &str = "views.json";
/// Most cameras with views. Each keeps its newest frame in memory.
const MAX_CAMERAS: usize = 64;
/// Most views of a camera.
const MAX_VIEWS: usize = 16;
/// The time after the last preview for which the frames of a camera without views are kept.
const PREVIEW: Duration = Duration::from_mins(1);

/// Views by name.
pub type StoredViews = BTreeMap<String, View>;

/// The views of all cameras.
pub struct Views {
    folder: StateFolder,
    cameras: RwLock<BTreeMap<String, CameraViews>>,
    /// The permits of rendering.
    workers: Arc<Semaphore>,
    limits: DecodeLimits,
    concealment: Option<Concealment>,
    viewers: OnceLock<Arc<Viewers>>,
}

/// The views of a camera.
struct CameraViews {
    views: StoredViews,
    live: Arc<LiveCamera>,
    /// The time of the last preview.
    previewed: Option<Instant>,
}

/// The content of the file.
#[derive(Default, Serialize, Deserialize)]
struct ViewFile {
    version: Option<u8>,
    cameras: BTreeMap<String, StoredViews>,
}

impl Views {
    /// Creates the views of a state folder, which may be missing. `limits` bound
    /// the frames, in which people are concealed by `concealment`.
    pub fn new(folder: PathBuf, limits: DecodeLimits, concealment: Option<Concealment>) -> Self {
        let threads = std::thread::available_parallelism().map_or(1, usize::from);
        Self {
            folder: StateFolder::new(folder),
            cameras: RwLock::default(),
            // The other half of the processors is left to detection.
            workers: Arc::new(Semaphore::new(threads.div_ceil(2))),
            limits,
            concealment,
            viewers: OnceLock::new(),
        }
    }

    /// Reads the stored views. Blocks.
    ///
    /// # Errors
    /// [`ConfigError`] if the file is none of this program.
    pub fn load(&self) -> Result<(), ConfigError> {
        let file = self.file()?;
        let mut cameras = self.cameras.write();
        for (camera, views) in file.cameras.into_iter().take(MAX_CAMERAS) {
            let views = views.into_iter().filter(|(_, view)| view.check().is_ok());
            let views = views.take(MAX_VIEWS).collect();
            cameras.insert(
                camera,
                CameraViews {
                    views,
                    ..self.without_views()
                },
            );
        }
        Ok(())
    }

    /// Returns the views of a camera.
    pub fn list(&self, camera: &str) -> StoredViews {
        let cameras = self.cameras.read();
        let known = cameras.get(camera);
        known.map_or_else(StoredViews::new, |known| known.views.clone())
    }

    /// Returns the newest frame of a camera with views.
    pub fn live(&self, camera: &str) -> Option<Arc<LiveCamera>> {
        let cameras = self.cameras.read();
        Some(Arc::clone(&cameras.get(camera)?.live))
    }

    /// Keeps the newest frame of a camera for a minute, for a view that is not stored.
    ///
    /// # Errors
    /// [`CameraError`] if too many cameras have views.
    pub fn preview(&self, camera: &str) -> Result<Arc<LiveCamera>, CameraError> {
        let mut cameras = self.cameras.write();
        let known = self.entry(&mut cameras, camera)?;
        known.previewed = Some(Instant::now());
        Ok(Arc::clone(&known.live))
    }

    /// Creates or replaces a checked view, and returns true if it is new. Blocks.
    ///
    /// # Errors
    /// [`CameraError`].
    pub fn put(&self, camera: &str, name: &str, view: View) -> Result<bool, CameraError> {
        if !plain_name::is_plain(name) {
            let remedy = "is not a name of 1 to 64 of a-z, 0-9, '_' and '-'";
            return Err(ConfigError::value("name", name, remedy).into());
        }
        let mut is_new = false;
        self.change(camera, |views| {
            is_new = !views.contains_key(name);
            if is_new && views.len() == MAX_VIEWS {
                let problem = "the camera has 16 views: delete one first";
                return Err(ConfigError::problem("name", &problem).into());
            }
            views.insert(name.to_owned(), view);
            Ok(())
        })?;
        Ok(is_new)
    }

    /// Deletes a view. Returns false if there is none. Blocks.
    ///
    /// # Errors
    /// [`CameraError`].
    pub fn delete(&self, camera: &str, name: &str) -> Result<bool, CameraError> {
        if !self.list(camera).contains_key(name) {
            return Ok(false);
        }
        self.change(camera, |views| {
            views.remove(name);
            Ok(())
        })?;
        Ok(true)
    }

    /// Deletes all views of a camera, with its frame. Blocks.
    ///
    /// # Errors
    /// [`CameraError`].
    pub fn remove(&self, camera: &str) -> Result<(), CameraError> {
        self.forget(camera);
        if self.list(camera).is_empty() {
            return Ok(());
        }
        self.change(camera, |views| {
            views.clear();
            Ok(())
        })
    }

    /// Drops the newest frame of a camera.
    pub fn forget(&self, camera: &str) {
        if let Some(live) = self.live(camera) {
            live.forget();
        }
    }

    /// Notes a report and its frame, for a camera with views. `image` is the frame as it was sent.
    pub(crate) fn detected(&self, image: &JobImage, detected: &DetectedFrame) {
        if let Some(live) = self.wanted(&detected.report.camera) {
            live.detected(image, detected, self.concealment);
        }
    }

    /// Shows all frames of the cameras of this process that have viewers.
    pub fn show_frames(self: &Arc<Self>, viewers: &Arc<Viewers>) {
        let views = Arc::downgrade(self);
        viewers.show_with(move |camera, frame| {
            let live = views.upgrade().and_then(|views| views.wanted(camera));
            if let Some(live) = live {
                live.offer(frame.image.clone(), frame.captured_at);
            }
        });
        let _ = self.viewers.set(Arc::clone(viewers));
    }

    /// Adds a viewer of a camera, so that it delivers all of its frames. Where people are concealed
    /// only frames with a report are shown, because others may show people elsewhere.
    pub fn add_viewer(&self, camera: &str) -> Option<Viewing> {
        let viewers = self.viewers.get().filter(|_| self.concealment.is_none())?;
        Some(viewers.add(camera))
    }

    /// Returns the newest frame of a camera that has views or a preview.
    fn wanted(&self, camera: &str) -> Option<Arc<LiveCamera>> {
        let cameras = self.cameras.read();
        let known = cameras.get(camera).filter(|known| known.is_wanted())?;
        Some(Arc::clone(&known.live))
    }

    fn without_views(&self) -> CameraViews {
        CameraViews {
            views: StoredViews::new(),
            live: Arc::new(LiveCamera::new(Arc::clone(&self.workers), self.limits)),
            previewed: None,
        }
    }

    fn entry<'a>(
        &self,
        cameras: &'a mut BTreeMap<String, CameraViews>,
        camera: &str,
    ) -> Result<&'a mut CameraViews, CameraError> {
        if !cameras.contains_key(camera) {
            cameras.retain(|_, known| known.is_wanted());
            if cameras.len() == MAX_CAMERAS {
                let problem = "64 cameras have views: delete those of another one first";
                return Err(ConfigError::problem("camera", &problem).into());
            }
        }
        let entry = cameras.entry(camera.to_owned());
        Ok(entry.or_insert_with(|| self.without_views()))
    }

    /// Reads the file, which may be missing.
    fn file(&self) -> Result<ViewFile, ConfigError> {
        let file: ViewFile = self.folder.read(FILE)?;
        if let Some(version) = file.version {
            let checked = StoredFile::Views.check(&version.to_string());
            checked.map_err(|problem| self.folder.refused(FILE, &problem))?;
        }
        Ok(file)
    }

    /// Changes the views of a camera in the file, then in memory.
    fn change(
        &self,
        camera: &str,
        change: impl FnOnce(&mut StoredViews) -> Result<(), CameraError>,
    ) -> Result<(), CameraError> {
        let _locked = self.folder.lock()?;
        let mut file = self.file()?;
        let views = file.cameras.entry(camera.to_owned()).or_default();
        change(views)?;
        let views = views.clone();
        self.entry(&mut self.cameras.write(), camera)?;
        file.version = Some(StoredFile::Views.version());
        file.cameras.retain(|_, views| !views.is_empty());
        let content = serde_json::to_string_pretty(&file).unwrap_or_default();
        self.folder.write(&self.folder.file(FILE), &content)?;
        let mut cameras = self.cameras.write();
        let known = self.entry(&mut cameras, camera)?;
        known.views = views;
        if !known.is_wanted() {
            known.live.forget();
        }
        Ok(())
    }
}

impl CameraViews {
    fn is_wanted(&self) -> bool {
        let is_previewed = || self.previewed.is_some_and(|at| at.elapsed() < PREVIEW);
        !self.views.is_empty() || is_previewed()
    }
}

impl fmt::Debug for Views {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("Views")
    }
}
