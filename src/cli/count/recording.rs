//! Counting of recordings: as fast as the machine can, without a server.

use std::{
    fs,
    num::NonZeroU32,
    path::{Path, PathBuf},
    process::ExitCode,
    sync::Arc,
    thread,
    time::{Duration, Instant, UNIX_EPOCH},
};

use anyhow::{Context, bail};
use bytes::Bytes;
use clap::Args;
use jiff::Timestamp;
use lookdown_calibration::Calibration;
use lookdown_count::Recording;
use lookdown_detect::{
    parameters::DetectParameters,
    pipeline::{DetectJob, DetectedFrame, Engine, JobImage},
};
use lookdown_watch::{VideoFrames, VideoOptions, video_created_at, video_duration};
use tokio::runtime::Runtime;

use crate::{
    annotated_image::AnnotationOptions,
    api::to_report,
    app::engine_for,
    cli::{
        SettingsFile,
        annotate::AnnotatedVideo,
        async_runtime::for_this_thread,
        detect::stream::{interval, is_video},
        parameters::{ParameterFlags, named_calibration},
        progress::{Progress, write_or_print},
        server_flags::given,
    },
};

/// The interval between two frames if none is given: the figures of docs/lab/count-accuracy.md are
/// reached with it.
const DEFAULT_EVERY: Duration = Duration::from_millis(200);
/// The score threshold of counted frames (docs/count.md).
const SCORE_THRESHOLD: (&str, &str) = (DetectParameters::SCORE_THRESHOLD, "0.06");
/// The help of this flag, whose default is not that of other commands.
const THRESHOLD_HELP: &str = "Minimum score of a person in a recording: counts weigh lower scores \
                              themselves [default: 0.06]";

/// Flags of recordings.
#[derive(Debug, Default, PartialEq, Args)]
#[group(id = "recording_flags", multiple = true)]
#[command(mut_arg(SCORE_THRESHOLD.0, |flag| flag.help(THRESHOLD_HELP).long_help(THRESHOLD_HELP)))]
pub(super) struct RecordingFlags {
    /// The calibration of the recordings: a file, or the ID of one in the calibration folder
    #[arg(long, value_name = "FILE|ID")]
    calibration: Option<String>,
    /// The time of the first frame, such as 2026-11-22T09:00:00Z [default: that of the file]
    #[arg(long, value_name = "TIME")]
    start: Option<Timestamp>,
    /// The interval between two frames of a recording [default: 200ms]
    #[arg(long, value_name = "DURATION", value_parser = interval)]
    every: Option<Duration>,
    /// Write the counts of the recordings as CSV [default: to standard output]
    #[arg(long, value_name = "FILE.csv")]
    csv: Option<PathBuf>,
    /// The minutes of a row of the CSV [default: 15]
    #[arg(long, value_name = "MINUTES")]
    step_minutes: Option<NonZeroU32>,
    /// Also draw the persons and zones into a video
    #[arg(long, value_name = "OUT.mp4")]
    annotate: Option<PathBuf>,
    #[command(flatten)]
    parameters: ParameterFlags,
}

impl RecordingFlags {
    /// Returns true if a flag is given that has no meaning without a recording.
    pub(super) fn is_given(&self) -> bool {
        *self != Self::default()
    }
}

/// A recording and the time of its first frame.
struct Clip {
    path: PathBuf,
    start: Timestamp,
    duration: Option<Duration>,
}

/// Everything that counts the frames.
struct Counting<'a> {
    runtime: Runtime,
    engine: Engine,
    parameters: DetectParameters,
    calibration: Option<Arc<Calibration>>,
    recording: Recording,
    every: Duration,
    /// Frames that are processed at the same time.
    at_once: usize,
    video: Option<AnnotatedVideo<'a>>,
    drawing: AnnotationOptions,
    progress: Progress,
}

/// Counts recordings in their order, into the file `store` or that of the settings.
pub(super) fn run(
    files: &[PathBuf],
    flags: &RecordingFlags,
    store: Option<&str>,
    settings_file: &SettingsFile,
) -> anyhow::Result<ExitCode> {
    if let Some(other) = files.iter().find(|file| !is_video(file)) {
        let other = other.display();
        bail!(
            "{other}: it is not a recording: give one settings file, or recordings such as clip.mp4"
        );
    }
    let own = given(&[("counts.path", store)]);
    let settings = settings_file.load_with(&own)?;
    let named = flags.calibration.as_deref();
    let calibration = named.map(|named| named_calibration(named, &settings));
    let calibration = calibration.transpose()?;
    let id = calibration.as_ref().map(|found| found.id().as_str());
    let parameters = flags.parameters.check_or(id, SCORE_THRESHOLD)?;
    let camera = match (&parameters.camera, id, files) {
        (Some(camera), ..) => camera.clone(),
        (None, Some(id), _) => id.to_owned(),
        (None, None, files) => files.first().map(|file| stem(file)).unwrap_or_default(),
    };
    let runtime = for_this_thread()?;
    let clips = clips(files, flags.start, &runtime)?;
    let (Some(first), Some(last)) = (clips.first(), clips.last()) else {
        bail!("there is no recording: give a video such as clip.mp4");
    };
    let counts = &settings.counts;
    let recording = Recording::open(
        &counts.path,
        counts.longest_gap,
        &camera,
        calibration.clone(),
    )?;
    let every = flags.every.unwrap_or(DEFAULT_EVERY);
    let counted_already = |until: Timestamp| {
        anyhow::anyhow!(
            "--store: {} has counts of {camera} up to {until}, the end of the recordings: they are \
             counted already, or give another --store",
            counts.path.display()
        )
    };
    let until = recording.counted_until();
    let until = until.filter(|until| *until >= first.start);
    if let Some(until) = until {
        if until + every >= last.start + last.duration.unwrap_or_default() {
            return Err(counted_already(until));
        }
        tracing::info!("continuing after {until}: earlier frames are counted already");
    }
    let video = match &flags.annotate {
        Some(path) => Some(AnnotatedVideo::create(path, every, &runtime)?),
        None => None,
    };
    let engine = engine_for(&settings, std::slice::from_ref(&parameters))?;
    let frames = clips.iter().filter_map(|clip| clip.duration);
    let frames: u128 = frames
        .map(|duration| duration.as_millis().div_ceil(every.as_millis().max(1)))
        .sum();
    let started = Instant::now();
    let mut counting = Counting {
        runtime,
        engine,
        parameters,
        calibration,
        recording,
        every,
        at_once: settings.threads.frame_workers.get(),
        video,
        drawing: AnnotationOptions::parse([])?,
        progress: Progress::start(&camera, usize::try_from(frames).unwrap_or(usize::MAX)),
    };
    let mut end = last.start;
    for clip in &clips {
        end = counting.count(clip)?;
    }
    let span = (first.start, end);
    let recording = counting.finish()?;
    if let Some(until) = until.filter(|_| !recording.has_counted()) {
        return Err(counted_already(until));
    }
    let step = flags.step_minutes.map_or(15, NonZeroU32::get);
    let csv = recording.csv(span, step)?;
    let csv = csv.context("--step-minutes: the CSV has too many values: give a longer step")?;
    write_or_print("--csv", flags.csv.as_deref(), &csv)?;
    let crossings = recording.lines().into_iter();
    let crossings =
        crossings.map(|line| format!("{} {} {}", line.line, line.direction, line.crossings));
    tracing::info!(
        "{camera}: {:.0} s of video in {:.0} s; crossings in the store: {}",
        (end.duration_since(first.start)).as_secs_f64(),
        started.elapsed().as_secs_f64(),
        crossings.collect::<Vec<_>>().join(", ")
    );
    Ok(ExitCode::SUCCESS)
}

impl Counting<'_> {
    /// Counts the frames of a recording, and returns the time of its end.
    fn count(&mut self, clip: &Clip) -> anyhow::Result<Timestamp> {
        let name = clip.path.display().to_string();
        // The store has microseconds, the time of a file nanoseconds.
        let counted_until = self.recording.counted_until();
        let counted_until = counted_until.map(Timestamp::as_microsecond);
        let options = VideoOptions::default();
        let frames = VideoFrames::open(&clip.path, self.every, &options);
        let mut frames = self.runtime.block_on(frames)?;
        let mut end = clip.start;
        loop {
            let mut images = Vec::new();
            while images.len() < self.at_once {
                let next = self.runtime.block_on(frames.next_frame());
                let Some((position, image)) = next.with_context(|| name.clone())? else {
                    break;
                };
                let at = clip.start + position;
                end = at + self.every;
                if counted_until.is_some_and(|until| at.as_microsecond() <= until) {
                    self.progress.advance();
                } else {
                    images.push((at, image));
                }
            }
            if images.is_empty() {
                return Ok(end);
            }
            for (at, mut detected) in self.detect(&name, images)? {
                let report = serde_json::to_vec(&to_report(&detected.report))?;
                self.recording.count(at, &report)?;
                if let Some(video) = &mut self.video {
                    // From 0.06 on, most persons are none. Those who are followed make the counts.
                    let followed = self.recording.followed(at);
                    let mut index = 0..;
                    let persons = &mut detected.report.persons;
                    persons.retain(|_| index.next().is_some_and(|index| followed.contains(&index)));
                    video.append(detected, &self.drawing, &self.runtime)?;
                }
                self.progress.advance();
            }
        }
    }

    /// Detects the persons of several frames at the same time, and returns them in their order.
    fn detect(
        &self,
        name: &str,
        images: Vec<(Timestamp, Bytes)>,
    ) -> anyhow::Result<Vec<(Timestamp, DetectedFrame)>> {
        thread::scope(|scope| {
            let running = images.into_iter().map(|(at, image)| {
                let job = DetectJob::local(
                    name.to_owned(),
                    JobImage::Encoded(image),
                    self.parameters.clone(),
                    self.calibration.clone(),
                );
                let detecting = thread::Builder::new().name("recording".to_owned());
                let detecting = detecting.spawn_scoped(scope, move || self.engine.detect(&job));
                (at, detecting)
            });
            let running: Vec<_> = running.collect();
            let detected = running.into_iter().map(|(at, detecting)| {
                let detecting = detecting.context("the operating system creates no thread")?;
                let Ok(detected) = detecting.join() else {
                    bail!("{name}: the frame at {at} failed: the log has the reason");
                };
                Ok((
                    at,
                    detected.with_context(|| format!("{name}: the frame at {at}"))?,
                ))
            });
            detected.collect()
        })
    }

    /// Stores the last counts and completes the video.
    fn finish(mut self) -> anyhow::Result<Recording> {
        self.recording.commit()?;
        if let Some(video) = self.video {
            video.finish(&self.runtime)?;
        }
        Ok(self.recording)
    }
}

/// Latest start of a recording, the year 9000: later frames might have no time.
const LATEST_START: Timestamp = Timestamp::constant(221_845_392_000, 0);

/// Returns the recordings with their times. Each begins at the end of the one before, or later if
/// its file says so.
fn clips(
    files: &[PathBuf],
    start: Option<Timestamp>,
    runtime: &Runtime,
) -> anyhow::Result<Vec<Clip>> {
    let options = VideoOptions::default();
    let mut clips = Vec::<Clip>::new();
    for path in files {
        let duration = runtime.block_on(video_duration(path, &options));
        let created_at = match start {
            Some(_) => None,
            None => runtime.block_on(video_created_at(path, &options)),
        };
        let after = clips
            .last()
            .map(|clip| clip.start + clip.duration.unwrap_or_default());
        let own = match (created_at, after) {
            (Some(created_at), _) => created_at,
            (None, Some(after)) => after,
            (None, None) => match start {
                Some(start) => start,
                None => modified_at(path)? - duration.unwrap_or_default(),
            },
        };
        let start = after.map_or(own, |after| after.max(own));
        if start > LATEST_START {
            bail!(
                "{}: it begins at {start}: give --start with the true time",
                path.display()
            );
        }
        clips.push(Clip {
            path: path.clone(),
            start,
            duration,
        });
    }
    Ok(clips)
}

fn modified_at(path: &Path) -> anyhow::Result<Timestamp> {
    let modified = fs::metadata(path).and_then(|file| file.modified());
    let modified = modified.with_context(|| format!("{}: it cannot be read", path.display()))?;
    let since = modified.duration_since(UNIX_EPOCH).unwrap_or_default();
    Ok(Timestamp::UNIX_EPOCH + since)
}

fn stem(path: &Path) -> String {
    let stem = path.file_stem().unwrap_or_default();
    stem.to_string_lossy().into_owned()
}
