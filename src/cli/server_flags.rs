//! The flags of the companions for the server that they are clients of.
//!
//! The flags of a single camera.

use std::{path::PathBuf, time::Duration};

use anyhow::{Context, anyhow, bail, ensure};
use clap::{Args, builder::PossibleValuesParser};
use lookdown_common::{ServerClient, ServerEntry, read_body};
use lookdown_detect::parameters::Profile;
use lookdown_watch::{CameraEntry, Transport};
use serde::de::DeserializeOwned;
use strum::VariantNames;
use url::Url;

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
