//! The flags of the companions for the server that they are clients of.
//!
//! The flags of a single camera.
//!
//! The flags `--config` and `--set`: the source of the settings.

use std::{
    path::{Path, PathBuf},
    time::Duration,
};

use anyhow::{Context, anyhow, bail, ensure};
use clap::{Args, builder::PossibleValuesParser};
use lookdown_common::{ConfigError, ServerClient, ServerEntry, read_body};
use lookdown_detect::parameters::Profile;
use lookdown_watch::{CameraEntry, Transport};
use serde::de::DeserializeOwned;
use strum::VariantNames;
use url::Url;

use crate::{
    settings::{self, Settings, SettingsError},
    telemetry,
};

/// Longest time for an answer.
const TIMEOUT: Duration = Duration::from_secs(30);
/// Largest answer that is read, bytes.
const MAX_BYTES: usize = 16 << 20;

/// The server of a companion.
#[derive(Debug, Args)]
pub(super) struct ServerFlags {
    /// The URL of the server (`upstream.url`) [default: port 8080 on this machine]
    #[arg(long, value_name = "URL")]
    server: Option<String>,
    /// A file with the API key for the server (`upstream.api_key_file`)
    #[arg(long, value_name = "FILE")]
    api_key_file: Option<String>,
    /// A PEM file with the authorities of the server's certificate (`upstream.authorities`)
    /// [default: those of the system]
    #[arg(long, value_name = "FILE")]
    authorities: Option<String>,
}

impl ServerFlags {
    /// Creates a client of the server of the flags alone.
    pub(super) fn client(&self) -> anyhow::Result<ServerClient> {
        let entry = ServerEntry {
            url: self.server.clone(),
            api_key_file: self.api_key_file.as_ref().map(Into::into),
            authorities: self.authorities.as_ref().map(Into::into),
        };
        Ok(ServerClient::new(&entry.check()?)?)
    }

    /// Returns the settings that the flags give.
    pub(super) fn settings(&self) -> Vec<(String, String)> {
        given(&[
            ("upstream.url", self.server.as_deref()),
            ("upstream.api_key_file", self.api_key_file.as_deref()),
            ("upstream.authorities", self.authorities.as_deref()),
        ])
    }
}

/// Returns the keys and values of flags that are given.
pub(super) fn given(flags: &[(&str, Option<&str>)]) -> Vec<(String, String)> {
    let given = flags
        .iter()
        .filter_map(|(key, value)| Some((*key, (*value)?)));
    given
        .map(|(key, value)| (key.to_owned(), value.to_owned()))
        .collect()
}

/// Reads JSON from a server. An error says that there are no `what`.
pub(super) async fn read_json<T: DeserializeOwned>(
    client: &ServerClient,
    url: Url,
    what: &str,
) -> anyhow::Result<T> {
    let sent = client.send(client.get(url).timeout(TIMEOUT)).await;
    let response = sent.map_err(|error| anyhow!(client.failure(&error)))?;
    if !response.status().is_success() {
        bail!(client.refusal(response).await);
    }
    let body = read_body(response, MAX_BYTES).await?;
    serde_json::from_slice(&body)
        .with_context(|| format!("{} has sent no {what}", client.address()))
}

/// Settings of a single camera, as in a file of cameras.
#[derive(Debug, Default, PartialEq, Args)]
#[group(id = "camera_flags", multiple = true)]
pub(super) struct CameraFlags {
    /// The name under which the server keeps the results [default: the calibration; `run` without
    /// one: camera]
    #[arg(long)]
    name: Option<String>,
    /// The ID of a calibration of the server
    #[arg(long, value_name = "ID")]
    calibration: Option<String>,
    /// The profile [default: that of the server, or fast where searches take too long]
    #[arg(long, value_name = "NAME", value_parser = PossibleValuesParser::new(Profile::VARIANTS))]
    profile: Option<String>,
    /// The interval between two frames, such as 500ms or 2s [default: 1s; RTSP: 200ms where
    /// searches are short enough]
    #[arg(long, value_name = "DURATION")]
    every: Option<String>,
    /// Skip views without motion [default: true]
    #[arg(long, value_name = "BOOL", num_args = 0..=1, require_equals = true, default_missing_value = "true")]
    motion: Option<bool>,
    /// Follow persons between searches of the whole frame, about once a second [default: true]
    #[arg(long, value_name = "BOOL", num_args = 0..=1, require_equals = true, default_missing_value = "true")]
    follow: Option<bool>,
    /// The user name of the camera
    #[arg(long, value_name = "NAME")]
    user: Option<String>,
    /// A file with the password of the camera
    #[arg(long, value_name = "FILE", requires = "user")]
    password_file: Option<PathBuf>,
    /// Start the source again after this time without a frame [default: 10s, at least 3 intervals]
    #[arg(long, value_name = "DURATION")]
    stall_after: Option<String>,
    /// Decode video in hardware: `auto`, or a method that `ffmpeg -hwaccels` lists
    #[arg(long, value_name = "METHOD")]
    hwaccel: Option<String>,
    /// Receive RTSP over UDP instead of TCP
    #[arg(long)]
    udp: bool,
    /// Decode key frames only
    #[arg(long)]
    keyframes_only: bool,
}

impl CameraFlags {
    /// Returns the camera of a source. A camera without a name has that of its calibration, or else
    /// `default_name`.
    pub(super) fn entry(&self, source: &str, default_name: Option<&str>) -> CameraEntry {
        let name = self.name.as_deref().or(self.calibration.as_deref());
        CameraEntry {
            name: name.or(default_name).map(ToOwned::to_owned),
            url: Some(source.to_owned()),
            user: self.user.clone(),
            password_file: self.password_file.clone(),
            every: self.every.clone(),
            stall_after: self.stall_after.clone(),
            calibration: self.calibration.clone(),
            profile: self.profile.clone(),
            motion: self.motion,
            follow: self.follow,
            hwaccel: self.hwaccel.clone(),
            transport: self.udp.then_some(Transport::Udp),
            keyframes_only: self.keyframes_only.then_some(true),
            ..CameraEntry::default()
        }
    }

    /// Refuses flags without a source.
    pub(super) fn check_source(&self, source: Option<&str>) -> anyhow::Result<()> {
        ensure!(
            source.is_some() || *self == Self::default(),
            "flags of a single camera need a source: give its URL, or set them in the settings \
             file, under [camera_defaults] or [[cameras]]"
        );
        Ok(())
    }
}

/// The source of the settings.
#[derive(Debug, Clone, Args)]
pub(super) struct SettingsFile {
    /// Settings file (TOML); variables such as `LOOKDOWN__SERVER__LISTEN` override it
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// A setting, such as `limits.max_frames_in_flight=8`, which overrides its variable and the
    /// file; may be repeated
    #[arg(long = "set", value_name = "KEY=VALUE", value_parser = override_of)]
    overrides: Vec<(String, String)>,
}

/// Settings that can be read again.
#[derive(Clone)]
pub(super) struct SettingsSource {
    file: Option<PathBuf>,
    overrides: Vec<(String, String)>,
}

/// Parses `KEY=VALUE`.
fn override_of(text: &str) -> Result<(String, String), String> {
    let (key, value) = text
        .split_once('=')
        .ok_or("give a key and a value, such as server.listen=0.0.0.0:8080")?;
    Ok((key.to_owned(), value.to_owned()))
}

/// Returns true if a text names a settings file.
pub(super) fn is_settings_file(text: &str) -> bool {
    Path::new(text)
        .extension()
        .is_some_and(|ending| ending == "toml")
}

impl SettingsFile {
    /// Loads and validates the settings, and starts logging as they say.
    pub(super) fn load(&self) -> anyhow::Result<Settings> {
        self.load_with(&[])
    }

    /// [`SettingsFile::load`], with values of other flags, each with its key.
    pub(super) fn load_with(&self, flags: &[(String, String)]) -> anyhow::Result<Settings> {
        self.source(None, flags)?.load()
    }

    /// Returns the source with a file that stands without `--config`, and with values of other
    /// flags, each with its key.
    ///
    /// # Errors
    /// If there are two files.
    pub(super) fn source(
        &self,
        file: Option<&str>,
        flags: &[(String, String)],
    ) -> anyhow::Result<SettingsSource> {
        if let (Some(config), Some(file)) = (&self.config, file) {
            anyhow::bail!(
                "--config: {} and {file} are both settings files: give one of them",
                config.display()
            );
        }
        Ok(SettingsSource {
            file: file.map(PathBuf::from).or_else(|| self.config.clone()),
            overrides: [&self.overrides[..], flags].concat(),
        })
    }
}

impl SettingsSource {
    /// Loads and validates the settings, and starts logging as they say.
    pub(super) fn load(&self) -> anyhow::Result<Settings> {
        let settings = self.read()?;
        telemetry::start_logs(&settings.log)?;
        let names = settings::environment().map(|(name, _)| name);
        if let Some(warning) = settings::ignored_variables(names) {
            tracing::warn!("{warning}");
        }
        Ok(settings)
    }

    fn read(&self) -> Result<Settings, SettingsError> {
        settings::load_with(
            self.file.as_deref(),
            settings::environment(),
            &self.overrides,
        )
    }

    /// Reads the settings again, while the log has started.
    pub(super) fn again(&self) -> Result<Settings, ConfigError> {
        self.read().map_err(|error| ConfigError(error.to_string()))
    }
}
