//! Video files that are read and written frame by frame, not in real time.

use std::{ffi::OsString, path::Path, process::Stdio, time::Duration};

use bytes::Bytes;
use jiff::Timestamp;
use tokio::{
    io::AsyncWriteExt,
    process::{Child, ChildStdin},
    time::timeout,
};

use crate::{
    SourceError, VideoOptions,
    child::{self, Task},
    ffmpeg::{Ffmpeg, Input, LastLine, command, decoding, file_input, file_restrictions, file_url},
};

/// Longest duration of a recording, a year: a header with a longer one is damaged.
const MAX_DURATION: Duration = Duration::from_hours(24 * 366);
/// Longest time to read the duration of a file.
const DURATION_TIMEOUT: Duration = Duration::from_secs(10);

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
        arguments.extend(["-vf", &filter].map(OsString::from));
        Ok(Self {
            ffmpeg: Ffmpeg::start(options, &arguments, Input::File, 0).await?,
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

/// Returns the duration of a video file, if `ffprobe` can read it.
pub async fn video_duration(path: &Path, options: &VideoOptions) -> Option<Duration> {
    let seconds = probed(path, "format=duration", options).await?;
    let duration = Duration::try_from_secs_f64(seconds.parse().ok()?).ok()?;
    (duration <= MAX_DURATION).then_some(duration)
}

/// Returns the time at which a video file says that it was created.
pub async fn video_created_at(path: &Path, options: &VideoOptions) -> Option<Timestamp> {
    let created_at = probed(path, "format_tags=creation_time", options).await?;
    created_at.parse().ok()
}

/// Returns a value that `ffprobe` reads from a file.
async fn probed(path: &Path, entry: &str, options: &VideoOptions) -> Option<String> {
    let mut command = child::command(options.ffmpeg.with_file_name("ffprobe"));
    command
        .args(["-v", "error"])
        .args(file_restrictions())
        .args(["-show_entries", entry, "-of", "csv=p=0"])
        .arg(file_url(path))
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::null());
    let child = child::spawn(&mut command, Task::Decode).ok()?;
    let output = timeout(DURATION_TIMEOUT, child.wait_with_output())
        .await
        .ok()?
        .ok()?;
    let value = String::from_utf8(output.stdout).ok()?.trim().to_owned();
    (!value.is_empty()).then_some(value)
}

/// A video file that is written frame by frame.
pub struct VideoWriter {
    child: Child,
    input: ChildStdin,
    errors: LastLine,
}

impl VideoWriter {
    /// Starts to write a file, with this interval between two frames. Its name decides the format.
    /// An existing file is replaced.
    ///
    /// # Errors
    /// [`SourceError`] if `ffmpeg` cannot be started.
    pub fn create(
        path: &Path,
        every: Duration,
        options: &VideoOptions,
    ) -> Result<Self, SourceError> {
        let no_ffmpeg = |problem: String| SourceError::NoFfmpeg {
            program: options.ffmpeg.display().to_string(),
            problem,
        };
        let rate = format!("1000/{}", every.as_millis().max(1));
        let mut command = command(&options.ffmpeg);
        command
            .args([
                "-y",
                "-f",
                "image2pipe",
                "-c:v",
                "mjpeg",
                "-framerate",
                &rate,
            ])
            .args(["-i", "pipe:0", "-pix_fmt", "yuv420p"])
            // Most formats need even sides.
            .args(["-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2"])
            .arg(file_url(path))
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            .stderr(Stdio::piped());
        let mut child = child::spawn(&mut command, Task::Encode)
            .map_err(|error| no_ffmpeg(error.to_string()))?;
        let (Some(input), Some(errors)) = (child.stdin.take(), child.stderr.take()) else {
            return Err(no_ffmpeg("it has no pipes".to_owned()));
        };
        Ok(Self {
            child,
            input,
            errors: LastLine::new(errors),
        })
    }

    /// Appends a JPEG.
    ///
    /// # Errors
    /// [`SourceError`] with the last line of `ffmpeg` if it has ended.
    pub async fn write(&mut self, jpeg: &[u8]) -> Result<(), SourceError> {
        let written = tokio::select! {
            written = self.input.write_all(jpeg) => written,
            () = drain(&mut self.errors) => Ok(()),
        };
        match written {
            Ok(()) => Ok(()),
            Err(_) => Err(SourceError::Ffmpeg(self.errors.last().await)),
        }
    }

    /// Completes the file.
    ///
    /// # Errors
    /// [`SourceError`] with the last line of `ffmpeg` if the file cannot be written.
    pub async fn finish(mut self) -> Result<(), SourceError> {
        drop(self.input);
        let status = loop {
            tokio::select! {
                status = self.child.wait() => break status,
                () = self.errors.read() => {}
            }
        };
        if status.is_ok_and(|status| status.success()) {
            return Ok(());
        }
        Err(SourceError::Ffmpeg(self.errors.last().await))
    }
}

/// Reads what `ffmpeg` reports. Never ends.
async fn drain(errors: &mut LastLine) {
    loop {
        errors.read().await;
    }
}
