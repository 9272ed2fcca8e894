//! `lookdown model check --write-manifest`

use std::{
    fs,
    io::{self, Write},
    path::Path,
};

use anyhow::{Context, bail};
use lookdown_detect::{
    inference::{GuessedHead, INPUTS, MANIFEST, OnnxDetector, guess_head, guess_size, name_from},
    pipeline::{DetectedFrame, Person},
};

use crate::{
    app::onnx_options,
    cli::{model::sample::detect, output::UNWRITABLE},
    settings::Settings,
};

/// Lowest score of a plausible person: random outputs have about 0.5 at most.
const LEAST_SCORE: f64 = 0.5;
/// Ratios of height to width of the boxes of people, seated or standing.
const RATIOS: std::ops::RangeInclusive<f64> = 0.7..=6.0;
/// Longest side of the box of a person, as a share of the width of the frame.
const LONGEST_SIDE: f64 = 0.5;

/// The parts of a manifest that do not depend on the input.
struct Guess<'a> {
    name: String,
    file: &'a str,
    head: GuessedHead,
    size: (u32, u32),
    is_open: bool,
}

/// Writes the manifest of an ONNX file. Tries each usual input on the sample, and keeps the one with
/// the highest sum of the scores of plausible persons.
pub(super) fn write(
    model: &Path,
    sample: Option<&Path>,
    settings: &Settings,
) -> anyhow::Result<()> {
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
    let (inputs, outputs) = OnnxDetector::tensors(&library, model, &onnx_options(settings))?;
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
    let written = choose(&guess, &path, model, sample, settings);
    if written.is_err() {
        fs::remove_file(&path).ok();
    }
    written
}

/// Writes the manifest with the best input.
fn choose(
    guess: &Guess<'_>,
    path: &Path,
    model: &Path,
    sample: Option<&Path>,
    settings: &Settings,
) -> anyhow::Result<()> {
    let store = |(_, input): (&str, &str)| {
        let unwritable = || format!("--write-manifest: {} cannot be written", path.display());
        fs::write(path, guess.manifest(input)).with_context(unwritable)
    };
    let mut out = io::stdout().lock();
    writeln!(out, "head         guessed: {}", guess.head.family).context(UNWRITABLE)?;
    let mut settings = settings.clone();
    settings.model.path = Some(model.to_owned());
    let mut best = (0.0, INPUTS[0]);
    for input in INPUTS.iter().filter(|_| sample.is_some()) {
        store(*input)?;
        let Some(sample) = sample else { break };
        let detected = detect(&settings, sample, "fast")?;
        let (persons, scores) = plausible(&detected);
        writeln!(out, "input        {}: {persons} plausible persons", input.0)
            .context(UNWRITABLE)?;
        if scores > best.0 {
            best = (scores, *input);
        }
    }
    store(best.1)?;
    writeln!(out, "written      {} ({})", path.display(), best.1.0).context(UNWRITABLE)?;
    if best.0 == 0.0 {
        eprintln!(
            "lookdown: warning: no plausible person was found with any input: compare [input] and \
             [output] of {} with the documentation of the model",
            path.display()
        );
    }
    Ok(())
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

/// Returns the number of persons whose boxes can be those of people, and the sum of their scores.
fn plausible(detected: &DetectedFrame) -> (usize, f64) {
    let longest = LONGEST_SIDE * f64::from(detected.report.image_width);
    let is_plausible = |person: &&Person| {
        let shape = &person.oriented_box;
        person.score > LEAST_SCORE
            && RATIOS.contains(&(shape.height / shape.width))
            && shape.height.max(shape.width) < longest
    };
    let persons = detected.report.persons.iter().filter(is_plausible);
    persons.fold((0, 0.0), |(count, sum), person| {
        (count + 1, sum + person.score)
    })
}
