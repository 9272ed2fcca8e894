//! The head points of PIROPO: `Ground_Truth_Annotations/groundTruth_<sequence>.csv` beside the
//! folder `<sequence>/` of images.
//!
//! A file has no header and one row for each image, in the order of their names: a frame number,
//! then `x, y` of every head. Unused columns are empty, 0 or negative. The format was derived from
//! programs that read the files, as the files themselves are not freely available.

use std::path::{Path, PathBuf};

use lookdown_common::files::FileError;

use super::{
    DataSet, DataSetImage, ImageId,
    image_files::{image_files_in, read_text},
};
use crate::{AnnotatedPerson, Outline, Scoring};

const MAX_BYTES: u64 = 64 * 1024 * 1024;
const PREFIX: &str = "groundTruth_";

/// Returns true if the file name is that of a file of head points.
pub(super) fn is_head_file(path: &Path) -> bool {
    sequence(path).is_some()
}

/// The sequence to which a file of head points belongs.
fn sequence(path: &Path) -> Option<&str> {
    let name = path.file_name()?.to_str()?;
    name.strip_prefix(PREFIX)?.strip_suffix(".csv")
}

/// Reads one file per sequence.
pub(super) fn read_files(files: &[PathBuf]) -> Result<DataSet, FileError> {
    let mut images = Vec::new();
    for path in files {
        read(path, &mut images)?;
    }
    Ok(DataSet {
        images,
        scoring: Scoring::HeadPoint,
    })
}

fn read(path: &Path, images: &mut Vec<DataSetImage>) -> Result<(), FileError> {
    let wrong = |problem: String| FileError::new(path, problem);
    let sequence = sequence(path).unwrap_or_default();
    let beside = path.ancestors().skip(1).take(2);
    let folder = beside
        .map(|folder| folder.join(sequence))
        .find(|folder| folder.is_dir())
        .ok_or_else(|| wrong(format!("there is no folder {sequence}/ with its images")))?;
    let image_files = image_files_in(&folder)?;
    let text = read_text(path, MAX_BYTES)?;
    let rows: Vec<_> = text.lines().filter(|row| !row.trim().is_empty()).collect();
    if rows.len() != image_files.len() {
        return Err(wrong(format!(
            "it has {} rows, but {} has {} images; there must be a row for each",
            rows.len(),
            folder.display(),
            image_files.len()
        )));
    }
    for (index, (row, image_file)) in rows.into_iter().zip(image_files).enumerate() {
        let name = image_file.file_name().unwrap_or_default().to_string_lossy();
        let id = ImageId::Text(format!("{sequence}/{name}"));
        let mut image = DataSetImage::empty(id, image_file);
        for head in heads(row).map_err(|problem| wrong(format!("row {}: {problem}", index + 1)))? {
            image.add(AnnotatedPerson::from(Outline::Head(head)));
        }
        images.push(image);
    }
    Ok(())
}

/// The points of a row.
fn heads(row: &str) -> Result<Vec<[f64; 2]>, String> {
    let coordinates = row.split(',').skip(1).map(coordinate);
    let coordinates = coordinates.collect::<Result<Vec<_>, _>>()?;
    let (points, left) = coordinates.as_chunks::<2>();
    if left.iter().any(|value| *value > 0.0) {
        return Err("it has an x without a y; give both for every head".to_owned());
    }
    let is_person = |point: &&[f64; 2]| point.iter().all(|value| *value > 0.0);
    Ok(points.iter().filter(is_person).copied().collect())
}

/// Parses a coordinate. Returns 0 if there is none.
fn coordinate(text: &str) -> Result<f64, String> {
    let text = text.trim();
    if text.is_empty() {
        return Ok(0.0);
    }
    match text.parse::<f64>() {
        // Programs that do not support empty columns write NaN.
        Ok(value) if value.is_nan() => Ok(0.0),
        Ok(value) if value.is_finite() => Ok(value),
        _ => Err(format!("{text:?} is not a coordinate; give pixels")),
    }
}

#[cfg(test)]
mod tests;
