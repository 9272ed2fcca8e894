//! Where traces go, as it is written and checked.

use serde::Deserialize;
use url::Url;

use super::{SettingsError, TraceSettings};

/// Table `telemetry`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub(super) struct RawTelemetry {
    otlp_endpoint: String,
    sample_ratio: f64,
    service_name: String,
}

impl Default for RawTelemetry {
    fn default() -> Self {
        Self {
            otlp_endpoint: String::new(),
            sample_ratio: 1.0,
            service_name: "lookdown".to_owned(),
        }
    }
}

impl TryFrom<RawTelemetry> for TraceSettings {
    type Error = SettingsError;

    fn try_from(raw: RawTelemetry) -> Result<Self, SettingsError> {
        if !(0.0..=1.0).contains(&raw.sample_ratio) {
            return Err(SettingsError::Value {
                key: "telemetry.sample_ratio".to_owned(),
                value: raw.sample_ratio.to_string(),
                remedy: "give a number from 0 to 1".to_owned(),
            });
        }
        if raw.service_name.trim().is_empty() {
            return Err(SettingsError::Value {
                key: "telemetry.service_name".to_owned(),
                value: format!("{:?}", raw.service_name),
                remedy: "give a name".to_owned(),
            });
        }
        Ok(Self {
            otlp_endpoint: endpoint(&raw.otlp_endpoint)?,
            sample_ratio: raw.sample_ratio,
            service_name: raw.service_name,
        })
    }
}

/// The collector's address. One with a password is refused: addresses are shown.
fn endpoint(told: &str) -> Result<Option<Url>, SettingsError> {
    const KEY: &str = "telemetry.otlp_endpoint";
    if told.is_empty() {
        return Ok(None);
    }
    let refused = || SettingsError::Value {
        key: KEY.to_owned(),
        value: format!("{told:?}"),
        remedy: "give an address for OTLP over HTTP such as http://127.0.0.1:4318".to_owned(),
    };
    let url: Url = told.parse().map_err(|_| refused())?;
    if !url.username().is_empty() || url.password().is_some() {
        return Err(SettingsError::Refused {
            key: KEY.to_owned(),
            problem: "credentials belong into the variable OTEL_EXPORTER_OTLP_HEADERS".to_owned(),
        });
    }
    let is_plain = url.query().is_none() && url.fragment().is_none();
    let is_http = matches!(url.scheme(), "http" | "https");
    (is_plain && is_http)
        .then_some(Some(url))
        .ok_or_else(refused)
}
