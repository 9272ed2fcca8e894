//! The file `cameras.toml`, and the small files that it names.

use std::path::Path;

use lookdown_common::{ConfigError, ServerEntry, parse_toml, read_file};
use serde::Deserialize;

use super::{CameraEntry, WatchOptions};

/// The file as it is written.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct WatchFile {
    #[serde(default)]
    server: ServerEntry,
    #[serde(default)]
    defaults: CameraEntry,
    #[serde(default)]
    cameras: Vec<CameraEntry>,
}

/// Reads and checks the file and the files that it names. `server` has precedence over the server
/// of the file. Paths are relative to the current folder. Blocks.
///
/// # Errors
/// [`ConfigError`].
pub fn load(path: &Path, server: &ServerEntry) -> Result<WatchOptions, ConfigError> {
    let text = read_file("cameras", path)?;
    let text = String::from_utf8_lossy(&text);
    let file: WatchFile = parse_toml(&text, "cameras", "docs/watch.md")?;
    let server = server.clone().or(&file.server).check()?;
    let cameras = file.cameras.into_iter().enumerate();
    let cameras = cameras.map(|(index, camera)| {
        camera
            .or(&file.defaults)
            .check(&format!("cameras[{index}]."))
    });
    WatchOptions::new(server, cameras.collect::<Result<_, _>>()?)
}
