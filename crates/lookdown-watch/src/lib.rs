//! Reads frames of cameras and sends the newest ones to a Lookdown server.
//!
//! Every camera is a task of its own: a source fills a slot with the newest frame, and a sender
//! posts it to `/detect` at an interval. All state is bounded, so one camera never slows another.
//! This crate is a client of the public HTTP API. It does not depend on the server.

mod camera;
mod child;
mod config;
mod credentials;
mod ffmpeg;
mod frame;
mod image_splitter;
mod location;
mod memory_budget;
mod metrics;
mod metrics_server;
mod operating_point;
mod rate;
mod rtsp_relay;
mod sender;
mod server;
mod slot;
mod source;
mod source_error;
mod video;
mod viewers;
mod watcher;

pub use camera::{Camera, Transport, VideoOptions};
pub use config::{CameraEntry, MAX_CAMERAS, WatchEntry, WatchOptions};
pub use credentials::Credentials;
pub use frame::{Frame, FrameError, ImageFormat, MAX_FRAME_BYTES};
pub use location::Location;
pub use metrics::{CameraState, Metrics};
pub use metrics_server::serve_metrics;
pub use operating_point::{Choice, OperatingPoints};
pub use rate::Rate;
pub use source::{ImageReader, first_frame};
pub use source_error::SourceError;
pub use video::{VideoFrames, VideoWriter, video_created_at, video_duration};
pub use viewers::{Viewers, Viewing};
pub use watcher::{Origin, WatchError, watch};
