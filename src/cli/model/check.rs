//! `lookdown model check`
//!
//! Detection on a sample image with the model that is checked.
//!
//! The description of a model as text.

use std::{
    fmt,
    io::{self, Write},
    path::{Path, PathBuf},
    process::ExitCode,
    time::{Duration, Instant},
};

use anyhow::{Context, anyhow};
use clap::Args;
use lookdown_common::files::{self, MAX_IMAGE_BYTES};
use lookdown_detect::{
    inference::{Detector, InferenceError, ModelDescription, OnnxDetector, OnnxTensor},
    parameters::DetectParameters,
    pipeline::{DetectJob, DetectedFrame, JobImage},
};
use lookdown_imaging::{ChannelOrder, ViewBatch};

use super::manifest;
use crate::{
    annotated_image::AnnotationOptions,
    app::{engine_for, onnx_options},
    cli::{annotate, output::UNWRITABLE, settings_file::SettingsFile},
    settings::{Settings, explain, find_installed},
};

/// The default sample image: a fisheye frame.
const SAMPLE: &str = "samples/office.jpg";
/// Views in a run that is timed beside that of one view.
const BATCH_VIEWS: usize = 8;
/// Timed runs of the network. The median is printed.
const RUNS: usize = 5;

/// Arguments of `lookdown model check`.
#[derive(Debug, Args)]
pub(in super::super) struct Arguments {
    /// A model folder (with a model.toml) or an ONNX file
    #[arg(value_name = "FILE|FOLDER")]
    model: PathBuf,
    /// Test image, used without views [default: a fisheye sample, seen through views]
    #[arg(long, value_name = "IMAGE")]
    sample: Option<PathBuf>,
    /// Draw the detected persons into the sample
    #[arg(long, value_name = "OUT.jpg")]
    annotate: Option<PathBuf>,
    /// First write a `model.toml` beside the ONNX file: guess the head from the outputs, and the
    /// input from the annotated persons of the installed samples
    #[arg(long)]
    write_manifest: bool,
    #[command(flatten)]
    settings_file: SettingsFile,
}

/// Runs the subcommand.
pub(super) fn run(arguments: &Arguments) -> anyhow::Result<ExitCode> {
    let settings = arguments.settings_file.load()?;
    let sample = arguments.sample.as_deref();
    if arguments.write_manifest {
        manifest::write(&arguments.model, &settings)?;
    }
    let annotated = arguments.annotate.as_deref();
    check_model(settings, &arguments.model, sample, annotated)
}

/// Prints the properties of a model and its detections on a sample.
pub(super) fn check_model(
    mut settings: Settings,
    model: &Path,
    sample: Option<&Path>,
    annotated: Option<&Path>,
) -> anyhow::Result<ExitCode> {
    let library = settings.inference.find_library()?;
    let loading = Instant::now();
    let mut detector = OnnxDetector::load(&library, model, &onnx_options(&settings))
        .map_err(|error| anyhow!(explain(&error)))?;
    let loaded = loading.elapsed();
    let mut out = io::stdout().lock();
    write!(out, "{}", Lines(detector.description())).context(UNWRITABLE)?;
    writeln!(out, "loaded in    {}", millis(loaded)).context(UNWRITABLE)?;
    let most = settings.threads.batch_views.get().max(BATCH_VIEWS);
    let one_view = millis(time(&mut detector, 1)?);
    let most_views = millis(time(&mut detector, most)?);
    let (device, threads) = (settings.inference.device, settings.threads.per_session);
    writeln!(
        out,
        "runs in      {one_view} with 1 view, {most_views} with {most} (on {device}, {})",
        count(threads.get(), "thread")
    )
    .context(UNWRITABLE)?;
    drop(detector);

    settings.model.path = Some(model.to_owned());
    let Some((sample, profile)) = sample
        .map(|path| (path.to_owned(), "direct"))
        .or_else(|| Some((find_installed(Path::new(SAMPLE))?, "fast")))
    else {
        writeln!(out, "sample       none: give one with --sample").context(UNWRITABLE)?;
        return Ok(ExitCode::SUCCESS);
    };
    let detected = detect(&settings, &sample, profile)?;
    let persons = &detected.report.persons;
    let views = detected.report.views.inferred;
    writeln!(
        out,
        "sample       {}: {} in {}",
        sample.display(),
        count(persons.len(), "person"),
        count(views, "view")
    )
    .context(UNWRITABLE)?;
    for person in persons {
        let [x_min, y_min, x_max, y_max] = person.bbox.corners().map(f64::round);
        writeln!(
            out,
            "  {:.2}         {x_min}, {y_min} to {x_max}, {y_max}",
            person.score
        )
        .context(UNWRITABLE)?;
    }
    if let Some(path) = annotated {
        annotate::write(detected, &AnnotationOptions::parse([])?, path)?;
    }
    Ok(ExitCode::SUCCESS)
}

fn count(number: usize, thing: &str) -> String {
    match number {
        1 => format!("1 {thing}"),
        _ => format!("{number} {thing}s"),
    }
}

fn millis(time: Duration) -> String {
    format!("{:.1} ms", time.as_secs_f64() * 1e3)
}

/// The median time of a run on blank views, without the first run.
fn time(detector: &mut OnnxDetector, views: usize) -> Result<Duration, InferenceError> {
    let mut batch = ViewBatch::default();
    for slot in batch.prepare(views, detector.input()) {
        slot.fill(0.0);
    }
    detector.detect(&batch)?;
    let mut times = Vec::with_capacity(RUNS);
    for _ in 0..RUNS {
        let started = Instant::now();
        detector.detect(&batch)?;
        times.push(started.elapsed());
    }
    times.sort_unstable();
    Ok(times[RUNS / 2])
}

/// Detects persons in the sample with the model of the settings.
pub(super) fn detect(
    settings: &Settings,
    sample: &Path,
    profile: &str,
) -> anyhow::Result<DetectedFrame> {
    let parameters = DetectParameters::parse([("profile", profile)])?;
    let engine = engine_for(settings, std::slice::from_ref(&parameters))?;
    let image = files::read(sample, MAX_IMAGE_BYTES)
        .with_context(|| format!("--sample: {} cannot be read", sample.display()))?;
    Ok(engine.detect(&DetectJob::local(
        sample.display().to_string(),
        JobImage::Encoded(image.into()),
        parameters,
        None,
    ))?)
}

/// One property per line.
pub(super) struct Lines<'a>(pub(super) &'a ModelDescription);

impl fmt::Display for Lines<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let model = self.0;
        let manifest = &model.manifest;
        let unknown = || "not stated".to_owned();
        let checked = match &manifest.sha256 {
            Some(_) => "as in the manifest",
            None => "not in the manifest",
        };
        let license = model.license.clone().unwrap_or_else(unknown);
        let source = manifest.source.clone().unwrap_or_else(unknown);
        writeln!(f, "name         {}", manifest.name)?;
        writeln!(
            f,
            "file         {}, {} bytes",
            manifest.onnx.display(),
            model.bytes
        )?;
        writeln!(f, "sha256       {} ({checked})", model.sha256)?;
        writeln!(f, "revision     {}", model.revision)?;
        writeln!(f, "license      {license}")?;
        writeln!(f, "source       {source}")?;
        for (what, tensors) in [("input", &model.inputs), ("output", &model.outputs)] {
            for OnnxTensor {
                name,
                element,
                shape,
            } in tensors
            {
                let shape: Vec<_> = shape.iter().copied().map(dimension).collect();
                writeln!(f, "{what:<12} {name}: {element} [{}]", shape.join(", "))?;
            }
        }
        let input = &model.input;
        let order = match input.channel_order {
            ChannelOrder::Rgb => "rgb",
            ChannelOrder::Bgr => "bgr",
        };
        let views = match model.views_per_run {
            Some(views) => format!("{views} at once"),
            None => "any number at once".to_owned(),
        };
        writeln!(
            f,
            "pixels       {}×{}, {}, {order}, 0..255 × {:?} + {:?}",
            input.width, input.height, model.layout, input.scale, input.offset
        )?;
        writeln!(f, "views        {views}")?;
        let head = &manifest.output;
        writeln!(f, "head         {}: {}", head.name(), head.description())
    }
}

fn dimension(side: i64) -> String {
    match side {
        ..0 => "any".to_owned(),
        side => side.to_string(),
    }
}
