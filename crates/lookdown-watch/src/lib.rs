//! Reads frames of cameras and sends the newest ones to a Lookdown server.
//!
//! Every camera is a task of its own: a source fills a slot with the newest frame, and a sender
//! posts it to `/detect` at an interval. All state is bounded, so one camera never slows another.
//! This crate is a client of the public HTTP API. It does not depend on the server.

mod camera;
mod config;
mod credentials;
mod ffmpeg;
mod frame;
mod jpeg_splitter;
mod location;
mod metrics;
mod metrics_server;
mod pace;
mod sender;
mod server;
mod slot;
mod source;
mod source_error;
mod stderr_line;
mod video;
mod watcher;

pub use camera::{Camera, Transport, VideoOptions};
pub use config::{CameraEntry, WatchOptions, load};
pub use credentials::Credentials;
pub use frame::{Frame, FrameError, ImageFormat, MAX_FRAME_BYTES};
pub use location::{InvalidLocation, Location};
pub use metrics::Metrics;
pub use source::ImageReader;
pub use source_error::SourceError;
pub use video::{VideoFrames, VideoWriter, video_duration};
pub use watcher::{Origin, WatchError, watch};
