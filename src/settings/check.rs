//! Raw → checked settings, in one conversion.

use std::{
    net::SocketAddr,
    num::{NonZeroU32, NonZeroU64, NonZeroUsize},
    ops::RangeInclusive,
    path::PathBuf,
    time::Duration,
};

use super::{
    CalibrationSettings, InferenceSettings, LimitSettings, LogFormat, LogSettings, ModelSettings,
    PaperSettings, RawSettings, RemoteSettings, RequestRateSettings, ServerSettings, Settings,
    SettingsError, ShutdownSettings, ThreadPlan, raw,
    threads::{self, Computing},
};
use crate::{geometry::FieldOfViewReading, inference::UnknownDevice, server::ConnectionLimits};

/// A body smaller than this holds no picture.
const MIN_BODY_BYTES: u64 = 1024;
/// 2 GiB: more than any picture within the pixel limits.
const MAX_BODY_BYTES: u64 = 2 << 30;
/// 1 TiB: more memory than any machine spends on this.
pub(super) const MAX_BYTES: u64 = 1 << 40;
/// Ten minutes.
pub(super) const MAX_TIMEOUT_MILLIS: u64 = 600_000;
/// No client gets by with less than the least; with twice the most, a head still has its place in
/// the buffer of a connection.
const HEADER_BYTES: RangeInclusive<u64> = 1024..=128 * 1024;
/// Browsers send some twenty.
const HEADERS: RangeInclusive<u64> = 16..=1024;
/// A second: whoever waits longer for a batch to fill has no traffic to fill it.
const MAX_QUEUE_DELAY_MILLIS: u64 = 1_000;
/// A day.
const MAX_POLL_SECONDS: u64 = 86_400;
/// The longest side the JPEG format can state.
const MAX_IMAGE_SIDE: u64 = 65_535;
/// A client that may ask less often than once in 50 seconds would be told to wait for longer than
/// anybody remembers it.
const REQUEST_RATES: RangeInclusive<f64> = 0.02..=100_000.0;
/// Beyond this only a mistake is possible.
const MAX_COUNT: u64 = 65_536;

impl TryFrom<RawSettings> for Settings {
    type Error = SettingsError;

    fn try_from(raw: RawSettings) -> Result<Self, SettingsError> {
        let server = server(&raw.server)?;
        let inference = inference(&raw.inference, &raw.model)?;
        Ok(Self {
            limits: limits(&raw.limits, server.max_body_bytes)?,
            shutdown: shutdown(&raw.shutdown, server.request_timeout)?,
            server,
            access: raw.access.try_into()?,
            calibrations: CalibrationSettings {
                path: raw.calibrations.path.parse()?,
                poll_seconds: poll_seconds(
                    "calibrations.poll_seconds",
                    raw.calibrations.poll_seconds,
                )?,
                writable: raw.calibrations.writable,
                zone_metrics: raw.calibrations.zone_metrics,
                cache_bytes: size(
                    "calibrations.cache_bytes",
                    raw.calibrations.cache_bytes,
                    0..=MAX_BYTES,
                )?,
            },
            model: model(raw.model)?,
            threads: threads(&raw.inference, inference.computing())?,
            inference,
            paper: PaperSettings {
                field_of_view: choice(
                    "paper.field_of_view",
                    &raw.paper.field_of_view,
                    &[
                        ("horizontal", FieldOfViewReading::Horizontal),
                        ("diagonal", FieldOfViewReading::Diagonal),
                        ("literal", FieldOfViewReading::Literal),
                    ],
                )?,
            },
            results: raw.results.try_into()?,
            mqtt: raw.mqtt.checked()?,
            log: log(raw.log)?,
            traces: raw.telemetry.try_into()?,
        })
    }
}

fn server(raw: &raw::RawServer) -> Result<ServerSettings, SettingsError> {
    let metrics_listen = (!raw.metrics_listen.is_empty())
        .then(|| address("server.metrics_listen", &raw.metrics_listen));
    Ok(ServerSettings {
        listen: address("server.listen", &raw.listen)?,
        metrics_listen: metrics_listen.transpose()?,
        max_body_bytes: size(
            "server.max_body_bytes",
            raw.max_body_bytes,
            MIN_BODY_BYTES..=MAX_BODY_BYTES,
        )?,
        request_timeout: millis(
            "server.request_timeout_millis",
            raw.request_timeout_millis,
            1..=MAX_TIMEOUT_MILLIS,
        )?,
        connections: connections(raw)?,
        tls: raw.tls.checked()?,
    })
}

fn connections(raw: &raw::RawServer) -> Result<ConnectionLimits, SettingsError> {
    let timeouts = 1..=MAX_TIMEOUT_MILLIS;
    Ok(ConnectionLimits {
        max_connections: count("server.max_connections", raw.max_connections)?,
        header_timeout: millis(
            "server.header_timeout_millis",
            raw.header_timeout_millis,
            timeouts.clone(),
        )?,
        idle_timeout: millis(
            "server.idle_timeout_millis",
            raw.idle_timeout_millis,
            timeouts,
        )?,
        max_header_bytes: size(
            "server.max_header_bytes",
            raw.max_header_bytes,
            HEADER_BYTES,
        )?,
        max_headers: size("server.max_headers", raw.max_headers, HEADERS)?,
    })
}

fn shutdown(
    raw: &raw::RawShutdown,
    request_timeout: Duration,
) -> Result<ShutdownSettings, SettingsError> {
    let times = 0..=MAX_TIMEOUT_MILLIS;
    let drain_timeout = millis(
        "shutdown.drain_timeout_millis",
        raw.drain_timeout_millis,
        times.clone(),
    )?;
    Ok(ShutdownSettings {
        grace: millis("shutdown.grace_millis", raw.grace_millis, times)?,
        drain_timeout: match drain_timeout {
            Duration::ZERO => request_timeout,
            chosen => chosen,
        },
    })
}

fn model(raw: raw::RawModel) -> Result<ModelSettings, SettingsError> {
    let names = raw.also_load.split(',').map(str::trim);
    Ok(ModelSettings {
        path: (!raw.path.is_empty()).then(|| raw.path.into()),
        repository: path("model.repository", raw.repository)?,
        also_load: names
            .filter(|name| !name.is_empty())
            .map(ToOwned::to_owned)
            .collect(),
        poll_seconds: poll_seconds("model.poll_seconds", raw.poll_seconds)?,
    })
}

fn inference(
    raw: &raw::RawInference,
    model: &raw::RawModel,
) -> Result<InferenceSettings, SettingsError> {
    if !(0.0..=1.0).contains(&raw.score_floor) {
        return Err(SettingsError::Value {
            key: "inference.score_floor".to_owned(),
            value: raw.score_floor.to_string(),
            remedy: "give a number from 0 to 1".to_owned(),
        });
    }
    let device = raw.device.parse();
    let device = device.map_err(|error: UnknownDevice| SettingsError::Value {
        key: "inference.device".to_owned(),
        value: format!("{:?}", raw.device),
        remedy: error.to_string(),
    })?;
    let delay = within(
        "inference.max_queue_delay_millis",
        raw.max_queue_delay_millis,
        0..=MAX_QUEUE_DELAY_MILLIS,
    )?;
    let max_batch_views = wanted("inference.max_batch_views", raw.max_batch_views)?;
    let remote = RemoteSettings::checked(raw, model)?;
    let computing = Computing::of(device, remote.is_some());
    Ok(InferenceSettings {
        remote,
        library_path: path("inference.library_path", raw.library_path.clone())?,
        device,
        max_batch_views: max_batch_views.unwrap_or_else(|| threads::batch_views(computing)),
        max_queue_delay: Duration::from_millis(delay),
        score_floor: raw.score_floor,
        max_detections_per_view: count(
            "inference.max_detections_per_view",
            raw.max_detections_per_view,
        )?,
        remembered_frames: size(
            "inference.remembered_frames",
            raw.remembered_frames,
            0..=MAX_COUNT,
        )?,
    })
}

fn threads(raw: &raw::RawInference, computing: Computing) -> Result<ThreadPlan, SettingsError> {
    let sessions = wanted("inference.sessions", raw.sessions)?;
    let per_session = wanted("inference.threads", raw.threads)?;
    Ok(ThreadPlan::for_this_process(
        computing,
        sessions,
        per_session,
    ))
}

fn limits(raw: &raw::RawLimits, max_body_bytes: usize) -> Result<LimitSettings, SettingsError> {
    let max_image_side = within(
        "limits.max_image_side",
        raw.max_image_side,
        1..=MAX_IMAGE_SIDE,
    )?;
    Ok(LimitSettings {
        max_image_side: u32::try_from(max_image_side).unwrap_or(u32::MAX),
        max_image_pixels: within(
            "limits.max_image_pixels",
            raw.max_image_pixels,
            1..=MAX_IMAGE_SIDE * MAX_IMAGE_SIDE,
        )?,
        max_decode_bytes: within(
            "limits.max_decode_bytes",
            raw.max_decode_bytes,
            1..=MAX_BYTES,
        )?,
        max_frames_in_flight: count("limits.max_frames_in_flight", raw.max_frames_in_flight)?,
        max_upload_bytes: size(
            "limits.max_upload_bytes",
            raw.max_upload_bytes,
            max_body_bytes as u64..=MAX_BYTES,
        )?,
        min_upload_bytes_per_second: NonZeroU64::new(within(
            "limits.min_upload_bytes_per_second",
            raw.min_upload_bytes_per_second,
            0..=MAX_BODY_BYTES,
        )?),
        request_rate: request_rate(raw)?,
    })
}

fn request_rate(raw: &raw::RawLimits) -> Result<Option<RequestRateSettings>, SettingsError> {
    let burst = within("limits.request_burst", raw.request_burst, 1..=MAX_COUNT)?;
    let burst = u32::try_from(burst).ok().and_then(NonZeroU32::new);
    let per_second = raw.requests_per_second;
    if per_second == 0.0 {
        return Ok(None);
    }
    if !REQUEST_RATES.contains(&per_second) {
        return Err(SettingsError::Value {
            key: "limits.requests_per_second".to_owned(),
            value: per_second.to_string(),
            remedy: format!(
                "give 0 for no limit, or a number from {} to {}",
                REQUEST_RATES.start(),
                REQUEST_RATES.end()
            ),
        });
    }
    Ok(Some(RequestRateSettings {
        per_second,
        burst: burst.unwrap_or(NonZeroU32::MIN),
    }))
}

fn log(raw: raw::RawLog) -> Result<LogSettings, SettingsError> {
    let formats = [("text", LogFormat::Text), ("json", LogFormat::Json)];
    if let Err(error) = tracing_subscriber::EnvFilter::try_new(&raw.filter) {
        return Err(SettingsError::Value {
            key: "log.filter".to_owned(),
            value: format!("{:?}", raw.filter),
            remedy: format!("{error}; give a level such as info, or info,lookdown=debug"),
        });
    }
    Ok(LogSettings {
        format: choice("log.format", &raw.format, &formats)?,
        filter: raw.filter,
    })
}

fn path(key: &str, value: String) -> Result<PathBuf, SettingsError> {
    if value.is_empty() {
        return Err(SettingsError::Value {
            key: key.to_owned(),
            value: "empty".to_owned(),
            remedy: "give a path, or leave the key out".to_owned(),
        });
    }
    Ok(value.into())
}

fn address(key: &str, value: &str) -> Result<SocketAddr, SettingsError> {
    value.parse().map_err(|_| SettingsError::Value {
        key: key.to_owned(),
        value: format!("{value:?}"),
        remedy: "give an IP address and a port, such as 127.0.0.1:8080 or [::]:8080".to_owned(),
    })
}

pub(super) fn within(
    key: &str,
    value: u64,
    range: RangeInclusive<u64>,
) -> Result<u64, SettingsError> {
    if range.contains(&value) {
        return Ok(value);
    }
    Err(SettingsError::Value {
        key: key.to_owned(),
        value: value.to_string(),
        remedy: format!(
            "give a whole number from {} to {}",
            range.start(),
            range.end()
        ),
    })
}

/// 0 means never.
pub(super) fn poll_seconds(key: &str, value: u64) -> Result<Option<NonZeroU64>, SettingsError> {
    within(key, value, 0..=MAX_POLL_SECONDS).map(NonZeroU64::new)
}

/// 0 leaves the choice to us.
fn wanted(key: &str, value: u64) -> Result<Option<NonZeroUsize>, SettingsError> {
    let value = within(key, value, 0..=MAX_COUNT)?;
    Ok(usize::try_from(value).ok().and_then(NonZeroUsize::new))
}

pub(super) fn count(key: &str, value: u64) -> Result<NonZeroUsize, SettingsError> {
    let value = within(key, value, 1..=MAX_COUNT)?;
    let count = usize::try_from(value).ok().and_then(NonZeroUsize::new);
    Ok(count.unwrap_or(NonZeroUsize::MIN))
}

pub(super) fn millis(
    key: &str,
    value: u64,
    range: RangeInclusive<u64>,
) -> Result<Duration, SettingsError> {
    within(key, value, range).map(Duration::from_millis)
}

pub(super) fn size(
    key: &str,
    value: u64,
    range: RangeInclusive<u64>,
) -> Result<usize, SettingsError> {
    let value = within(key, value, range)?;
    Ok(usize::try_from(value).unwrap_or(usize::MAX))
}

pub(super) fn choice<T: Copy>(
    key: &str,
    value: &str,
    choices: &[(&str, T)],
) -> Result<T, SettingsError> {
    let chosen = choices.iter().find(|(name, _)| *name == value);
    chosen.map(|(_, choice)| *choice).ok_or_else(|| {
        let names: Vec<_> = choices.iter().map(|(name, _)| *name).collect();
        SettingsError::Value {
            key: key.to_owned(),
            value: format!("{value:?}"),
            remedy: format!("use one of {}", names.join(", ")),
        }
    })
}
