//! The operator's settings: defaults in code, then the settings file, then environment variables;
//! checked once, before anything is started.
//!
//! Each setting is declared once, with `settings!`: its key, type, form, default and documentation.
//! `packaging/lookdown.toml` and `docs/configuration.md` are generated from these declarations.

mod calibrations;
mod declare;
mod entry;
mod form;
mod inference;
mod locate;
#[cfg(test)]
mod reference;
mod results;
mod server;
mod values;

use std::{path::Path, time::Duration};

use lookdown_common::ServerEntry;
use lookdown_detect::parameters::DetectDefaults;
use lookdown_http::server::ConnectionLimits;

pub use calibrations::{CalibrationSettings, StateSettings};
pub use entry::{CAMERA_VARIABLE, SettingsError, environment};
pub use inference::{InferenceSettings, ModelSettings, RemoteSettings, ThreadPlan, explain};
pub use locate::{
    PackagedFiles, find_calibrations, find_installed, is_installed, use_packaged_files,
};
pub use results::{CountSettings, ResultSettings};
pub use server::{
    AccessSettings, LimitSettings, LogFormat, LogSettings, ServerSettings, ShutdownSettings,
    TraceSettings,
};
pub use values::ListSettings;

pub(crate) use entry::variable_of;

use self::{
    declare::Table,
    entry::{Entry, ignored},
    inference::{RemoteKeys, ThreadKeys},
    results::{MqttKeys, ResultKeys, UpstreamKeys},
    server::TlsKeys,
    values::Values,
};
use crate::{mqtt::MqttOptions, results::ResultLimits, tls::TlsOptions};

/// All settings, checked.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// The HTTP server.
    pub server: ServerSettings,
    /// The limits of connections.
    pub connections: ConnectionLimits,
    /// TLS; `None` for plain HTTP.
    pub tls: Option<TlsOptions>,
    /// The end of the server.
    pub shutdown: ShutdownSettings,
    /// API keys, and the web pages that may call the server.
    pub access: AccessSettings,
    /// The calibration store.
    pub calibrations: CalibrationSettings,
    /// The defaults of detection parameters.
    pub detect: DetectDefaults,
    /// The models.
    pub model: ModelSettings,
    /// ONNX Runtime and the candidates of a view.
    pub inference: InferenceSettings,
    /// The inference server that runs the models; `None` when they run in this process.
    pub remote: Option<RemoteSettings>,
    /// The use of the cores.
    pub threads: ThreadPlan,
    /// The cost of one frame, and of all frames together.
    pub limits: LimitSettings,
    /// The result store.
    pub results: ResultSettings,
    /// The MQTT broker; `None` for none.
    pub mqtt: Option<MqttOptions>,
    /// The server of `watch` and `count`.
    pub upstream: ServerEntry,
    /// The counts.
    pub counts: CountSettings,
    /// The state of `lookdown run`.
    pub state: StateSettings,
    /// Cameras and webhooks.
    pub lists: ListSettings,
    /// The log.
    pub log: LogSettings,
    /// Traces.
    pub traces: TraceSettings,
}

impl Settings {
    /// The longest time that requests may take after the grace period.
    pub fn drain_timeout(&self) -> Duration {
        let own = self.shutdown.drain_timeout;
        own.unwrap_or(self.server.request_timeout)
    }

    fn read(values: &Values) -> Result<Self, SettingsError> {
        let model = ModelSettings::read(values)?;
        let inference = InferenceSettings::read(values)?;
        let remote = RemoteKeys::read(values)?.checked(&model)?;
        let is_remote = remote.is_some();
        let server = ServerSettings::read(values)?;
        Ok(Self {
            limits: LimitSettings::read(values)?.checked(&server)?,
            server,
            connections: ConnectionLimits::read(values)?,
            tls: TlsKeys::read(values)?.checked()?,
            shutdown: ShutdownSettings::read(values)?,
            access: AccessSettings::read(values)?,
            calibrations: CalibrationSettings::read(values)?,
            detect: DetectDefaults::read(values)?,
            threads: ThreadKeys::read(values)?.plan(inference.device, is_remote),
            model,
            inference,
            remote,
            results: ResultKeys::read(values)?.checked(ResultLimits::read(values)?)?,
            mqtt: MqttKeys::read(values)?.checked()?,
            upstream: UpstreamKeys::read(values)?.entry(),
            counts: CountSettings::read(values)?,
            state: StateSettings::read(values)?,
            lists: values.lists.clone(),
            log: LogSettings::read(values)?,
            traces: TraceSettings::read(values)?,
        })
    }
}

/// Every setting, in the order of the reference.
fn entries() -> Vec<Entry> {
    [
        ServerSettings::entries(),
        ConnectionLimits::entries(),
        TlsKeys::entries(),
        ShutdownSettings::entries(),
        AccessSettings::entries(),
        CalibrationSettings::entries(),
        DetectDefaults::entries(),
        ModelSettings::entries(),
        RemoteKeys::entries(),
        ThreadKeys::entries(),
        InferenceSettings::entries(),
        LimitSettings::entries(),
        ResultKeys::entries(),
        ResultLimits::entries(),
        MqttKeys::entries(),
        CountSettings::entries(),
        StateSettings::entries(),
        UpstreamKeys::entries(),
        LogSettings::entries(),
        TraceSettings::entries(),
    ]
    .concat()
}

/// Loads and checks the settings: defaults, then `file` (TOML), then `environment`. A variable that
/// is set to nothing counts as not set, except `LOOKDOWN__ACCESS__KEYS_FILE`, where that is
/// refused.
///
/// # Errors
/// [`SettingsError`] when the file cannot be read, a key is unknown or a value cannot be used.
pub fn load(
    file: Option<&Path>,
    environment: impl IntoIterator<Item = (String, String)>,
) -> Result<Settings, SettingsError> {
    load_with(file, environment, &[])
}

/// [`load`], with values that take precedence over all others, each with its key.
///
/// # Errors
/// Those of [`load`].
pub fn load_with(
    file: Option<&Path>,
    environment: impl IntoIterator<Item = (String, String)>,
    overrides: &[(String, String)],
) -> Result<Settings, SettingsError> {
    let entries = entries();
    let mut values = Values::read(file, environment, &entries)?;
    values.override_with(overrides, &entries)?;
    Settings::read(&values)
}

/// A sentence on the variables among `names` that begin with `LOOKDOWN_` and are not settings, with
/// the setting that each may have been meant for; `None` when there are none.
pub fn ignored_variables(names: impl IntoIterator<Item = String>) -> Option<String> {
    ignored(names, &entries())
}
