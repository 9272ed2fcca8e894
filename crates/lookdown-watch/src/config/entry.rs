//! One camera as it is written, and its checks.

use std::{collections::BTreeMap, path::PathBuf, time::Duration};

use serde::Deserialize;

use crate::{
    Camera, Credentials, Location, OperatingPoints, Transport, VideoOptions,
    operating_point::DEFAULT_EVERY,
};
use lookdown_common::{ConfigError, Secret, optional_duration, read_secret, text::is_camera_name};

/// Shortest interval between two frames.
const MIN_EVERY: Duration = Duration::from_millis(40);
/// Longest interval between two frames.
const MAX_EVERY: Duration = Duration::from_hours(1);
/// Shortest time without a frame after which a source is started again.
const MIN_STALL: Duration = Duration::from_secs(1);
/// Time without a frame after which a source is started again, if none is given, and as a multiple
/// of the interval between two frames.
const DEFAULT_STALL: (Duration, u32) = (Duration::from_secs(10), 3);
/// Parameters that have keys of their own, or that the watcher sets.
const OWN_PARAMETERS: [&str; 7] = [
    "camera",
    "calibration",
    "profile",
    "motion",
    "follow",
    "captured_at",
    "format",
];

/// One camera as it is written in a file or on the command line. Absent values are those of
/// `[camera_defaults]`, or the defaults of the program.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CameraEntry {
    /// The name under which the server keeps the results: the ID of the calibration if absent.
    pub name: Option<String>,
    /// The source of the frames.
    pub url: Option<String>,
    /// The user name of the source.
    pub user: Option<String>,
    /// A file with the password of the source.
    pub password_file: Option<PathBuf>,
    /// The interval between two frames, such as `1s` or `500ms`.
    pub every: Option<String>,
    /// The longest time without a frame, such as `10s`.
    pub stall_after: Option<String>,
    /// The ID of the calibration.
    pub calibration: Option<String>,
    /// The profile.
    pub profile: Option<String>,
    /// Skips views without motion.
    pub motion: Option<bool>,
    /// Follows persons between searches of the whole frame.
    pub follow: Option<bool>,
    /// Further parameters of `/detect`.
    #[serde(default)]
    pub parameters: BTreeMap<String, Scalar>,
    /// The method of hardware decoding.
    pub hwaccel: Option<String>,
    /// The transport of RTSP.
    pub transport: Option<Transport>,
    /// Decodes key frames only.
    pub keyframes_only: Option<bool>,
    /// The program `ffmpeg`.
    pub ffmpeg: Option<PathBuf>,
}

/// A value of a parameter.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(untagged)]
pub enum Scalar {
    /// True or false.
    Flag(bool),
    /// A whole number.
    Whole(i64),
    /// A number.
    Number(f64),
    /// A text.
    Text(String),
}

impl Scalar {
    fn written(&self) -> String {
        match self {
            Self::Flag(flag) => flag.to_string(),
            Self::Whole(number) => number.to_string(),
            Self::Number(number) => number.to_string(),
            Self::Text(text) => text.clone(),
        }
    }
}

impl CameraEntry {
    /// Returns the entry with absent values filled by those of another one.
    pub fn or(self, defaults: &Self) -> Self {
        let mut parameters = defaults.parameters.clone();
        parameters.extend(self.parameters);
        Self {
            name: self.name,
            url: self.url,
            user: self.user.or_else(|| defaults.user.clone()),
            password_file: self
                .password_file
                .or_else(|| defaults.password_file.clone()),
            every: self.every.or_else(|| defaults.every.clone()),
            stall_after: self.stall_after.or_else(|| defaults.stall_after.clone()),
            calibration: self.calibration.or_else(|| defaults.calibration.clone()),
            profile: self.profile.or_else(|| defaults.profile.clone()),
            motion: self.motion.or(defaults.motion),
            follow: self.follow.or(defaults.follow),
            parameters,
            hwaccel: self.hwaccel.or_else(|| defaults.hwaccel.clone()),
            transport: self.transport.or(defaults.transport),
            keyframes_only: self.keyframes_only.or(defaults.keyframes_only),
            ffmpeg: self.ffmpeg.or_else(|| defaults.ffmpeg.clone()),
        }
    }

    /// Checks the entry. `prefix` is the place of the entry for messages. Reads the password file.
    ///
    /// # Errors
    /// [`ConfigError`].
    pub fn check(self, prefix: &str) -> Result<Camera, ConfigError> {
        let field = |key: &str| format!("{prefix}{key}");
        let Some(url) = &self.url else {
            let problem = "the source of the frames is missing: give a URL, a folder or a file";
            return Err(ConfigError::problem(&field("url"), &problem));
        };
        let (location, in_url) =
            Location::parse(url).map_err(|error| ConfigError::problem(&field("url"), &error))?;
        let name = self.checked_name(&field("name"))?;
        let every = optional_duration(
            &field("every"),
            self.every.as_deref(),
            MIN_EVERY..=MAX_EVERY,
        )?;
        let is_stream = matches!(location, Location::Rtsp(_));
        let operating_points = OperatingPoints::new(self.profile.is_some(), every, is_stream);
        let every = every.unwrap_or(DEFAULT_EVERY);
        let stall_after = optional_duration(
            &field("stall_after"),
            self.stall_after.as_deref(),
            MIN_STALL..=MAX_EVERY,
        )?;
        let (least, intervals) = DEFAULT_STALL;
        let stall_after = stall_after.unwrap_or(least.max(every * intervals));
        if stall_after <= every {
            let remedy = "is not longer than the interval between two frames: raise it";
            let written = self.stall_after.unwrap_or_default();
            return Err(ConfigError::value(&field("stall_after"), &written, remedy));
        }
        let credentials = credentials(
            &field(""),
            in_url,
            self.user.clone(),
            self.password_file.clone(),
        )?;
        Ok(Camera {
            parameters: self.checked_parameters(&field("parameters"), &name)?,
            video: self.checked_video(&field("hwaccel"))?,
            name,
            location,
            credentials,
            operating_points,
            stall_after,
        })
    }

    fn checked_name(&self, field: &str) -> Result<String, ConfigError> {
        let Some(name) = self.name.as_ref().or(self.calibration.as_ref()) else {
            let problem = "a name is missing: give a name or a calibration";
            return Err(ConfigError::problem(field, &problem));
        };
        if !is_camera_name(name) {
            let remedy =
                "is not a name of 1 to 128 characters without control and invisible characters";
            return Err(ConfigError::value(field, name, remedy));
        }
        Ok(name.clone())
    }

    fn checked_parameters(
        &self,
        field: &str,
        camera: &str,
    ) -> Result<Vec<(String, String)>, ConfigError> {
        let mut parameters = vec![("camera".to_owned(), camera.to_owned())];
        for (key, value) in [
            ("calibration", &self.calibration),
            ("profile", &self.profile),
        ] {
            parameters.extend(value.clone().map(|value| (key.to_owned(), value)));
        }
        // An empty room then costs its decoding and a comparison, and a walker one crop.
        for (key, value) in [("motion", self.motion), ("follow", self.follow)] {
            parameters.push((key.to_owned(), value.unwrap_or(true).to_string()));
        }
        for (key, value) in &self.parameters {
            if OWN_PARAMETERS.contains(&key.as_str()) {
                let remedy =
                    "does not belong here: it is a key of the camera, or is set for each frame";
                return Err(ConfigError::value(field, key, remedy));
            }
            parameters.push((key.clone(), value.written()));
        }
        Ok(parameters)
    }

    fn checked_video(&self, field: &str) -> Result<VideoOptions, ConfigError> {
        if let Some(method) = &self.hwaccel {
            let is_plain = |c: char| c.is_ascii_alphanumeric() || c == '_';
            if method.is_empty() || !method.chars().all(is_plain) {
                let remedy = "is not a method of `ffmpeg -hwaccels`: use auto, or one of that list";
                return Err(ConfigError::value(field, method, remedy));
            }
        }
        let defaults = VideoOptions::default();
        Ok(VideoOptions {
            ffmpeg: self.ffmpeg.clone().unwrap_or(defaults.ffmpeg),
            hwaccel: self.hwaccel.clone(),
            transport: self.transport.unwrap_or_default(),
            keyframes_only: self.keyframes_only.unwrap_or_default(),
        })
    }
}

fn credentials(
    prefix: &str,
    in_url: Option<Credentials>,
    user: Option<String>,
    password_file: Option<PathBuf>,
) -> Result<Option<Credentials>, ConfigError> {
    match (in_url, user, password_file) {
        (in_url, None, None) => Ok(in_url),
        (None, Some(user), Some(path)) => {
            let password = read_secret(&format!("{prefix}password_file"), &path)?;
            Ok(Some(Credentials { user, password }))
        }
        (None, Some(user), None) => Ok(Some(Credentials {
            user,
            password: Secret::default(),
        })),
        (Some(_), _, _) => Err(ConfigError::problem(
            &format!("{prefix}user"),
            &"the URL has credentials as well: remove them there, or remove user and password_file",
        )),
        (None, None, Some(_)) => Err(ConfigError::problem(
            &format!("{prefix}user"),
            &"it is missing: give the user name for the password_file",
        )),
    }
}

#[cfg(test)]
mod tests;
