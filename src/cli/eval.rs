//! `lookdown eval`

mod arguments;
mod table;

use std::{
    io::{self, Write},
    path::{Path, PathBuf},
    process::ExitCode,
};

use anyhow::{Context, bail};
use lookdown_detect::{
    detection::Refinement,
    parameters::{DetectParameters, ParameterError, Profile},
};
use lookdown_eval::{DataSet, DetectedRow, detect};
use strum::VariantArray;

pub(super) use self::arguments::{Arguments, DEFAULT_SCORE_THRESHOLD};
use self::table::{HEAD, Row};
use super::{output::UNWRITABLE, progress::Progress};
use crate::app::engine_for;

/// The rows of the paper's table: its method with its three refinements, and the detector on the
/// fisheye frame itself (`Omni`).
const PAPER: [(Profile, &[Refinement]); 2] = [
    (
        Profile::Paper,
        &[
            Refinement::Nms,
            Refinement::SoftNmsLinear,
            Refinement::SoftNmsGaussian,
        ],
    ),
    (Profile::Direct, &[Refinement::Nms]),
];

/// Scores every profile with every refinement.
pub(super) fn run(arguments: &Arguments) -> anyhow::Result<ExitCode> {
    let mut output = Output::new(arguments);
    if arguments.from_detections.is_empty() {
        detect_groups(arguments, &mut output)?;
    } else {
        let settings = arguments.settings_file.load()?;
        let data_set = arguments.truth.open(&settings)?;
        for path in saved_rows(&arguments.from_detections)? {
            output.print(&DetectedRow::load(&path, &data_set)?, &data_set)?;
        }
    }
    Ok(ExitCode::SUCCESS)
}

/// Runs every profile on the data set.
fn detect_groups(arguments: &Arguments, output: &mut Output) -> anyhow::Result<()> {
    let groups = parameter_groups(arguments)?;
    let settings = arguments.settings_file.load()?;
    let data_set = arguments.truth.open(&settings)?;
    let mut engine = engine_for(&settings, &groups.concat())?;
    engine.plan_turn = f64::from(arguments.turn_deg).to_radians();
    for group in groups {
        let name = group.first().map_or("", |first| first.profile.name());
        let progress = Progress::start(name, data_set.images.len());
        let at_once = settings.threads.frame_workers;
        let rows = detect(&engine, &data_set, &group, at_once, || progress.advance())?;
        drop(progress);
        for row in rows {
            if let Some(folder) = &arguments.save_detections {
                row.save(folder, &data_set)?;
            }
            output.print(&row, &data_set)?;
        }
    }
    Ok(())
}

/// The files of `--from-detections`, those of a folder ordered by name.
fn saved_rows(paths: &[PathBuf]) -> anyhow::Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    for path in paths {
        if path.is_dir() {
            files.extend(json_files(path)?);
        } else {
            files.push(path.clone());
        }
    }
    Ok(files)
}

fn json_files(folder: &Path) -> anyhow::Result<Vec<PathBuf>> {
    let unreadable = || format!("{}: cannot be read", folder.display());
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).with_context(unreadable)? {
        let path = entry.with_context(unreadable)?.path();
        if path.extension().is_some_and(|ending| ending == "json") {
            files.push(path);
        }
    }
    if files.is_empty() {
        bail!(
            "{}: there is no .json file of detections in it",
            folder.display()
        );
    }
    files.sort();
    Ok(files)
}

/// The rows of one run.
struct Output<'a> {
    arguments: &'a Arguments,
    head_is_due: bool,
}

impl<'a> Output<'a> {
    fn new(arguments: &'a Arguments) -> Self {
        Self {
            arguments,
            head_is_due: !arguments.json,
        }
    }

    fn print(&mut self, detected: &DetectedRow, data_set: &DataSet) -> anyhow::Result<()> {
        // A data set of empty rooms has counts, but neither precision nor recall.
        let mut strata = Vec::new();
        for by in &self.arguments.by {
            strata.push((*by, detected.strata(data_set, *by).context("--by")?));
        }
        let row = Row {
            detected,
            evaluated: detected.evaluate(data_set).ok(),
            counts: detected.counts(data_set),
            strata,
        };
        let line = if self.arguments.json {
            row.json().to_string()
        } else {
            row.to_string()
        };
        let mut out = io::stdout().lock();
        let written = if std::mem::take(&mut self.head_is_due) {
            writeln!(out, "{HEAD}\n{line}")
        } else {
            writeln!(out, "{line}")
        };
        written.context(UNWRITABLE)
    }
}

/// One group per profile.
fn parameter_groups(arguments: &Arguments) -> Result<Vec<Vec<DetectParameters>>, ParameterError> {
    if arguments.paper {
        let groups = PAPER.iter();
        let groups = groups.map(|(profile, refinements)| group(arguments, *profile, refinements));
        return groups.collect();
    }
    let profiles = match &arguments.profile[..] {
        [] => &[Profile::default()],
        given => given,
    };
    let refinements = match &arguments.refine[..] {
        [] => Refinement::VARIANTS,
        given => given,
    };
    let groups = profiles.iter();
    let groups = groups.map(|profile| group(arguments, *profile, refinements));
    groups.collect()
}

fn group(
    arguments: &Arguments,
    profile: Profile,
    refinements: &[Refinement],
) -> Result<Vec<DetectParameters>, ParameterError> {
    let parse = |refinement: &Refinement| {
        let given = [
            ("profile", Some(profile.name())),
            ("refine", Some(refinement.name())),
            ("model", arguments.model.as_deref()),
            ("score_threshold", Some(arguments.score_threshold.as_str())),
            ("iou_threshold", arguments.iou_threshold.as_deref()),
            ("sigma", arguments.sigma.as_deref()),
        ];
        let pairs = given.into_iter();
        DetectParameters::parse(pairs.filter_map(|(name, value)| Some((name, value?))))
    };
    refinements.iter().map(parse).collect()
}
