//! The cameras and the server that receives their frames.

mod entry;

use lookdown_common::{ConfigError, ServerEntry, ServerOptions};

use crate::Camera;

pub use entry::CameraEntry;

/// Most cameras of a process.
pub const MAX_CAMERAS: usize = 256;

/// The cameras to watch, and the server that receives their frames.
#[derive(Debug, Clone, PartialEq)]
pub struct WatchOptions {
    /// The server.
    pub server: ServerOptions,
    /// The cameras. Their names differ.
    pub cameras: Vec<Camera>,
}

impl WatchOptions {
    /// Checks that the names of the cameras differ, and that there are at most 256.
    ///
    /// # Errors
    /// [`ConfigError`].
    pub fn new(server: ServerOptions, cameras: Vec<Camera>) -> Result<Self, ConfigError> {
        if cameras.len() > MAX_CAMERAS {
            let remedy = "cameras are too many: start another process for those beyond 256";
            return Err(ConfigError::value("cameras", &cameras.len(), remedy));
        }
        let mut readers = 0;
        for (index, camera) in cameras.iter().enumerate() {
            if cameras[..index]
                .iter()
                .any(|other| other.name == camera.name)
            {
                let field = format!("cameras[{index}].name");
                let remedy = "is the name of an earlier camera: give each camera its own";
                return Err(ConfigError::value(&field, &camera.name, remedy));
            }
            readers += usize::from(camera.location == crate::Location::StandardInput);
            if readers > 1 {
                let field = format!("cameras[{index}].url");
                let remedy = "is read by an earlier camera: only one can read standard input";
                return Err(ConfigError::value(&field, &"-", remedy));
            }
        }
        Ok(Self { server, cameras })
    }
}

/// The cameras as they are written in a file or on the command line.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct WatchEntry {
    /// The server that receives the frames.
    pub server: ServerEntry,
    /// The values of keys that a camera does not have.
    pub defaults: CameraEntry,
    /// The cameras.
    pub cameras: Vec<CameraEntry>,
}

impl WatchEntry {
    /// Checks the cameras and reads the files that they name. Paths are relative to the current
    /// folder. Blocks.
    ///
    /// # Errors
    /// [`ConfigError`].
    pub fn check(self) -> Result<WatchOptions, ConfigError> {
        let server = self.server.check()?;
        let cameras = self.cameras.into_iter().enumerate();
        let cameras = cameras.map(|(index, camera)| {
            camera
                .or(&self.defaults)
                .check(&format!("cameras[{index}]."))
        });
        WatchOptions::new(server, cameras.collect::<Result<_, _>>()?)
    }
}
