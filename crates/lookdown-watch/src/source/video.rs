//! RTSP streams and video files in real time, through `ffmpeg`.
//!
//! `ffmpeg` reads a stream through a relay, whose URL is written to its standard input, so it is
//! not in the list of processes.

use std::{convert::Infallible, ffi::OsString, fmt::Write as _, path::Path, time::Duration};

use reqwest::Url;

use super::sink::Sink;
use crate::{
    Camera, SourceError,
    credentials::Login,
    ffmpeg::{Ffmpeg, Input, decoding, file_input},
    rtsp_relay::Relay,
};

/// Part of the interval between two frames after which the next frame is taken, so that the frames
/// of a camera are not missed by a rounding of their times.
const EARLY: f64 = 0.98;
/// Protocols of RTSP streams through the relay.
const STREAM_PROTOCOLS: &str = "pipe,rtsp,rtp,tcp,udp";
/// Formats of the playlist and of the streams in it.
const STREAM_FORMATS: &str = "concat,rtsp";
/// The bytes and the time that `ffmpeg` reads of a stream before its first frame.
const PROBE: [(&str, &str); 2] = [("probesize", "1000000"), ("analyzeduration", "1000000")];

/// Reads frames of an RTSP stream until it ends: one of each interval, and all while it has
/// viewers.
pub(super) async fn run_stream(
    camera: &Camera,
    url: &Url,
    login: &mut Login,
    sink: &Sink<'_>,
) -> Result<Infallible, SourceError> {
    loop {
        let has_viewers = sink.metrics.has_viewers();
        let every = (!has_viewers).then(|| camera.every());
        tokio::select! {
            ended = read_stream(camera, url, every, login, sink) => match ended {
                Err(SourceError::TooLarge) if sink.falls_back_to_files() => login.restart(),
                ended => return ended,
            },
            () = sink.metrics.viewers_changed(has_viewers) => login.restart(),
        }
    }
}

async fn read_stream(
    camera: &Camera,
    url: &Url,
    every: Option<Duration>,
    login: &mut Login,
    sink: &Sink<'_>,
) -> Result<Infallible, SourceError> {
    let relay = Relay::connect(url, camera.stall_after).await?;
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
        "-format_whitelist",
        STREAM_FORMATS,
    ]);
    add(&["-i", "pipe:0", "-an", "-sn", "-dn"]);
    if let Some(every) = every {
        add(&["-vf", &first_of_each(every)]);
    }
    add(&["-fps_mode", "passthrough"]);
    let script = script(camera, relay.url());
    let input = Input::Stream {
        script: &script,
        relay: relay.url().to_owned(),
        camera: camera.location.to_string(),
    };
    let mut ffmpeg = Ffmpeg::start(video, &arguments, input, sink.most_pixel_bytes()).await?;
    let frames = async {
        loop {
            match ffmpeg.next_frame().await {
                // The sink counts damaged frames.
                Ok(Some(frame)) => drop(sink.accept(frame)),
                Ok(None) => return SourceError::Closed,
                Err(error) => return error,
            }
        }
    };
    Err(tokio::select! {
        biased;
        error = relay.run(login) => error,
        error = frames => error,
    })
}

/// Reads frames of a video file in real time until it ends.
pub(super) async fn run_file(
    camera: &Camera,
    path: &Path,
    sink: &Sink<'_>,
) -> Result<(), SourceError> {
    match read_file(camera, path, sink).await {
        Err(SourceError::TooLarge) if sink.falls_back_to_files() => {
            read_file(camera, path, sink).await
        }
        ended => ended,
    }
}

async fn read_file(camera: &Camera, path: &Path, sink: &Sink<'_>) -> Result<(), SourceError> {
    let mut arguments = decoding(&camera.video);
    arguments.push("-re".into());
    arguments.extend(file_input(path));
    // A file cannot continue with another rate.
    if !sink.metrics.has_viewers() {
        arguments.extend(["-vf", &first_of_each(camera.every())].map(OsString::from));
    }
    arguments.extend(["-fps_mode", "passthrough"].map(OsString::from));
    let most_pixel_bytes = sink.most_pixel_bytes();
    let mut ffmpeg =
        Ffmpeg::start(&camera.video, &arguments, Input::File, most_pixel_bytes).await?;
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

/// The playlist with the URL of the relay and its options (`ffmpeg-formats`, concat).
fn script(camera: &Camera, url: &str) -> String {
    let transport: &str = camera.video.transport.into();
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::CameraEntry;

    #[test]
    fn the_script_has_the_relay_and_no_password() {
        let entry = CameraEntry {
            name: Some("gate".to_owned()),
            url: Some("rtsp://cam:secret@10.0.0.8/s1".to_owned()),
            stall_after: Some("4s".to_owned()),
            ..CameraEntry::default()
        };
        let camera = entry.check("").unwrap();
        let script = script(&camera, "rtsp://127.0.0.1:5/token");
        assert!(
            script.contains("file 'rtsp://127.0.0.1:5/token'\n"),
            "{script}"
        );
        assert!(script.contains("option timeout 4000000\n"), "{script}");
        assert!(script.contains("option rtsp_transport tcp\n"), "{script}");
        assert!(
            !script.contains("secret") && !script.contains("10.0.0.8"),
            "{script}"
        );
    }
}
