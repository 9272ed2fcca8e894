//! RTSP streams and video files in real time, through `ffmpeg`.
//!
//! The URL of a stream with its credentials is written to the standard input of `ffmpeg`, so it is
//! not in the list of processes.

use std::{convert::Infallible, ffi::OsString, fmt::Write as _, path::Path, time::Duration};

use reqwest::Url;
use secrecy::ExposeSecret;

use super::Sink;
use crate::{
    Camera, Credentials, SourceError,
    ffmpeg::{Ffmpeg, decoding, file_input},
};

/// Part of the interval between two frames after which the next frame is taken, so that the frames
/// of a camera are not missed by a rounding of their times.
const EARLY: f64 = 0.98;
/// Protocols of RTSP streams.
const STREAM_PROTOCOLS: &str = "pipe,rtsp,rtsps,rtp,srtp,tcp,udp,tls,crypto";
/// The bytes and the time that `ffmpeg` reads of a stream before its first frame.
const PROBE: [(&str, &str); 2] = [("probesize", "1000000"), ("analyzeduration", "1000000")];

/// Reads frames of an RTSP stream until it ends.
pub(super) async fn run_stream(
    camera: &Camera,
    url: &Url,
    sink: &Sink<'_>,
) -> Result<Infallible, SourceError> {
    let video = &camera.video;
    let mut arguments = decoding(video);
    let mut add = |words: &[&str]| arguments.extend(words.iter().map(OsString::from));
    add(&[
        "-threads",
        "1",
        "-fflags",
        "nobuffer",
        "-flags",
        "low_delay",
    ]);
    for (name, value) in PROBE {
        add(&[&format!("-{name}"), value]);
    }
    add(&[
        "-f",
        "concat",
        "-safe",
        "0",
        "-protocol_whitelist",
        STREAM_PROTOCOLS,
    ]);
    add(&["-i", "pipe:0", "-an", "-sn", "-dn"]);
    add(&[
        "-vf",
        &first_of_each(camera.every),
        "-fps_mode",
        "passthrough",
    ]);
    let script = script(camera, url);
    let secret = camera.credentials.as_ref();
    let secret = secret.map(|credentials| credentials.password.clone());
    let mut ffmpeg = Ffmpeg::start(video, &arguments, &script, secret).await?;
    loop {
        match ffmpeg.next_frame().await {
            // The sink counts damaged frames.
            Ok(Some(frame)) => drop(sink.accept(frame)),
            Ok(None) => return Err(SourceError::Closed),
            Err(error) => return Err(with_user(error, camera.credentials.as_ref())),
        }
    }
}

/// Reads frames of a video file in real time until it ends.
pub(super) async fn run_file(
    camera: &Camera,
    path: &Path,
    sink: &Sink<'_>,
) -> Result<(), SourceError> {
    let mut arguments = decoding(&camera.video);
    arguments.push("-re".into());
    arguments.extend(file_input(path));
    let filter = first_of_each(camera.every);
    arguments.extend(["-vf", &filter, "-fps_mode", "passthrough"].map(OsString::from));
    let mut ffmpeg = Ffmpeg::start(&camera.video, &arguments, "", None).await?;
    while let Some(frame) = ffmpeg.next_frame().await? {
        sink.accept(frame)?;
    }
    Ok(())
}

/// A filter that passes the first frame of each interval. A jump of the camera's clock passes a
/// frame as well.
fn first_of_each(every: Duration) -> String {
    let seconds = every.as_secs_f64() * EARLY;
    format!("select='isnan(prev_selected_t)+gte(abs(t-prev_selected_t)\\,{seconds:.4})'")
}

/// The playlist with the URL and its options (`ffmpeg-formats`, concat).
fn script(camera: &Camera, url: &Url) -> String {
    let mut url = url.clone();
    if let Some(Credentials { user, password }) = &camera.credentials {
        // A URL with a host can have both.
        let _ = url.set_username(user);
        let _ = url.set_password(Some(password.expose_secret()));
    }
    let url = url.as_str().replace('\'', r"'\''");
    let transport = camera.video.transport.name();
    let mut script =
        format!("ffconcat version 1.0\nfile '{url}'\noption rtsp_transport {transport}\n");
    // Microseconds.
    let timeout = camera.stall_after.as_micros();
    let _ = writeln!(script, "option timeout {timeout}");
    for (name, value) in PROBE {
        let _ = writeln!(script, "option {name} {value}");
    }
    script
}

/// Names the user if the camera refuses the credentials.
fn with_user(error: SourceError, credentials: Option<&Credentials>) -> SourceError {
    match (error, credentials) {
        (SourceError::CredentialsMissing, Some(credentials)) => SourceError::CredentialsRefused {
            user: credentials.user.clone(),
        },
        (error, _) => error,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::CameraEntry;

    #[test]
    fn the_password_is_in_the_script_and_quoted() {
        let entry = CameraEntry {
            name: Some("gate".to_owned()),
            url: Some("rtsp://cam:it's%40p@10.0.0.8/s'1".to_owned()),
            stall_after: Some("4s".to_owned()),
            ..CameraEntry::default()
        };
        let camera = entry.check("").unwrap();
        let crate::Location::Rtsp(url) = &camera.location else {
            panic!("it is RTSP")
        };
        let script = script(&camera, url);
        assert!(
            script.contains("it'\\''s%40p@10.0.0.8/s'\\''1'\n"),
            "{script}"
        );
        assert!(script.contains("option timeout 4000000\n"), "{script}");
        assert!(script.contains("option rtsp_transport tcp\n"), "{script}");
    }
}
