//! `lookdown eval`
//!
//! The arguments of `lookdown eval`.
//!
//! The data set and the interpretation of its ground truth.
//!
//! The figures of a row, as printed.

use std::{
    fmt,
    io::{self, Write},
    path::{Path, PathBuf},
    process::ExitCode,
};

use anyhow::{Context, bail};
use clap::Args;
use lookdown_detect::{
    detection::Refinement,
    parameters::{DetectParameters, ParameterError, Profile},
};
use lookdown_eval::{
    Counts, DEFAULT_COUNT_THRESHOLD, DataSet, DetectedRow, EvaluatedRow, Scoring, Stratification,
    Stratum, Summary, detect,
};
use serde_json::{Value, json};
use strum::VariantArray;

use super::{
    parameters::{named_calibration, one_of},
    progress::{Progress, UNWRITABLE},
    server_flags::SettingsFile,
};
use crate::{app::engine_for, settings::Settings};

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
            (DetectParameters::FLOOR, arguments.floor.then_some("true")),
            ("score_threshold", Some(arguments.score_threshold.as_str())),
            ("iou_threshold", arguments.iou_threshold.as_deref()),
            ("sigma", arguments.sigma.as_deref()),
        ];
        let pairs = given.into_iter();
        DetectParameters::parse(pairs.filter_map(|(name, value)| Some((name, value?))))
    };
    refinements.iter().map(parse).collect()
}

/// C_t without `--score-threshold`: low, as average precision considers all scores.
pub(in crate::cli) const DEFAULT_SCORE_THRESHOLD: &str = "0.001";

/// Arguments of `lookdown eval`.
#[derive(Debug, Args)]
pub(in crate::cli) struct Arguments {
    #[command(flatten)]
    truth: TruthFlags,
    /// Also score the persons of each stratum: by distance from the optical axis, size or
    /// visibility; may be repeated
    #[arg(long, value_name = "NAME", value_parser = one_of::<Stratification>())]
    by: Vec<Stratification>,
    /// Trade-off between accuracy and cost; may be repeated [default: balanced]
    #[arg(long, value_name = "NAME", value_parser = one_of::<Profile>())]
    profile: Vec<Profile>,
    /// Method that merges overlapping boxes into persons; may be repeated [default: all of them]
    #[arg(long, value_name = "NAME", value_parser = one_of::<Refinement>())]
    refine: Vec<Refinement>,
    /// The rows of the paper's table: its three refinements, and the detector without views
    #[arg(long, conflicts_with_all = ["profile", "refine"])]
    paper: bool,
    /// Model [default: the profile's]
    #[arg(long, value_name = "NAME")]
    model: Option<String>,
    /// Look for people on the floor as well
    #[arg(long)]
    floor: bool,
    /// Ignore persons with a lower score, 0 to 1
    #[arg(long, value_name = "SCORE", default_value = DEFAULT_SCORE_THRESHOLD)]
    score_threshold: String,
    /// Boxes that overlap at least this much are the same person [default: the refinement's]
    #[arg(long, value_name = "IOU")]
    iou_threshold: Option<String>,
    /// Width of Gaussian Soft-NMS [default: 0.3]
    #[arg(long, value_name = "NUMBER")]
    sigma: Option<String>,
    /// Turn the views of the profile about the vertical by this angle, degrees: the mean of
    /// several turns depends less on where people happen to be in the views
    #[arg(
        long,
        value_name = "DEGREES",
        default_value_t = 0,
        value_parser = clap::value_parser!(u16).range(..360)
    )]
    turn_deg: u16,
    /// Print one JSON object per row instead of a table
    #[arg(long)]
    json: bool,
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
                              "iou_threshold", "sigma", "save_detections", "turn_deg"]
    )]
    from_detections: Vec<PathBuf>,
    #[command(flatten)]
    settings_file: SettingsFile,
}

/// The flags that select a data set.
#[derive(Debug, Args)]
pub(in crate::cli) struct TruthFlags {
    /// Images with annotated persons: a folder with annotations.json (COCO with a `calibration` per
    /// image), images/ and calibrations/; a COCO or CEPDOF file or a folder of them; a folder with
    /// Pascal VOC XML files; a PIROPO folder with head points
    data_set: PathBuf,
    /// A calibration file, or the ID of one in the calibration folder, for every image [default:
    /// each image's own; without one an ideal lens is assumed]
    #[arg(long, value_name = "FILE|ID")]
    calibration: Option<String>,
    /// Score rotated ground truth by the bounds of the inscribed ellipses, with axis-parallel
    /// detections
    #[arg(long)]
    axis_parallel: bool,
}

impl TruthFlags {
    /// Opens the data set.
    pub(in crate::cli) fn open(&self, settings: &Settings) -> anyhow::Result<DataSet> {
        let mut data_set = DataSet::open(&self.data_set)?;
        if let Some(named) = &self.calibration {
            data_set = data_set.with_calibration(&named_calibration(named, settings)?);
        }
        if self.axis_parallel {
            data_set = data_set
                .scored_as(Scoring::AxisParallel)
                .context("--axis-parallel")?;
        }
        Ok(data_set)
    }
}

/// One row: a JSON object, or a line of the table by its `Display`. Unknown values of detections
/// from a file are null, or a dash.
struct Row<'a> {
    detected: &'a DetectedRow,
    /// `None` if no person counts.
    evaluated: Option<EvaluatedRow>,
    counts: Counts,
    strata: Vec<(Stratification, Vec<Stratum>)>,
}

impl Row<'_> {
    /// The row as JSON: the score thresholds of `f1` and of the counts stand beside them, numbers
    /// of false and missed persons are means per image, and `false_in_empty_images` is the share of
    /// the images without persons that have a false person.
    fn json(&self) -> Value {
        let summary = self.evaluated.as_ref().map(|evaluated| &evaluated.summary);
        let figure = |figure: fn(&Summary) -> f64| summary.map(figure);
        let DetectedRow {
            name,
            refinement: numbers,
            cost,
            ..
        } = self.detected;
        let counts = &self.counts;
        let (now, best) = (counts.at(DEFAULT_COUNT_THRESHOLD), counts.best());
        let calibration = counts.calibration_error();
        let mut row = json!({
            "profile": name.profile.map(Profile::name),
            "refine": name.refinement.map(Refinement::name),
            "model": name.model,
            "score_threshold": numbers.map(|numbers| numbers.score_threshold),
            "iou_threshold": numbers.map(|numbers| numbers.iou_threshold),
            "sigma": numbers.map(|numbers| numbers.sigma),
            "images": counts.image_count(),
            "persons": summary.map_or(0, |summary| summary.persons),
            "views": cost.map(|cost| cost.views),
            "ap50": figure(|summary| summary.ap50.all_point_area),
            "ap75": figure(|summary| summary.ap75.all_point_area),
            "ap50_95": figure(|summary| summary.ap50_95.all_point_area),
            "ap50_eleven_point": figure(|summary| summary.ap50.eleven_point),
            "ap50_coco": figure(|summary| summary.ap50.coco_101_point),
            "ap75_coco": figure(|summary| summary.ap75.coco_101_point),
            "ap50_95_coco": figure(|summary| summary.ap50_95.coco_101_point),
            "f1": figure(|summary| summary.f1),
            "f1_score_threshold": summary.and_then(|summary| summary.f1_score_threshold),
            "f1_precision": figure(|summary| summary.f1_precision),
            "f1_recall": figure(|summary| summary.f1_recall),
            "recall": figure(|summary| summary.recall),
            "count_threshold": now.score_threshold,
            "false_persons": now.false_persons,
            "missed_persons": now.missed_persons,
            "count_error": now.count_error,
            "empty_images": counts.empty_image_count(),
            "false_in_empty_images": now.false_in_empty_images,
            "best_count_threshold": best.score_threshold,
            "best_count_error": best.count_error,
            "calibration_error": calibration.map(|calibration| calibration.error),
            "calibration_error_by_chance": calibration.map(|calibration| calibration.by_chance),
            "seconds_per_image": cost.map(|cost| cost.time_per_image.as_secs_f64()),
        });
        let strata = self.strata.iter();
        let strata =
            strata.flat_map(|(by, strata)| strata.iter().map(|stratum| stratum_json(*by, stratum)));
        let strata: Vec<_> = strata.collect();
        if !strata.is_empty() {
            row["strata"] = json!(strata);
        }
        row
    }
}

/// The figures of one stratum. They are null if no person counts.
fn stratum_json(by: Stratification, stratum: &Stratum) -> Value {
    json!({
        "by": by.name(),
        "stratum": stratum.name,
        "persons": stratum.persons,
        "ap50": stratum.figures.map(|figures| figures.ap50.all_point_area),
        "recall": stratum.figures.map(|figures| figures.recall),
    })
}

fn number(value: Option<f64>, decimals: usize) -> String {
    match value {
        Some(value) => format!("{value:.decimals$}"),
        None => "-".to_owned(),
    }
}

/// The header of the table. `docs/evaluate.md` explains the columns.
const HEAD: &str = "\
profile   refine             model                  views   AP50   AP75  AP50:95     F1  recall  \
false missed  error  empty   best    at    ECE  s/image";

impl fmt::Display for Row<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let summary = self.evaluated.as_ref().map(|evaluated| &evaluated.summary);
        let figure = |figure: fn(&Summary) -> f64| number(summary.map(figure), 3);
        let DetectedRow { name, cost, .. } = self.detected;
        let counts = &self.counts;
        let (now, best) = (counts.at(DEFAULT_COUNT_THRESHOLD), counts.best());
        let calibration = counts.calibration_error();
        write!(
            f,
            "{:<9} {:<18} {:<21} {:>6} {:>6} {:>6} {:>8} {:>6} {:>7} {:>6.2} {:>6.2} {:>6.2} {:>6} \
             {:>6.2} {:>5.2} {:>6} {:>8}",
            name.profile.map_or("-", Profile::name),
            name.refinement.map_or("-", Refinement::name),
            name.model,
            number(cost.map(|cost| cost.views), 1),
            figure(|summary| summary.ap50.all_point_area),
            figure(|summary| summary.ap75.all_point_area),
            figure(|summary| summary.ap50_95.all_point_area),
            figure(|summary| summary.f1),
            figure(|summary| summary.recall),
            now.false_persons,
            now.missed_persons,
            now.count_error,
            number(now.false_in_empty_images, 2),
            best.count_error,
            best.score_threshold,
            number(calibration.map(|calibration| calibration.error), 3),
            number(cost.map(|cost| cost.time_per_image.as_secs_f64()), 3),
        )?;
        for stratum in self.strata.iter().flat_map(|(_, strata)| strata) {
            let figures = stratum.figures;
            write!(
                f,
                "\n  {:<42} persons {:>5}  AP50 {:>5}  recall {:>5}",
                stratum.name,
                stratum.persons,
                number(figures.map(|figures| figures.ap50.all_point_area), 3),
                number(figures.map(|figures| figures.recall), 3),
            )?;
        }
        Ok(())
    }
}
