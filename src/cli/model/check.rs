//! `lookdown model check`
//!
//! Detection on a sample image with the model that is checked.
//!
//! The description of a model as text.

use std::{
    fmt, fs,
    io::{self, Write},
    path::{Path, PathBuf},
    process::ExitCode,
    time::{Duration, Instant},
};

use anyhow::{Context, anyhow, bail};
use clap::Args;
use lookdown_common::files::{self, MAX_IMAGE_BYTES};
use lookdown_detect::{
    inference::{
        Detector, GuessedHead, INPUTS, InferenceError, MANIFEST, ModelDescription, OnnxDetector,
        OnnxTensor, guess_head, guess_size, name_from,
    },
    parameters::DetectParameters,
    pipeline::{DetectJob, DetectedFrame, JobImage},
};
use lookdown_eval::DataSet;
use lookdown_imaging::{ChannelOrder, ViewBatch};

use crate::{
    annotated_image::AnnotationOptions,
    app::{engine_for, onnx_options},
    cli::{
        annotate, eval::DEFAULT_SCORE_THRESHOLD, progress::UNWRITABLE, server_flags::SettingsFile,
    },
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
        write_manifest(&arguments.model, &settings)?;
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
    write!(out, "{}", Lines(&detector.description)).context(UNWRITABLE)?;
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

/// The data set that the inputs are compared on: frames with annotated persons.
const SAMPLES: &str = "samples";
/// Average precision below which a network is taken for one that does not detect persons: three
/// times that of the best of 240 networks of random weights with the best input, and a sixth of
/// that of the worst installed network (docs/models.md).
const LEAST_PRECISION: f64 = 0.1;

/// The parts of a manifest that do not depend on the input.
struct Guess<'a> {
    name: String,
    file: &'a str,
    head: GuessedHead,
    size: (u32, u32),
    is_open: bool,
}

/// Writes the manifest of an ONNX file. Detects the persons of the samples with each usual input,
/// and keeps the one with the highest average precision.
fn write_manifest(model: &Path, settings: &Settings) -> anyhow::Result<()> {
    let (Some(file), true) = (
        model.file_name().and_then(|name| name.to_str()),
        model.is_file() && model.extension().is_some_and(|ending| ending == "onnx"),
    ) else {
        bail!(
            "--write-manifest: {} is not an ONNX file: give the path of one, such as \
             models/yolox_s/model.onnx",
            model.display()
        );
    };
    let path = model.with_file_name(MANIFEST);
    if path.exists() {
        bail!(
            "--write-manifest: {} exists: remove it, or leave out the flag to check it",
            path.display()
        );
    }
    let library = settings.inference.find_library()?;
    let (inputs, outputs) = OnnxDetector::tensors(&library, model, &onnx_options(settings))
        .map_err(|error| anyhow!(explain(&error)))?;
    let (size, is_open) = guess_size(&inputs);
    let Some(head) = guess_head(&outputs, size) else {
        let shapes = outputs
            .iter()
            .map(|output| format!("{} {:?}", output.name, output.shape));
        bail!(
            "--write-manifest: no head reads the outputs {}: write model.toml by hand, as \
             docs/models.md describes",
            shapes.collect::<Vec<_>>().join(", ")
        );
    };
    let stem = model.with_extension("");
    let folder = model.parent().and_then(Path::file_name);
    let is_generic = stem.file_name().is_some_and(|name| name == "model");
    let named = folder.filter(|_| is_generic).or(stem.file_name());
    let guess = Guess {
        name: name_from(&named.unwrap_or_default().to_string_lossy()),
        file,
        head,
        size,
        is_open,
    };
    let written = choose(&guess, &path, model, settings);
    if written.is_err() {
        fs::remove_file(&path).ok();
    }
    written
}

/// Writes the manifest with the best input, or with the first one if none finds persons.
fn choose(guess: &Guess<'_>, path: &Path, model: &Path, settings: &Settings) -> anyhow::Result<()> {
    let store = |(_, input): (&str, &str)| {
        let unwritable = || format!("--write-manifest: {} cannot be written", path.display());
        fs::write(path, guess.manifest(input)).with_context(unwritable)
    };
    let mut out = io::stdout().lock();
    writeln!(out, "head         guessed: {}", guess.head.family).context(UNWRITABLE)?;
    let mut settings = settings.clone();
    settings.model.path = Some(model.to_owned());
    let samples = find_installed(Path::new(SAMPLES));
    let samples = samples.map(|folder| DataSet::open(&folder)).transpose()?;
    let mut best = (0.0, INPUTS[0]);
    for input in INPUTS {
        let Some(samples) = &samples else { break };
        store(input)?;
        let precision = precision(&settings, samples)?;
        writeln!(out, "input        {}: AP50 {precision:.3}", input.0).context(UNWRITABLE)?;
        if precision > best.0 {
            best = (precision, input);
        }
    }
    let finds_persons = best.0 >= LEAST_PRECISION;
    let chosen = if finds_persons { best.1 } else { INPUTS[0] };
    store(chosen)?;
    writeln!(out, "written      {} ({})", path.display(), chosen.0).context(UNWRITABLE)?;
    let doubt = match samples {
        Some(_) if finds_persons => return Ok(()),
        Some(_) => "no input finds the persons of the samples",
        None => "the folder `samples` of the source is not here, so that the input is not tested",
    };
    eprintln!(
        "lookdown: warning: {doubt}: compare [input] and [output] of {} with the documentation of \
         the model",
        path.display()
    );
    Ok(())
}

/// Returns the average precision of the model on a data set, at an IoU of 0.5.
fn precision(settings: &Settings, samples: &DataSet) -> anyhow::Result<f64> {
    let given = [
        ("profile", "fast"),
        ("score_threshold", DEFAULT_SCORE_THRESHOLD),
    ];
    let parameters = [DetectParameters::parse(given)?];
    let engine = engine_for(settings, &parameters)?;
    let at_once = settings.threads.frame_workers;
    let rows = lookdown_eval::detect(&engine, samples, &parameters, at_once, || {})?;
    let row = rows.first().context("no row was evaluated")?;
    Ok(row.evaluate(samples)?.summary.ap50.coco_101_point)
}

impl Guess<'_> {
    fn manifest(&self, input: &str) -> String {
        let Self {
            name,
            file,
            head,
            size: (width, height),
            is_open,
        } = self;
        let size = if *is_open {
            format!("width = {width}\nheight = {height}\n")
        } else {
            String::new()
        };
        format!(
            "name = \"{name}\"\nonnx = {file:?}\n\n[input]\n{size}{input}\n[output]\n{}",
            head.table
        )
    }
}
