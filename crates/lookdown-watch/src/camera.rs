//! The checked settings of one camera.

use std::{path::PathBuf, time::Duration};

use crate::{Credentials, Location, operating_point::OperatingPoints};

/// The settings of one camera.
#[derive(Debug, Clone, PartialEq)]
pub struct Camera {
    /// The name under which the server keeps the results.
    pub name: String,
    /// The source of the frames.
    pub location: Location,
    /// The user name and the password of the source.
    pub credentials: Option<Credentials>,
    /// The profiles and the intervals between two frames that are sent.
    pub operating_points: OperatingPoints,
    /// The longest time without a frame, after which the source is started again.
    pub stall_after: Duration,
    /// The parameters of `/detect` except the time of capture.
    pub parameters: Vec<(String, String)>,
    /// Options of `ffmpeg`.
    pub video: VideoOptions,
}

impl Camera {
    /// Returns the shortest interval between two frames that are sent.
    pub fn every(&self) -> Duration {
        self.operating_points.shortest_interval()
    }

    /// Returns the value of a parameter of `/detect`, if the camera has one.
    pub fn parameter(&self, name: &str) -> Option<&str> {
        let mut parameters = self.parameters.iter();
        let (_, value) = parameters.find(|(known, _)| known == name)?;
        Some(value)
    }
}

/// Options of `ffmpeg`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct VideoOptions {
    /// The program.
    pub ffmpeg: PathBuf,
    /// The method of hardware decoding, such as `auto`, `vaapi` or `cuda`.
    pub hwaccel: Option<String>,
    /// The transport of RTSP.
    pub transport: Transport,
    /// Decodes key frames only. That saves most of the decoding, but frames are as far apart as the
    /// key frames of the camera.
    pub keyframes_only: bool,
}

impl Default for VideoOptions {
    fn default() -> Self {
        Self {
            ffmpeg: "ffmpeg".into(),
            hwaccel: None,
            transport: Transport::default(),
            keyframes_only: false,
        }
    }
}

/// The transport of RTSP.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, serde::Deserialize, strum::IntoStaticStr)]
#[serde(rename_all = "lowercase")]
#[strum(serialize_all = "lowercase")]
pub enum Transport {
    /// Over the connection of RTSP: works through firewalls, and loses no packets.
    #[default]
    Tcp,
    /// Separate datagrams.
    Udp,
}
