//! What is kept of reports, as it is written and checked.

use std::time::Duration;

use serde::Deserialize;

use super::{
    ResultSettings, SettingsError,
    check::{MAX_BYTES, count, size, within},
};
use crate::results::{PicturesOf, RedisAddress, RedisAddressError, RedisOptions, ResultLimits};

/// 8 MiB: any one report has room.
const MIN_BYTES: u64 = 8 << 20;
/// A minute to a year.
const AGES: std::ops::RangeInclusive<u64> = 60..=366 * 86_400;

/// Table `results`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub(super) struct RawResults {
    url: String,
    key_prefix: String,
    max_age_seconds: u64,
    max_cameras: u64,
    history_per_camera: u64,
    max_reports: u64,
    max_bytes: u64,
    pictures: String,
    max_pictures: u64,
    max_listeners: u64,
}

impl Default for RawResults {
    fn default() -> Self {
        let limits = ResultLimits::default();
        Self {
            url: String::new(),
            key_prefix: "lookdown".to_owned(),
            max_age_seconds: 86_400,
            max_cameras: limits.max_cameras.get() as u64,
            history_per_camera: limits.history_per_camera.get() as u64,
            max_reports: limits.max_reports.get() as u64,
            max_bytes: limits.max_bytes as u64,
            pictures: String::new(),
            max_pictures: limits.max_pictures.get() as u64,
            max_listeners: limits.max_listeners.get() as u64,
        }
    }
}

impl TryFrom<RawResults> for ResultSettings {
    type Error = SettingsError;

    fn try_from(raw: RawResults) -> Result<Self, SettingsError> {
        Ok(Self {
            redis: redis(&raw)?,
            pictures_of: pictures_of(&raw.pictures),
            limits: ResultLimits {
                max_cameras: count("results.max_cameras", raw.max_cameras)?,
                history_per_camera: count("results.history_per_camera", raw.history_per_camera)?,
                max_reports: count("results.max_reports", raw.max_reports)?,
                max_bytes: size("results.max_bytes", raw.max_bytes, MIN_BYTES..=MAX_BYTES)?,
                max_pictures: count("results.max_pictures", raw.max_pictures)?,
                max_listeners: count("results.max_listeners", raw.max_listeners)?,
            },
        })
    }
}

/// `*` is every camera.
fn pictures_of(list: &str) -> PicturesOf {
    let cameras = || list.split(',').map(str::trim);
    if cameras().any(|camera| camera == "*") {
        return PicturesOf::All;
    }
    let named = cameras().filter(|camera| !camera.is_empty());
    PicturesOf::Some(named.map(ToOwned::to_owned).collect())
}

fn redis(raw: &RawResults) -> Result<Option<RedisOptions>, SettingsError> {
    let is_word = |c: char| c.is_ascii_alphanumeric() || "_.-".contains(c);
    if !(1..=64).contains(&raw.key_prefix.len()) || !raw.key_prefix.chars().all(is_word) {
        return Err(SettingsError::Value {
            key: "results.key_prefix".to_owned(),
            value: format!("{:?}", raw.key_prefix),
            remedy: "give 1 to 64 of a-z, A-Z, 0-9, '_', '.' and '-'".to_owned(),
        });
    }
    let max_age = within("results.max_age_seconds", raw.max_age_seconds, AGES)?;
    if raw.url.is_empty() {
        return Ok(None);
    }
    let address: Result<RedisAddress, _> = raw.url.parse();
    let address = address.map_err(|error: RedisAddressError| SettingsError::Value {
        key: "results.url".to_owned(),
        value: "no URL of a Redis".to_owned(),
        remedy: error.to_string(),
    })?;
    Ok(Some(RedisOptions {
        address,
        key_prefix: raw.key_prefix.clone(),
        max_age: Duration::from_secs(max_age),
    }))
}
