//! Settings as they are written, with their defaults.

use serde::Deserialize;

use super::{
    access::RawAccess, locate, mqtt::RawMqtt, remote, results::RawResults, tls::RawTls,
    traces::RawTelemetry, unshown::Unshown,
};

const MEBIBYTE: u64 = 1024 * 1024;

/// Settings as they are written: one table per concern, unknown keys refused.
#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RawSettings {
    pub(super) server: RawServer,
    pub(super) shutdown: RawShutdown,
    pub(super) access: RawAccess,
    pub(super) calibrations: RawCalibrations,
    pub(super) model: RawModel,
    pub(super) inference: RawInference,
    pub(super) limits: RawLimits,
    pub(super) results: RawResults,
    pub(super) mqtt: RawMqtt,
    pub(super) paper: RawPaper,
    pub(super) log: RawLog,
    pub(super) telemetry: RawTelemetry,
}

/// Table `server`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub(super) struct RawServer {
    pub(super) listen: String,
    pub(super) metrics_listen: String,
    pub(super) max_body_bytes: u64,
    pub(super) request_timeout_millis: u64,
    pub(super) max_connections: u64,
    pub(super) header_timeout_millis: u64,
    pub(super) idle_timeout_millis: u64,
    pub(super) max_header_bytes: u64,
    pub(super) max_headers: u64,
    pub(super) tls: RawTls,
}

impl Default for RawServer {
    fn default() -> Self {
        Self {
            listen: "127.0.0.1:8080".to_owned(),
            metrics_listen: String::new(),
            max_body_bytes: 32 * MEBIBYTE,
            request_timeout_millis: 30_000,
            max_connections: 512,
            header_timeout_millis: 10_000,
            idle_timeout_millis: 75_000,
            max_header_bytes: 16 * 1024,
            max_headers: 100,
            tls: RawTls::default(),
        }
    }
}

/// Table `shutdown`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub(super) struct RawShutdown {
    pub(super) grace_millis: u64,
    pub(super) drain_timeout_millis: u64,
}

impl Default for RawShutdown {
    fn default() -> Self {
        Self {
            grace_millis: 5_000,
            drain_timeout_millis: 0,
        }
    }
}

/// Table `calibrations`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub(super) struct RawCalibrations {
    pub(super) path: String,
    pub(super) poll_seconds: u64,
    pub(super) writable: bool,
    pub(super) zone_metrics: bool,
    pub(super) cache_bytes: u64,
}

impl Default for RawCalibrations {
    fn default() -> Self {
        Self {
            path: locate::DEFAULT_CALIBRATIONS.to_owned(),
            poll_seconds: 2,
            writable: true,
            zone_metrics: false,
            cache_bytes: 1024 * MEBIBYTE,
        }
    }
}

/// Table `model`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub(super) struct RawModel {
    pub(super) path: String,
    pub(super) repository: String,
    pub(super) also_load: String,
    pub(super) poll_seconds: u64,
}

impl Default for RawModel {
    fn default() -> Self {
        Self {
            path: String::new(),
            repository: locate::DEFAULT_REPOSITORY.to_owned(),
            also_load: String::new(),
            poll_seconds: 5,
        }
    }
}

/// Table `inference`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub(super) struct RawInference {
    pub(super) backend: String,
    pub(super) url: String,
    pub(super) bearer_token: Unshown,
    pub(super) model: String,
    pub(super) timeout_millis: u64,
    pub(super) library_path: String,
    pub(super) device: String,
    pub(super) sessions: u64,
    pub(super) threads: u64,
    pub(super) max_batch_views: u64,
    pub(super) max_queue_delay_millis: u64,
    pub(super) score_floor: f64,
    pub(super) max_detections_per_view: u64,
    pub(super) remembered_frames: u64,
}

impl Default for RawInference {
    fn default() -> Self {
        Self {
            backend: remote::ONNX.to_owned(),
            url: String::new(),
            bearer_token: Unshown::default(),
            model: String::new(),
            timeout_millis: 10_000,
            library_path: locate::DEFAULT_LIBRARY.to_owned(),
            device: "cpu".to_owned(),
            sessions: 0,
            threads: 0,
            max_batch_views: 0,
            max_queue_delay_millis: 0,
            score_floor: 0.05,
            max_detections_per_view: 300,
            remembered_frames: 32,
        }
    }
}

/// Table `limits`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub(super) struct RawLimits {
    pub(super) max_image_side: u64,
    pub(super) max_image_pixels: u64,
    pub(super) max_decode_bytes: u64,
    pub(super) max_frames_in_flight: u64,
    pub(super) max_upload_bytes: u64,
    pub(super) min_upload_bytes_per_second: u64,
    pub(super) requests_per_second: f64,
    pub(super) request_burst: u64,
}

impl Default for RawLimits {
    fn default() -> Self {
        Self {
            max_image_side: 8192,
            max_image_pixels: 50_000_000,
            max_decode_bytes: 512 * MEBIBYTE,
            max_frames_in_flight: 16,
            max_upload_bytes: 256 * MEBIBYTE,
            min_upload_bytes_per_second: 1024,
            requests_per_second: 0.0,
            request_burst: 20,
        }
    }
}

/// Table `paper`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub(super) struct RawPaper {
    pub(super) field_of_view: String,
}

impl Default for RawPaper {
    fn default() -> Self {
        Self {
            field_of_view: "horizontal".to_owned(),
        }
    }
}

/// Table `log`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub(super) struct RawLog {
    pub(super) format: String,
    pub(super) filter: String,
}

impl Default for RawLog {
    fn default() -> Self {
        Self {
            format: "text".to_owned(),
            filter: "info,ort=warn,object_store=warn".to_owned(),
        }
    }
}
