//! Videos and standard input of `lookdown detect`: a report for each frame, in order.

use std::{
    io::{self, IsTerminal},
    path::{Path, PathBuf},
    time::Duration,
};

use anyhow::{Context, bail};
use bytes::Bytes;
use lookdown_common::{files::has_ending, parse_duration};
use lookdown_watch::{ImageReader, VideoFrames, VideoOptions, video_duration};
use tokio::runtime::Runtime;

use crate::cli::{async_runtime::for_this_thread, progress::Progress};

/// Endings of video files, in lower case.
const ENDINGS: [&str; 10] = [
    "mp4", "m4v", "mov", "mkv", "webm", "avi", "ts", "mpg", "mpeg", "mjpeg",
];
/// The interval between two frames of a video if none is given.
const DEFAULT_EVERY: Duration = Duration::from_secs(1);

/// A source of several frames.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Stream {
    /// A video file.
    Video(PathBuf),
    /// Standard input.
    StandardInput,
}

/// A frame of a stream.
pub(super) struct StreamFrame {
    /// The name of the frame: the file with the position as a media fragment, or `-` and a number.
    pub name: String,
    pub image: Bytes,
}

impl Stream {
    /// Returns the stream among the paths, if there is one.
    ///
    /// # Errors
    /// Returns an error if there are further paths.
    pub(super) fn among(paths: &[PathBuf]) -> anyhow::Result<Option<Self>> {
        let Some(stream) = paths.iter().find_map(|path| Self::from_path(path)) else {
            return Ok(None);
        };
        if paths.len() > 1 {
            let name = stream.name();
            bail!("{name}: a video or - is read alone: give it without other files");
        }
        Ok(Some(stream))
    }

    fn from_path(path: &Path) -> Option<Self> {
        if path.as_os_str() == "-" {
            return Some(Self::StandardInput);
        }
        is_video(path).then(|| Self::Video(path.to_owned()))
    }

    fn name(&self) -> String {
        match self {
            Self::Video(path) => path.display().to_string(),
            Self::StandardInput => "-".to_owned(),
        }
    }
}

/// Returns true if the ending of a file is that of a video.
pub(in crate::cli) fn is_video(path: &Path) -> bool {
    has_ending(path, &ENDINGS) && (path.is_file() || !path.exists())
}

/// Parses `--every`.
pub(in crate::cli) fn interval(text: &str) -> Result<Duration, String> {
    let limits = Duration::from_millis(10)..=Duration::from_hours(1);
    parse_duration(text, limits)
        .ok_or_else(|| "give a duration from 10ms to 1h, such as 500ms or 2s".to_owned())
}

/// The frames of a stream, read one after another.
pub(super) struct StreamReader {
    pub(super) runtime: Runtime,
    frames: Frames,
    name: String,
    pub(super) every: Duration,
    pub(super) progress: Option<Progress>,
}

enum Frames {
    Video(Box<VideoFrames>),
    StandardInput {
        images: ImageReader<tokio::io::Stdin>,
        count: u64,
    },
}

impl StreamReader {
    /// Opens a stream.
    ///
    /// # Errors
    /// Returns an error if `ffmpeg` is missing.
    pub(super) fn open(stream: &Stream, every: Option<Duration>) -> anyhow::Result<Self> {
        let runtime = for_this_thread()?;
        let name = stream.name();
        let options = VideoOptions::default();
        let every = every.unwrap_or(DEFAULT_EVERY);
        let mut progress = None;
        let frames = match stream {
            Stream::Video(path) => {
                let frames = VideoFrames::open(path, every, &options);
                let frames = runtime.block_on(frames)?;
                // On a terminal the reports themselves show the progress.
                if !io::stdout().is_terminal() {
                    let duration = runtime.block_on(video_duration(path, &options));
                    progress = duration.map(|duration| {
                        let total = duration.as_millis().div_ceil(every.as_millis().max(1));
                        Progress::start(&name, usize::try_from(total).unwrap_or(usize::MAX))
                    });
                }
                Frames::Video(Box::new(frames))
            }
            Stream::StandardInput => Frames::StandardInput {
                images: ImageReader::new(tokio::io::stdin()),
                count: 0,
            },
        };
        Ok(Self {
            runtime,
            frames,
            name,
            every,
            progress,
        })
    }

    /// Returns the next frame, or `None` at the end.
    ///
    /// # Errors
    /// Returns an error if the stream cannot be decoded further.
    pub(super) fn next_frame(&mut self) -> anyhow::Result<Option<StreamFrame>> {
        let name = &self.name;
        let next = match &mut self.frames {
            Frames::Video(frames) => {
                let next = self.runtime.block_on(frames.next_frame());
                let next = next.with_context(|| name.clone())?;
                next.map(|(position, image)| (format!("t={:.3}", position.as_secs_f64()), image))
            }
            Frames::StandardInput { images, count } => {
                *count += 1;
                let next = self.runtime.block_on(images.next_image());
                let next = next.with_context(|| name.clone())?;
                next.map(|image| (count.to_string(), image))
            }
        };
        Ok(next.map(|(place, image)| StreamFrame {
            name: format!("{name}#{place}"),
            image,
        }))
    }

    /// Ends the reader. A read of standard input may never end, so it is not waited for.
    pub(super) fn end(self) {
        drop(self.frames);
        self.runtime.shutdown_background();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn videos_and_standard_input_are_read_alone() {
        let among = |paths: &[&str]| {
            let paths: Vec<_> = paths.iter().map(PathBuf::from).collect();
            Stream::among(&paths).map_err(|error| error.to_string())
        };
        assert_eq!(among(&["a.jpg", "folder"]), Ok(None));
        assert_eq!(among(&["-"]), Ok(Some(Stream::StandardInput)));
        let clip = Stream::Video("clip.MP4".into());
        assert_eq!(among(&["clip.MP4"]), Ok(Some(clip)));
        assert!(among(&["clip.mp4", "a.jpg"]).unwrap_err().contains("alone"));
    }

    #[test]
    fn intervals_have_a_unit_and_limits() {
        assert_eq!(interval("500ms"), Ok(Duration::from_millis(500)));
        assert_eq!(interval("2s"), Ok(Duration::from_secs(2)));
        for wrong in ["", "2", "1ms", "2h", "-1s"] {
            assert!(interval(wrong).is_err(), "{wrong}");
        }
    }
}
