//! A child process `ffmpeg` that decodes a source and writes its frames to a pipe.
//!
//! The process is killed when its source ends. When this process is killed, the pipe closes, and
//! `ffmpeg` ends with its next frame or its network timeout.

use std::{
    ffi::OsString,
    path::Path,
    process::{ExitStatus, Stdio},
};

use bytes::Bytes;
use lookdown_common::text::one_line;
use rustix::pipe::fcntl_setpipe_size;
use tokio::{
    io::{AsyncReadExt, AsyncWriteExt},
    process::{Child, ChildStderr, ChildStdout, Command},
    time::{Duration, Interval, interval, timeout},
};

use crate::{
    MAX_FRAME_BYTES, SourceError, VideoOptions,
    child::{self, Task, USAGE_INTERVAL, Usage},
    image_splitter::ImageSplitter,
    memory_budget::Reservation,
};

/// Most pixels of a frame that `ffmpeg` decodes: those that the server accepts.
const MAX_PIXELS: &str = "50000000";
/// Protocols of video files.
const FILE_PROTOCOLS: &str = "file";
/// Formats of video files. Playlists are not among them: they name other files.
const FILE_FORMATS: &str = "mov,matroska,avi,mpegts,mpeg,mpegvideo,flv,asf,ogg,ivf,obu,h264,hevc,\
                            m4v,mjpeg,mxf,nut,dhav,gif";
/// The encoder of JPEG files. With tables of Huffman codes for each file, `ffmpeg` takes 1.2 times
/// as long for .93 times the bytes.
const JPEG_ENCODER: &[&str] = &[
    "-c:v", "mjpeg", "-q:v", "3", "-huffman", "default", "-pix_fmt", "yuvj420p",
];
/// The encoder of pixels.
const PPM_ENCODER: &[&str] = &["-c:v", "ppm", "-pix_fmt", "rgb24"];
/// Bytes in the pipe of pixels, the most that Linux gives to each user. With its usual 64 KiB both
/// processes are woken 43 times for a frame of 960².
const PIPE_BYTES: usize = 1 << 20;
/// Threads of the decoder of a file. Each holds frames in memory.
const FILE_THREADS: usize = 8;
/// The last words of `ffmpeg` about a file whose format is not in the list.
const REFUSED_FORMAT: &str = "Invalid argument";

/// A running `ffmpeg`.
pub(crate) struct Ffmpeg {
    child: Child,
    output: ChildStdout,
    errors: LastLine,
    splitter: ImageSplitter,
    /// The memory of the splitter.
    memory: Reservation,
    /// The memory and the CPU time of the process.
    usage: Usage,
    checks: Interval,
    /// The URL of the relay, and the camera that errors show instead.
    shown: Option<(String, String)>,
}

/// The input of `ffmpeg`.
pub(crate) enum Input<'a> {
    /// A file, which the arguments name.
    File,
    /// A stream, which a script names.
    Stream {
        /// The script for standard input.
        script: &'a str,
        /// The URL of the relay.
        relay: String,
        /// The camera, for messages.
        camera: String,
    },
}

impl Ffmpeg {
    /// Starts the process. It writes JPEG files, or pixels as PPM if `most_pixel_bytes` is above 0,
    /// the most of a frame. Pixels save the encoder and the decoder of JPEG.
    pub(crate) async fn start(
        options: &VideoOptions,
        arguments: &[OsString],
        input: Input<'_>,
        most_pixel_bytes: usize,
    ) -> Result<Self, SourceError> {
        let (encoder, splitter) = match most_pixel_bytes {
            0 => (JPEG_ENCODER, ImageSplitter::new(MAX_FRAME_BYTES)),
            most => (PPM_ENCODER, ImageSplitter::for_pixels(most)),
        };
        let no_ffmpeg = |problem: String| SourceError::NoFfmpeg {
            program: options.ffmpeg.display().to_string(),
            problem,
        };
        let mut command = command(&options.ffmpeg);
        command
            .args(["-max_pixels", MAX_PIXELS])
            .args(arguments)
            // With several threads the encoder holds each frame back until the next one comes.
            .args(["-threads", "1", "-f", "image2pipe"])
            .args(encoder)
            .arg("pipe:1")
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped());
        let mut child = child::spawn(&mut command, Task::Decode)
            .map_err(|error| no_ffmpeg(error.to_string()))?;
        let usage = Usage::for_process(child.id().unwrap_or_default());
        let pipes = (child.stdin.take(), child.stdout.take(), child.stderr.take());
        let (Some(mut pipe), Some(output), Some(errors)) = pipes else {
            return Err(no_ffmpeg("it has no pipes".to_owned()));
        };
        if most_pixel_bytes > 0 {
            // Where the user has too many such pipes, it stays as it is.
            let _ = fcntl_setpipe_size(&output, PIPE_BYTES);
        }
        let shown = match input {
            Input::File => None,
            Input::Stream {
                script,
                relay,
                camera,
            } => {
                // A process that ends at once reports its problem on standard error.
                let _ = pipe.write_all(script.as_bytes()).await;
                Some((relay, camera))
            }
        };
        Ok(Self {
            child,
            output,
            errors: LastLine::new(errors),
            splitter,
            memory: Reservation::default(),
            usage,
            checks: interval(USAGE_INTERVAL),
            shown,
        })
    }

    /// Returns the next frame, or `None` at the end of the video.
    pub(crate) async fn next_frame(&mut self) -> Result<Option<Bytes>, SourceError> {
        loop {
            if let Some(frame) = self.splitter.next_file() {
                return Ok(Some(frame));
            }
            if self.splitter.has_skipped_pixels {
                return Err(SourceError::TooLarge);
            }
            self.memory
                .resize(self.splitter.buffered())
                .map_err(|_| SourceError::Memory)?;
            let read = tokio::select! {
                read = self.output.read_buf(self.splitter.buffer()) => read.unwrap_or(0),
                () = self.errors.read() => continue,
                _ = self.checks.tick() => {
                    // The decoder of a file works as fast as it can.
                    if self.shown.is_some() {
                        self.usage.check()?;
                    }
                    continue;
                }
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
        let line = match &self.shown {
            Some((relay, camera)) => line.replace(relay, camera),
            None => line.to_owned(),
        };
        let line = one_line(&line);
        let line = line.trim_start_matches("pipe:0: ");
        if line.contains(REFUSED_FORMAT) && self.shown.is_none() {
            return Err(SourceError::NotAVideo);
        }
        Err(SourceError::Ffmpeg(match (line, status) {
            ("", Some(status)) => status.to_string(),
            (line, _) => line.to_owned(),
        }))
    }
}

/// Returns a command that starts `ffmpeg` without questions.
pub(crate) fn command(ffmpeg: &Path) -> Command {
    let mut command = child::command(ffmpeg);
    command.args(["-nostdin", "-hide_banner", "-loglevel", "error"]);
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
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let mut arguments: Vec<OsString> = file_restrictions().map(Into::into).to_vec();
    arguments.push("-threads".into());
    arguments.push(threads.min(FILE_THREADS).to_string().into());
    arguments.extend(["-i".into(), file_url(path)]);
    arguments.extend(["-an", "-sn", "-dn"].map(Into::into));
    arguments
}

/// The arguments that make `ffmpeg` and `ffprobe` read no other file than the given one.
pub(crate) fn file_restrictions() -> [&'static str; 4] {
    [
        "-protocol_whitelist",
        FILE_PROTOCOLS,
        "-format_whitelist",
        FILE_FORMATS,
    ]
}

/// Returns a path as a URL, so that it is not taken for an option or another protocol.
pub(crate) fn file_url(path: &Path) -> OsString {
    let mut url = OsString::from("file:");
    url.push(path);
    url
}

/// Most bytes of a line that are kept.
const MAX_BYTES: usize = 1000;
/// Longest time to wait for the last line after the output has ended.
const LAST_WORDS: Duration = Duration::from_secs(1);

/// The last line of standard error, as far as it was read.
pub(crate) struct LastLine {
    stderr: ChildStderr,
    line: Vec<u8>,
    is_ended: bool,
    is_complete: bool,
}

impl LastLine {
    pub(crate) fn new(stderr: ChildStderr) -> Self {
        Self {
            stderr,
            line: Vec::new(),
            is_ended: false,
            is_complete: false,
        }
    }

    /// Reads further text. Never ends after the end of the text. May be cancelled.
    pub(crate) async fn read(&mut self) {
        if self.is_ended {
            std::future::pending::<()>().await;
        }
        let mut bytes = [0; 512];
        match self.stderr.read(&mut bytes).await {
            Ok(0) | Err(_) => self.is_ended = true,
            Ok(count) => self.push(&bytes[..count]),
        }
    }

    fn push(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            if byte == b'\n' || byte == b'\r' {
                self.is_complete = true;
                continue;
            }
            if std::mem::take(&mut self.is_complete) {
                self.line.clear();
            }
            if self.line.len() < MAX_BYTES {
                self.line.push(byte);
            }
        }
    }

    /// Reads the rest, and returns the last line. The wait for the rest is bounded, so a child that
    /// still runs is not waited for.
    pub(crate) async fn last(&mut self) -> String {
        let rest = async {
            while !self.is_ended {
                self.read().await;
            }
        };
        // A child that keeps its standard error open loses its last line.
        let _ = timeout(LAST_WORDS, rest).await;
        one_line(&String::from_utf8_lossy(&self.line))
    }
}
