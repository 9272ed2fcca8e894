//! The parts that the crates of Lookdown share: texts of clients, names, files, problems
//! that are logged once.
//!
//! With the feature `companion` also those of a client of the server: settings files, the server
//! and its key, HTTP requests with limits, durations and backoff. With `report`, the report of a
//! frame, which the server writes. With `metrics`, the declaration of metrics.

#[cfg(feature = "companion")]
mod backoff;
#[cfg(feature = "companion")]
mod config;
pub mod files;
#[cfg(feature = "companion")]
mod http_client;
#[cfg(feature = "companion")]
mod http_transport;
#[cfg(feature = "companion")]
mod in_process;
mod jpeg;
mod log_once;
#[cfg(feature = "metrics")]
pub mod metrics;
mod own_cameras;
pub mod plain_name;
mod ppm;
#[cfg(feature = "companion")]
mod reload;
mod replacement;
#[cfg(feature = "report")]
pub mod report;
#[cfg(feature = "companion")]
mod secret;
#[cfg(feature = "companion")]
mod server_entry;
mod stored_file;
pub mod text;

pub use jpeg::{JPEG_END, JPEG_START, jpeg_length};
pub use log_once::LogOnce;
pub use own_cameras::{Claim, OwnCameras, Place, makes_room};
pub use ppm::{MAX_PPM_HEADER_BYTES, PPM_START, ppm_length};
pub use replacement::{Replacement, UNFINISHED, replace_file, sync_folder};
pub use stored_file::StoredFile;

#[cfg(feature = "companion")]
pub use {
    backoff::Backoff,
    config::{ConfigError, optional_duration, parse_duration, parse_toml, read_file, read_secret},
    http_client::{ServerClient, read_body, retry_after},
    http_transport::{ClientError, HttpClient, HttpError},
    in_process::InProcess,
    reload::Reload,
    secret::Secret,
    server_entry::{ServerEntry, ServerOptions},
};
