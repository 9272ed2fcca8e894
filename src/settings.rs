//! What the operator may choose: defaults in code, then the settings file, then environment
//! variables; checked once, before anything is started.
//!
//! `LOOKDOWN__SERVER__LISTEN` is the key `server.listen`. Variables of another shape, such as the
//! `LOOKDOWN_PORT=tcp://…` that Kubernetes sets for a service called `lookdown`, are none of ours.

mod access;
mod calibration_place;
mod check;
mod error;
mod locate;
mod mqtt;
mod raw;
mod remote;
mod results;
mod source;
mod threads;
mod tls;
mod traces;
mod unshown;

use std::{
    net::SocketAddr,
    num::{NonZeroU32, NonZeroU64, NonZeroUsize},
    path::PathBuf,
    time::Duration,
};

pub use calibration_place::CalibrationPlace;
pub use error::SettingsError;
pub use locate::{find_beside_executable, find_calibrations};
pub use raw::RawSettings;
pub use remote::RemoteSettings;
pub use source::{environment, load};
pub use threads::{Computing, ThreadPlan};

use url::Url;

use crate::{
    access::KeyList,
    geometry::FieldOfViewReading,
    inference::Device,
    mqtt::MqttOptions,
    results::{PicturesOf, RedisOptions, ResultLimits},
    server::ConnectionLimits,
    tls::TlsOptions,
};

/// Everything the operator may choose, checked.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// The HTTP server.
    pub server: ServerSettings,
    /// How the server ends.
    pub shutdown: ShutdownSettings,
    /// Who may do what.
    pub access: AccessSettings,
    /// Where calibrations come from.
    pub calibrations: CalibrationSettings,
    /// Which detectors answer.
    pub model: ModelSettings,
    /// How the detector is run.
    pub inference: InferenceSettings,
    /// How the cores are shared.
    pub threads: ThreadPlan,
    /// What one frame, and all frames together, may cost.
    pub limits: LimitSettings,
    /// What is kept of reports, and where.
    pub results: ResultSettings,
    /// The MQTT broker that is published to, if there is one.
    pub mqtt: Option<MqttOptions>,
    /// How the paper is read where it can be read in several ways.
    pub paper: PaperSettings,
    /// What is logged.
    pub log: LogSettings,
    /// Where traces go.
    pub traces: TraceSettings,
}

/// The HTTP server.
#[derive(Debug, Clone, PartialEq)]
pub struct ServerSettings {
    /// Address and port to listen on.
    pub listen: SocketAddr,
    /// Address and port for metrics and probes alone; without it, metrics are where the rest is.
    pub metrics_listen: Option<SocketAddr>,
    /// Largest request body, bytes.
    pub max_body_bytes: usize,
    /// Longest a request may take, from its first byte to its answer.
    pub request_timeout: Duration,
    /// What connections may cost.
    pub connections: ConnectionLimits,
    /// TLS; `None` for plain HTTP.
    pub tls: Option<TlsOptions>,
}

/// How the server ends.
#[derive(Debug, Clone, PartialEq)]
pub struct ShutdownSettings {
    /// How long everything is still served while probes say that the end is near.
    pub grace: Duration,
    /// How long after that what is in flight may take.
    pub drain_timeout: Duration,
}

/// Who may do what.
#[derive(Debug, Clone, PartialEq)]
pub struct AccessSettings {
    /// The keys that the settings state themselves.
    pub keys: KeyList,
    /// The file with further keys.
    pub keys_file: Option<PathBuf>,
    /// How often that file is looked at, seconds; `None` for never.
    pub poll_seconds: Option<NonZeroU64>,
    /// The origins of web pages that may call the server, such as `https://dashboard.example`.
    pub cors_origins: Vec<String>,
}

/// Where calibrations come from.
#[derive(Debug, Clone, PartialEq)]
pub struct CalibrationSettings {
    /// A folder or a bucket of calibration files.
    pub path: CalibrationPlace,
    /// How often the store is looked at, seconds; `None` for never.
    pub poll_seconds: Option<NonZeroU64>,
    /// Whether calibrations can be changed over HTTP.
    pub writable: bool,
    /// Whether the persons in each zone are shown as a metric.
    pub zone_metrics: bool,
    /// Most memory that the tables of cameras may hold, bytes.
    pub cache_bytes: usize,
}

/// Which detectors answer.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelSettings {
    /// The one model for all profiles; without it each profile has its own.
    pub path: Option<PathBuf>,
    /// Folder of model folders.
    pub repository: PathBuf,
    /// Models of the repository to load at the start beside those of the profiles.
    pub also_load: Vec<String>,
    /// How often the files of loaded models are looked at, seconds; `None` for never.
    pub poll_seconds: Option<NonZeroU64>,
}

/// How the detector is run.
#[derive(Debug, Clone, PartialEq)]
pub struct InferenceSettings {
    /// The ONNX Runtime library.
    pub library_path: PathBuf,
    /// What networks run on.
    pub device: Device,
    /// The server that they run on instead.
    pub remote: Option<RemoteSettings>,
    /// Most views in one run of the network.
    pub max_batch_views: NonZeroUsize,
    /// How long a view may wait for others to fill its batch.
    pub max_queue_delay: Duration,
    /// Candidates below this score are dropped before anything else looks at them, 0 to 1.
    pub score_floor: f64,
    /// Most candidates kept of one view, best first.
    pub max_detections_per_view: NonZeroUsize,
    /// Most frames of which is remembered what was found in them, for requests that want it.
    pub remembered_frames: usize,
}

impl InferenceSettings {
    /// Where networks compute.
    #[must_use]
    pub fn computing(&self) -> Computing {
        Computing::of(self.device, self.remote.is_some())
    }
}

/// What one frame, and all frames together, may cost.
#[derive(Debug, Clone, PartialEq)]
pub struct LimitSettings {
    /// Longest side of a frame, pixels.
    pub max_image_side: u32,
    /// Most pixels of a frame.
    pub max_image_pixels: u64,
    /// Most memory that decoding one frame may take, bytes.
    pub max_decode_bytes: u64,
    /// Most frames that wait for a worker or are worked on.
    pub max_frames_in_flight: NonZeroUsize,
    /// Most bytes that all request bodies, and tensors unpacked from them, may hold in memory together.
    pub max_upload_bytes: usize,
    /// A body that comes more slowly is given up; `None` for none.
    pub min_upload_bytes_per_second: Option<NonZeroU64>,
    /// How often a client may ask; `None` for as often as it wants.
    pub request_rate: Option<RequestRateSettings>,
}

/// How often a client may ask.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RequestRateSettings {
    /// Requests a second in the long run.
    pub per_second: f64,
    /// Requests at once after a pause.
    pub burst: NonZeroU32,
}

/// What is kept of reports, and where.
#[derive(Debug, Clone, PartialEq)]
pub struct ResultSettings {
    /// The Redis that servers share; `None` for the memory of this process.
    pub redis: Option<RedisOptions>,
    /// The cameras whose latest picture is kept as well.
    pub pictures_of: PicturesOf,
    /// How much.
    pub limits: ResultLimits,
}

/// How the paper is read where it can be read in several ways.
#[derive(Debug, Clone, PartialEq)]
pub struct PaperSettings {
    /// Its field of view.
    pub field_of_view: FieldOfViewReading,
}

/// What is logged.
#[derive(Debug, Clone, PartialEq)]
pub struct LogSettings {
    /// The shape of a log line.
    pub format: LogFormat,
    /// Which events are logged: `info`, `warn,lookdown=debug` and the like.
    pub filter: String,
}

/// The shape of a log line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LogFormat {
    /// For eyes.
    Text,
    /// One JSON object per line.
    Json,
}

/// Where traces go.
#[derive(Debug, Clone, PartialEq)]
pub struct TraceSettings {
    /// The collector's address for OTLP over HTTP, without `/v1/traces`; `None` for no traces.
    pub otlp_endpoint: Option<Url>,
    /// Which share of the requests is traced, 0 to 1, where the caller has not chosen.
    pub sample_ratio: f64,
    /// The name under which the traces appear.
    pub service_name: String,
}
