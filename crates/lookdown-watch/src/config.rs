//! The cameras and the server that receives their frames.

mod entry;
mod file;

pub use entry::CameraEntry;
pub use file::WatchEntry;

use lookdown_common::{ConfigError, ServerOptions};

use crate::Camera;

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
