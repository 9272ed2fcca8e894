//! `lookdown model check --write-manifest`

use std::{
    fs,
    io::{self, Write},
    path::Path,
};

use anyhow::{Context, anyhow, bail};
use lookdown_detect::{
    inference::{GuessedHead, INPUTS, MANIFEST, OnnxDetector, guess_head, guess_size, name_from},
    parameters::DetectParameters,
};
use lookdown_eval::DataSet;

use crate::{
    app::{engine_for, onnx_options},
    cli::{eval::DEFAULT_SCORE_THRESHOLD, output::UNWRITABLE},
    settings::{Settings, explain, find_installed},
};

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
pub(super) fn write(model: &Path, settings: &Settings) -> anyhow::Result<()> {
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
