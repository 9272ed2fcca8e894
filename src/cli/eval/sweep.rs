//! `--sweep`: the paper's sweeps over its parameters, one inference per image.

use std::{
    fs,
    io::{self, Write},
    path::Path,
};

use anyhow::Context;
use lookdown_common::files::{self, MAX_IMAGE_BYTES};
use lookdown_eval::{DataSet, DetectedRow, EvaluatedRow, sweep};
use lookdown_imaging::{Frame, annotate::encode_jpeg, decode::decode};

use super::{
    Arguments, detect_group,
    table::{Row, SWEEP_HEAD},
    variants,
};
use crate::cli::output::UNWRITABLE;
use crate::{
    app::{decode_limits, engine_for},
    settings::LimitSettings,
};

const JPEG_QUALITY: u8 = 90;

/// A cell of the sweep and its figures.
type Cells = [(DetectedRow, EvaluatedRow)];

/// Prints the figures of every cell, and writes them and their plots to `folder`.
pub(super) fn run(arguments: &Arguments, folder: &Path) -> anyhow::Result<()> {
    let base = variants::base_of_sweep(arguments)?;
    let settings = arguments.settings_file.load()?;
    let data_set = arguments.truth.open(&arguments.settings_file)?;
    fs::create_dir_all(folder).with_context(|| unwritable(folder))?;
    let engine = engine_for(&settings, std::slice::from_ref(&base))?;
    let detected = detect_group(&engine, &data_set, &sweep::cells(&base), &settings)?;
    let cells = detected.into_iter().map(|row| {
        let evaluated = row.evaluate(&data_set)?;
        Ok((row, evaluated))
    });
    let cells = cells.collect::<anyhow::Result<Vec<_>>>()?;
    print(&cells, &data_set, arguments.json)?;

    let name = match cells.first() {
        Some((row, _)) => format!("{}, {}", base.profile.name(), row.name.model),
        None => base.profile.name().to_owned(),
    };
    let plot = sweep::iou_threshold_plot(name.clone(), &cells).svg()?;
    write(folder, "cells.csv", sweep::table(&cells).as_bytes())?;
    write(folder, "iou_threshold.svg", plot.as_bytes())?;
    let (position, frame) = most_crowded(&data_set, &settings.limits)?;
    let images = data_set.images.len();
    let title = format!("{name}: Gaussian Soft-NMS in one image; AP (IoU ≥ 0.5) of all {images}");
    let matrix = sweep::matrix(title, &cells, &frame, position)?;
    write(folder, "matrix.jpg", &encode_jpeg(&matrix, JPEG_QUALITY)?)
}

fn print(cells: &Cells, data_set: &DataSet, json: bool) -> anyhow::Result<()> {
    let mut lines = Vec::with_capacity(cells.len() + 1);
    if !json {
        lines.push(SWEEP_HEAD.to_owned());
    }
    for (detected, evaluated) in cells {
        let row = Row::new(detected, Some(evaluated), &detected.counts(data_set));
        lines.push(if json {
            serde_json::to_string(&row)?
        } else {
            row.sweep_line()
        });
    }
    writeln!(io::stdout(), "{}", lines.join("\n")).context(UNWRITABLE)
}

/// The first of the images with the most persons, and its position in the data set.
fn most_crowded(data_set: &DataSet, limits: &LimitSettings) -> anyhow::Result<(usize, Frame)> {
    let images = data_set.images.iter().enumerate().rev();
    let (position, image) = images
        .max_by_key(|(_, image)| image.truth.person_count())
        .context("the data set has no images")?;
    let path = &image.path;
    let bytes = files::read(path, MAX_IMAGE_BYTES)
        .with_context(|| format!("{}: cannot be read", path.display()))?;
    let decoded =
        decode(&bytes, &decode_limits(limits)).with_context(|| path.display().to_string())?;
    Ok((position, decoded.frame))
}

fn write(folder: &Path, name: &str, content: &[u8]) -> anyhow::Result<()> {
    let path = folder.join(name);
    fs::write(&path, content).with_context(|| unwritable(&path))
}

fn unwritable(path: &Path) -> String {
    format!("--sweep: {} cannot be written", path.display())
}
