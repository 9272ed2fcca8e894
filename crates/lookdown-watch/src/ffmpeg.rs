//! A child process `ffmpeg` that decodes a source and writes JPEG files to a pipe.
//!
//! The process is killed when its source ends. When this process is killed, the pipe closes, and
//! `ffmpeg` ends with its next frame or its network timeout.

use std::{
    ffi::OsString,
    path::Path,
    process::{ExitStatus, Stdio},
};

use bytes::Bytes;
use secrecy::{ExposeSecret, SecretString};
use tokio::{
    io::{AsyncReadExt, AsyncWriteExt},
    process::{Child, ChildStdout, Command},
};

use crate::{
    MAX_FRAME_BYTES, SourceError, VideoOptions, jpeg_splitter::JpegSplitter, stderr_line::LastLine,
};
use lookdown_common::text::one_line;

/// Most pixels of a frame that `ffmpeg` decodes.
const MAX_PIXELS: &str = "134217728";

/// A running `ffmpeg`.
pub(crate) struct Ffmpeg {
    child: Child,
    output: ChildStdout,
    errors: LastLine,
    splitter: JpegSplitter,
    secret: Option<SecretString>,
}

impl Ffmpeg {
    /// Starts the process, and writes `script` to its standard input.
    pub(crate) async fn start(
        options: &VideoOptions,
        arguments: &[OsString],
        script: &str,
        secret: Option<SecretString>,
    ) -> Result<Self, SourceError> {
        let no_ffmpeg = |problem: String| SourceError::NoFfmpeg {
            program: options.ffmpeg.display().to_string(),
            problem,
        };
        let mut command = command(&options.ffmpeg);
        command
            .args(["-max_pixels", MAX_PIXELS])
            .args(arguments)
            // With several threads the encoder holds each frame back until the next one comes.
            .args(["-threads", "1"])
            .args(["-f", "image2pipe", "-c:v", "mjpeg", "-q:v", "3"])
            .args(["-pix_fmt", "yuvj420p", "pipe:1"])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped());
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
            secret,
        })
    }

    /// Returns the next frame, or `None` at the end of the video.
    pub(crate) async fn next_frame(&mut self) -> Result<Option<Bytes>, SourceError> {
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

/// Returns a command that ends with its handle and has no settings of the server, which may be
/// secret.
pub(crate) fn command(ffmpeg: &Path) -> Command {
    let mut command = Command::new(ffmpeg);
    command
        .args(["-nostdin", "-hide_banner", "-loglevel", "error"])
        .kill_on_drop(true);
    for (name, _) in std::env::vars_os() {
        if name.to_string_lossy().starts_with("LOOKDOWN__") {
            command.env_remove(name);
        }
    }
    command
}

/// Options of the decoder.
pub(crate) fn decoding(options: &VideoOptions) -> Vec<OsString> {
    let mut arguments = Vec::new();
    if let Some(method) = &options.hwaccel {
        arguments.extend(["-hwaccel".into(), method.into()]);
    }
    if options.keyframes_only {
        arguments.extend(["-skip_frame", "nokey"].map(OsString::from));
    }
    arguments
}

/// The arguments that read the video of a file.
pub(crate) fn file_input(path: &Path) -> Vec<OsString> {
    // Other files that a playlist names are not read.
    let mut arguments: Vec<OsString> = ["-protocol_whitelist", "file", "-i"]
        .map(Into::into)
        .to_vec();
    arguments.push(file_url(path));
    arguments.extend(["-an", "-sn", "-dn"].map(Into::into));
    arguments
}

/// Returns a path as a URL, so that it is not taken for an option or another protocol.
pub(crate) fn file_url(path: &Path) -> OsString {
    let mut url = OsString::from("file:");
    url.push(path);
    url
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
