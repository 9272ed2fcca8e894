//! RTSP streams and video files through a child process `ffmpeg`, which writes JPEG files to a pipe.
//!
//! The process is killed when its source ends. When this process is killed, the pipe closes, and
//! `ffmpeg` ends with its next frame or its network timeout. The URL of a stream with its
//! credentials is written to the standard input of `ffmpeg`, so it is not in the list of processes.

use std::{
    convert::Infallible,
    fmt::Write as _,
    path::Path,
    process::{ExitStatus, Stdio},
    time::Duration,
};

use bytes::Bytes;
use reqwest::Url;
use secrecy::{ExposeSecret, SecretString};
use tokio::{
    io::{AsyncReadExt, AsyncWriteExt},
    process::{Child, ChildStdout, Command},
};

use super::{Sink, SourceError, jpeg_splitter::JpegSplitter, stderr_line::LastLine};
use crate::{Camera, Credentials, MAX_FRAME_BYTES, VideoOptions, text::one_line};

/// Part of the interval between two frames after which the next frame is taken, so that the frames
/// of a camera are not missed by a rounding of their times.
const EARLY: f64 = 0.98;
/// Most pixels of a frame that `ffmpeg` decodes.
const MAX_PIXELS: &str = "134217728";
/// Protocols of RTSP streams.
const STREAM_PROTOCOLS: &str = "pipe,rtsp,rtsps,rtp,srtp,tcp,udp,tls,crypto";
/// The bytes and the time that `ffmpeg` reads of a stream before its first frame.
const PROBE: [(&str, &str); 2] = [("probesize", "1000000"), ("analyzeduration", "1000000")];

/// A running `ffmpeg`.
struct Ffmpeg {
    child: Child,
    output: ChildStdout,
    errors: LastLine,
    splitter: JpegSplitter,
    secret: Option<SecretString>,
}

impl Ffmpeg {
    /// Starts the process, and writes `script` to its standard input.
    async fn start(
        options: &VideoOptions,
        arguments: &[String],
        script: &str,
    ) -> Result<Self, SourceError> {
        let no_ffmpeg = |problem: String| SourceError::NoFfmpeg {
            program: options.ffmpeg.display().to_string(),
            problem,
        };
        let mut command = Command::new(&options.ffmpeg);
        command
            .args(["-nostdin", "-hide_banner", "-loglevel", "error"])
            .args(["-max_pixels", MAX_PIXELS])
            .args(arguments)
            .args(["-f", "image2pipe", "-c:v", "mjpeg", "-q:v", "3"])
            .args(["-pix_fmt", "yuvj420p", "pipe:1"])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .kill_on_drop(true);
        // Settings of the server may be secret.
        for (name, _) in std::env::vars_os() {
            if name.to_string_lossy().starts_with("LOOKDOWN__") {
                command.env_remove(name);
            }
        }
        let mut child = command
            .spawn()
            .map_err(|error| no_ffmpeg(error.to_string()))?;
        let pipes = (child.stdin.take(), child.stdout.take(), child.stderr.take());
        let (Some(mut input), Some(output), Some(errors)) = pipes else {
            return Err(no_ffmpeg("it has no pipes".to_owned()));
        };
        // A process that ends at once reports its problem on standard error.
        let _ = input.write_all(script.as_bytes()).await;
        Ok(Self {
            child,
            output,
            errors: LastLine::new(errors),
            splitter: JpegSplitter::new(MAX_FRAME_BYTES),
            secret: None,
        })
    }

    /// Returns the next frame, or `None` at the end of the video.
    async fn next_frame(&mut self) -> Result<Option<Bytes>, SourceError> {
        loop {
            if let Some(frame) = self.splitter.next_file() {
                return Ok(Some(frame));
            }
            let read = tokio::select! {
                read = self.output.read_buf(self.splitter.buffer()) => read.unwrap_or(0),
                () = self.errors.read() => continue,
            };
            if read == 0 {
                let line = self.errors.last().await;
                let status = self.child.wait().await.ok();
                return self.end(&line, status);
            }
        }
    }

    fn end(&self, line: &str, status: Option<ExitStatus>) -> Result<Option<Bytes>, SourceError> {
        if status.is_some_and(|status| status.success()) {
            return Ok(None);
        }
        let line = without_credentials(line, self.secret.as_ref());
        let line = line.trim_start_matches("pipe:0: ");
        if line.contains("401 Unauthorized") {
            return Err(SourceError::CredentialsMissing);
        }
        Err(SourceError::Ffmpeg(match (line, status) {
            ("", Some(status)) => status.to_string(),
            (line, _) => line.to_owned(),
        }))
    }
}

/// Reads frames of an RTSP stream until it ends.
pub(super) async fn run_stream(
    camera: &Camera,
    url: &Url,
    sink: &Sink<'_>,
) -> Result<Infallible, SourceError> {
    let video = &camera.video;
    let mut arguments = decoding(video);
    let mut add = |words: &[&str]| arguments.extend(words.iter().map(|&word| word.to_owned()));
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
    let mut ffmpeg = Ffmpeg::start(video, &arguments, &script).await?;
    ffmpeg.secret = camera.credentials.as_ref().map(|c| c.password.clone());
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
    arguments.push("-re".to_owned());
    arguments.extend(file_input(path));
    let filter = first_of_each(camera.every);
    arguments.extend(["-vf", &filter, "-fps_mode", "passthrough"].map(ToOwned::to_owned));
    let mut ffmpeg = Ffmpeg::start(&camera.video, &arguments, "").await?;
    while let Some(frame) = ffmpeg.next_frame().await? {
        sink.accept(frame)?;
    }
    Ok(())
}

/// The frames of a video file at an interval, one after another.
pub struct VideoFrames {
    ffmpeg: Ffmpeg,
    every: Duration,
    count: u32,
}

impl VideoFrames {
    /// Starts to read a file. The interval is rounded to milliseconds.
    ///
    /// # Errors
    /// [`SourceError`] if `ffmpeg` cannot be started.
    pub async fn open(
        path: &Path,
        every: Duration,
        options: &VideoOptions,
    ) -> Result<Self, SourceError> {
        let mut arguments = decoding(options);
        arguments.extend(file_input(path));
        let filter = format!("fps=fps=1000/{}", every.as_millis().max(1));
        arguments.extend(["-vf", &filter].map(ToOwned::to_owned));
        Ok(Self {
            ffmpeg: Ffmpeg::start(options, &arguments, "").await?,
            every,
            count: 0,
        })
    }

    /// Returns the next frame and its position, or `None` at the end of the video.
    ///
    /// # Errors
    /// [`SourceError`] if the file cannot be decoded.
    pub async fn next_frame(&mut self) -> Result<Option<(Duration, Bytes)>, SourceError> {
        let frame = self.ffmpeg.next_frame().await?;
        Ok(frame.map(|frame| {
            let position = self.every * self.count;
            self.count += 1;
            (position, frame)
        }))
    }
}

/// Options of the decoder.
fn decoding(options: &VideoOptions) -> Vec<String> {
    let mut arguments = Vec::new();
    if let Some(method) = &options.hwaccel {
        arguments.extend(["-hwaccel".to_owned(), method.clone()]);
    }
    if options.keyframes_only {
        arguments.extend(["-skip_frame", "nokey"].map(ToOwned::to_owned));
    }
    arguments
}

fn file_input(path: &Path) -> Vec<String> {
    // Other files that a playlist names are not read.
    let input = format!("file:{}", path.display());
    [
        "-protocol_whitelist",
        "file",
        "-i",
        &input,
        "-an",
        "-sn",
        "-dn",
    ]
    .map(ToOwned::to_owned)
    .to_vec()
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

/// Returns a line without the credentials that `ffmpeg` repeats.
fn without_credentials(line: &str, secret: Option<&SecretString>) -> String {
    let mut shown = String::new();
    let mut rest = line;
    while let Some((before, after)) = rest.split_once("://") {
        let end = after.find(['\'', '"', ' ']).unwrap_or(after.len());
        let authority = after[..end].rfind('@').map_or(0, |at| at + 1);
        shown.push_str(before);
        shown.push_str("://");
        rest = &after[authority..];
    }
    shown.push_str(rest);
    if let Some(secret) = secret.filter(|secret| !secret.expose_secret().is_empty()) {
        shown = shown.replace(secret.expose_secret(), "…");
    }
    one_line(&shown)
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

    #[test]
    fn lines_of_ffmpeg_lose_their_credentials() {
        let secret = Some("geheim".into());
        for (line, expected) in [
            (
                "Impossible to open 'rtsp://cam:ge%40heim@10.0.0.8/s1'",
                "Impossible to open 'rtsp://10.0.0.8/s1'",
            ),
            (
                "rtsp://u:p@q@host/a and rtsp://v:w@host",
                "rtsp://host/a and rtsp://host",
            ),
            ("password geheim is wrong", "password … is wrong"),
            (
                "Connection to tcp://127.0.0.1:8555 failed",
                "Connection to tcp://127.0.0.1:8555 failed",
            ),
        ] {
            assert_eq!(without_credentials(line, secret.as_ref()), expected);
        }
    }
}
