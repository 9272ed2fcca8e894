//! The flags of a single camera.

use std::path::PathBuf;

use clap::{Args, builder::PossibleValuesParser};
use lookdown_detect::parameters::Profile;
use lookdown_watch::{CameraEntry, Transport};
use strum::VariantNames;

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

    /// Returns true if there is a flag that belongs to a single camera.
    pub(super) fn is_given(&self) -> bool {
        *self != Self::default()
    }
}
