//! `lookdown eval`

use std::{
    io::{self, IsTerminal, Write},
    path::PathBuf,
    process::ExitCode,
};

use anyhow::Context;
use clap::Args;
use serde::Serialize;

use super::SettingsFile;
use crate::{
    app::engine_for,
    detection::Refinement,
    evaluation::{DataSet, EvaluatedRow, evaluate},
    pipeline::{DetectParameters, Profile},
};

/// C_t without `--score-threshold`: low, since average precision looks at all scores.
const DEFAULT_SCORE_THRESHOLD: &str = "0.01";

/// Arguments of `lookdown eval`.
#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// Data set folder: annotations.json (COCO with a `calibration` per image), images/,
    /// calibrations/
    data_set: PathBuf,
    /// How thoroughly to look: paper, fast, balanced, quality or direct; may be repeated
    #[arg(long, value_name = "NAME", default_value = Profile::default().name())]
    profile: Vec<String>,
    /// How overlapping boxes become persons; may be repeated [default: all refinements]
    #[arg(long, value_name = "NAME")]
    refine: Vec<String>,
    /// Look with this model [default: the profile's]
    #[arg(long, value_name = "NAME")]
    model: Option<String>,
    /// Leave out persons with a lower score, 0 to 1
    #[arg(long, value_name = "SCORE", default_value = DEFAULT_SCORE_THRESHOLD)]
    score_threshold: String,
    /// Boxes that overlap at least this much are the same person [default: the refinement's]
    #[arg(long, value_name = "IOU")]
    iou_threshold: Option<String>,
    /// Width of Gaussian Soft-NMS [default: 0.3]
    #[arg(long, value_name = "NUMBER")]
    sigma: Option<String>,
    /// Print one JSON object per row instead of a table
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    settings_file: SettingsFile,
}

/// Scores every profile with every refinement.
pub(super) fn run(arguments: &Arguments) -> anyhow::Result<ExitCode> {
    let variants = arguments
        .profile
        .iter()
        .map(|profile| variants(arguments, profile))
        .collect::<anyhow::Result<Vec<_>>>()?;
    let settings = arguments.settings_file.load()?;
    let data_set = DataSet::open(&arguments.data_set)?;
    let engine = engine_for(&settings, &variants.concat())?;
    let mut out = io::stdout().lock();
    if !arguments.json {
        writeln!(out, "{TABLE_HEAD}").context("standard output cannot be written")?;
    }
    for of_profile in variants {
        let name = of_profile.first().map_or("", |first| first.profile.name());
        let rows = evaluate(&engine, &data_set, &of_profile, |done| {
            show_progress(name, done, data_set.images.len());
        })?;
        for row in rows {
            let row = Row::new(&row);
            let line = if arguments.json {
                serde_json::to_string(&row)?
            } else {
                row.table_line()
            };
            writeln!(out, "{line}").context("standard output cannot be written")?;
        }
    }
    Ok(ExitCode::SUCCESS)
}

fn variants(arguments: &Arguments, profile: &str) -> anyhow::Result<Vec<DetectParameters>> {
    let all = Refinement::ALL.map(|refinement| refinement.name().to_owned());
    let refinements = if arguments.refine.is_empty() {
        &all[..]
    } else {
        &arguments.refine
    };
    let parse = |refinement: &String| {
        let given = [
            ("profile", Some(profile)),
            ("refine", Some(refinement.as_str())),
            ("model", arguments.model.as_deref()),
            ("score_threshold", Some(arguments.score_threshold.as_str())),
            ("iou_threshold", arguments.iou_threshold.as_deref()),
            ("sigma", arguments.sigma.as_deref()),
        ];
        let pairs = given
            .into_iter()
            .filter_map(|(name, value)| Some((name, value?)));
        // The threshold is always among the pairs, so the default is never used.
        Ok(DetectParameters::parse(pairs, 0.0)?)
    };
    refinements.iter().map(parse).collect()
}

/// One line that is written over on a terminal, one line per image elsewhere.
fn show_progress(profile: &str, done: usize, total: usize) {
    let mut err = io::stderr().lock();
    let (start, end) = if err.is_terminal() {
        ("\r", if done == total { "\n" } else { "" })
    } else {
        ("", "\n")
    };
    // Progress that nobody can read is no reason to stop.
    let _ =
        write!(err, "{start}{profile}: {done} of {total} images{end}").and_then(|()| err.flush());
}

const TABLE_HEAD: &str = "\
profile   refine              views   AP50   AP75  AP50:95     F1  recall  s/image";

/// One row, as printed.
#[derive(Debug, Serialize)]
struct Row<'a> {
    profile: &'static str,
    refine: &'static str,
    model: &'a str,
    images: usize,
    persons: usize,
    /// Views per image that the network saw.
    views: f64,
    /// Areas under the precision-recall curve, all points.
    ap50: f64,
    ap75: f64,
    ap50_95: f64,
    ap50_eleven_point: f64,
    ap50_coco: f64,
    f1: f64,
    /// The score threshold of `f1`.
    f1_score_threshold: Option<f64>,
    recall: f64,
    seconds_per_image: f64,
}

impl<'a> Row<'a> {
    fn new(row: &'a EvaluatedRow) -> Self {
        let summary = &row.summary;
        Self {
            profile: row.profile.name(),
            refine: row.refinement.name(),
            model: &row.model,
            images: summary.images,
            persons: summary.persons,
            views: row.views,
            ap50: summary.ap50.all_point_area,
            ap75: summary.ap75.all_point_area,
            ap50_95: summary.ap50_95.all_point_area,
            ap50_eleven_point: summary.ap50.eleven_point,
            ap50_coco: summary.ap50.coco_101_point,
            f1: summary.f1,
            f1_score_threshold: summary.f1_score_threshold,
            recall: summary.recall,
            seconds_per_image: row.time_per_image.as_secs_f64(),
        }
    }

    fn table_line(&self) -> String {
        format!(
            "{:<9} {:<18} {:>6.1} {:>6.3} {:>6.3} {:>8.3} {:>6.3} {:>7.3} {:>8.3}",
            self.profile,
            self.refine,
            self.views,
            self.ap50,
            self.ap75,
            self.ap50_95,
            self.f1,
            self.recall,
            self.seconds_per_image
        )
    }
}
