//! `lookdown eval`

mod output;
mod plot_file;
mod sweep;
mod table;
mod truth;
mod variants;

use std::{
    path::{Path, PathBuf},
    process::ExitCode,
};

use anyhow::{Context, bail};
use clap::{
    Args,
    builder::{PossibleValuesParser, TypedValueParser},
};

use self::{output::Output, plot_file::PlotFile, truth::TruthFlags};
use super::{SettingsFile, parameters::one_of, progress::Progress};
use crate::{
    app::evaluation_engine,
    detection::Refinement,
    evaluation::{DataSet, DetectedRow, EvaluationError, detect},
    geometry::FieldOfViewReading,
    pipeline::{DetectParameters, Engine, Profile},
    settings::Settings,
};

/// C_t without `--score-threshold`: low, as average precision considers all scores.
const DEFAULT_SCORE_THRESHOLD: &str = "0.001";

/// Arguments of `lookdown eval`.
#[derive(Debug, Args)]
pub(super) struct Arguments {
    #[command(flatten)]
    truth: TruthFlags,
    /// Trade-off between accuracy and cost; may be repeated [default: balanced; with --sweep: paper]
    #[arg(long, value_name = "NAME", value_parser = one_of::<Profile>())]
    profile: Vec<Profile>,
    /// Method that merges overlapping boxes into persons; may be repeated [default: all of them]
    #[arg(long, value_name = "NAME", value_parser = one_of::<Refinement>())]
    refine: Vec<Refinement>,
    /// The rows of the paper's table: its three refinements, and the detector without views
    #[arg(long, conflicts_with_all = ["profile", "refine"])]
    paper: bool,
    /// Write the paper's sweeps to this folder: `cells.csv` (AP of NMS and Soft-NMS over N_t from 0
    /// to 1, of Gaussian Soft-NMS over C_t and sigma), `iou_threshold.svg` (AP over N_t) and
    /// `matrix.jpg` (detections at each C_t and sigma in the image with the most persons)
    #[arg(
        long,
        value_name = "FOLDER",
        conflicts_with_all = ["refine", "paper", "iou_threshold", "sigma", "plot",
                              "save_detections", "from_detections"]
    )]
    sweep: Option<PathBuf>,
    /// Model [default: the profile's]
    #[arg(long, value_name = "NAME")]
    model: Option<String>,
    /// Ignore persons with a lower score, 0 to 1
    #[arg(long, value_name = "SCORE", default_value = DEFAULT_SCORE_THRESHOLD)]
    score_threshold: String,
    /// Boxes that overlap at least this much are the same person [default: the refinement's]
    #[arg(long, value_name = "IOU")]
    iou_threshold: Option<String>,
    /// Width of Gaussian Soft-NMS [default: 0.3]
    #[arg(long, value_name = "NUMBER")]
    sigma: Option<String>,
    /// The reading of the paper's field of view, for the profile paper: 53° across, 53° from corner to
    /// corner, or its formula taken literally, 90°
    #[arg(
        long,
        value_name = "READING",
        default_value = "horizontal",
        value_parser = PossibleValuesParser::new(["horizontal", "diagonal", "literal"])
            .map(|name| reading(&name))
    )]
    field_of_view: FieldOfViewReading,
    /// Print one JSON object per row instead of a table
    #[arg(long)]
    json: bool,
    /// Also plot the precision-recall curves of all rows into one image
    #[arg(long, value_name = "OUT.svg|OUT.png")]
    plot: Option<PlotFile>,
    /// Also write the detections as COCO results: a file per row, named
    /// PROFILE.REFINEMENT.MODEL.json
    #[arg(long, value_name = "FOLDER")]
    save_detections: Option<PathBuf>,
    /// Score these COCO results instead of running a model: a file, or all .json files of a folder;
    /// may be repeated
    #[arg(
        long,
        value_name = "FILE|FOLDER",
        conflicts_with_all = ["profile", "refine", "paper", "model", "score_threshold",
                              "iou_threshold", "sigma", "save_detections"]
    )]
    from_detections: Vec<PathBuf>,
    #[command(flatten)]
    settings_file: SettingsFile,
}

fn reading(name: &str) -> FieldOfViewReading {
    match name {
        "diagonal" => FieldOfViewReading::Diagonal,
        "literal" => FieldOfViewReading::Literal,
        _ => FieldOfViewReading::Horizontal,
    }
}

/// Scores every profile with every refinement.
pub(super) fn run(arguments: &Arguments) -> anyhow::Result<ExitCode> {
    if let Some(folder) = &arguments.sweep {
        sweep::run(arguments, folder)?;
        return Ok(ExitCode::SUCCESS);
    }
    let mut output = Output::new(arguments);
    if arguments.from_detections.is_empty() {
        detect_groups(arguments, &mut output)?;
    } else {
        let data_set = arguments.truth.open(&arguments.settings_file)?;
        for path in saved_rows(&arguments.from_detections)? {
            output.print(&DetectedRow::load(&path, &data_set)?, &data_set)?;
        }
    }
    output.plot()?;
    Ok(ExitCode::SUCCESS)
}

/// Runs every profile on the data set.
fn detect_groups(arguments: &Arguments, output: &mut Output) -> anyhow::Result<()> {
    let groups = variants::groups(arguments)?;
    let settings = arguments.settings_file.load()?;
    let data_set = arguments.truth.open(&arguments.settings_file)?;
    let engine = evaluation_engine(&settings, &groups.concat(), arguments.field_of_view)?;
    for group in groups {
        for row in detect_group(&engine, &data_set, &group, &settings)? {
            if let Some(folder) = &arguments.save_detections {
                row.save(folder, &data_set)?;
            }
            output.print(&row, &data_set)?;
        }
    }
    Ok(())
}

fn detect_group(
    engine: &Engine,
    data_set: &DataSet,
    group: &[DetectParameters],
    settings: &Settings,
) -> Result<Vec<DetectedRow>, EvaluationError> {
    let name = group.first().map_or("", |first| first.profile.name());
    let progress = Progress::start(name, data_set.images.len());
    let at_once = settings.threads.frame_workers;
    let rows = detect(engine, data_set, group, at_once, || progress.advance());
    progress.finish();
    rows
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
