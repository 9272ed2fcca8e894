//! The cameras as they are written, and their checks.

use lookdown_common::{ConfigError, ServerEntry};

use super::{CameraEntry, WatchOptions};

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
