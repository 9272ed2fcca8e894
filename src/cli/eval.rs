//! `lookdown eval`

mod arguments;
mod detect_group;
mod output;
mod table;
mod truth;
mod variants;

use std::{
    path::{Path, PathBuf},
    process::ExitCode,
};

use anyhow::{Context, bail};
use lookdown_eval::DetectedRow;

use self::output::Output;
pub(super) use self::{
    arguments::{Arguments, DEFAULT_SCORE_THRESHOLD},
    detect_group::detect_group,
};
use crate::app::engine_for;

/// Scores every profile with every refinement.
pub(super) fn run(arguments: &Arguments) -> anyhow::Result<ExitCode> {
    let mut output = Output::new(arguments);
    if arguments.from_detections.is_empty() {
        detect_groups(arguments, &mut output)?;
    } else {
        let data_set = arguments.truth.open(&arguments.settings_file)?;
        for path in saved_rows(&arguments.from_detections)? {
            output.print(&DetectedRow::load(&path, &data_set)?, &data_set)?;
        }
    }
    Ok(ExitCode::SUCCESS)
}

/// Runs every profile on the data set.
fn detect_groups(arguments: &Arguments, output: &mut Output) -> anyhow::Result<()> {
    let groups = variants::groups(arguments)?;
    let settings = arguments.settings_file.load()?;
    let data_set = arguments.truth.open(&arguments.settings_file)?;
    let engine = engine_for(&settings, &groups.concat())?;
    let engine = engine.with_plan_turn(f64::from(arguments.turn_deg).to_radians());
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
