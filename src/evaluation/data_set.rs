//! Data set folders: `annotations.json` (COCO detection with a `calibration` per image),
//! `images/` and `calibrations/<id>.json`.

use std::{
    collections::HashMap,
    path::{Path, PathBuf},
    sync::Arc,
};

use serde::Deserialize;

use super::GroundTruth;
use crate::{
    calibration::{Calibration, CalibrationError, CalibrationFolder, CalibrationId},
    detection::{BBox, FramePixels},
};

/// Pictures with their calibrations and the persons in them.
#[derive(Debug)]
pub struct DataSet {
    /// The pictures, in the order of the annotation file.
    pub images: Vec<DataSetImage>,
}

/// One picture of a data set.
#[derive(Debug)]
pub struct DataSetImage {
    /// The picture's file.
    pub path: PathBuf,
    /// The camera's calibration.
    pub calibration: Arc<Calibration>,
    /// Who is in it.
    pub truth: GroundTruth<BBox<FramePixels>>,
}

/// A folder that is no data set.
#[derive(Debug, thiserror::Error)]
pub enum DataSetError {
    /// The annotations cannot be used.
    #[error("{path}: {problem}")]
    Annotations {
        /// The annotation file.
        path: PathBuf,
        /// What is wrong with it.
        problem: String,
    },
    /// A calibration cannot be used.
    #[error(transparent)]
    Calibration(#[from] CalibrationError),
}

#[derive(Deserialize)]
struct CocoFile {
    images: Vec<CocoImage>,
    annotations: Vec<CocoAnnotation>,
}

#[derive(Deserialize)]
struct CocoImage {
    id: u64,
    file_name: PathBuf,
    calibration: String,
}

#[derive(Deserialize)]
struct CocoAnnotation {
    image_id: u64,
    /// Left, top, width, height; corner-origin pixels.
    bbox: [f64; 4],
    #[serde(default)]
    iscrowd: u8,
}

impl DataSet {
    /// Opens the data set in `folder`.
    ///
    /// # Errors
    /// [`DataSetError`] naming the file and what is wrong with it.
    pub fn open(folder: &Path) -> Result<Self, DataSetError> {
        let path = folder.join("annotations.json");
        let wrong = |problem: String| DataSetError::Annotations {
            path: path.clone(),
            problem,
        };
        let text = std::fs::read_to_string(&path)
            .map_err(|error| wrong(format!("cannot be read: {error}")))?;
        let file: CocoFile = serde_json::from_str(&text)
            .map_err(|error| wrong(format!("not a COCO annotation file: {error}")))?;
        let mut truths: HashMap<u64, GroundTruth<BBox<FramePixels>>> = HashMap::new();
        for (index, annotation) in file.annotations.iter().enumerate() {
            let [left, top, width, height] = annotation.bbox;
            let bbox = BBox::new([left, top, left + width, top + height])
                .map_err(|error| wrong(format!("annotations[{index}].bbox: {error}")))?;
            let truth = truths.entry(annotation.image_id).or_insert_with(nobody);
            if annotation.iscrowd == 0 {
                truth.persons.push(bbox);
            } else {
                truth.ignore_regions.push(bbox);
            }
        }
        let calibrations = CalibrationFolder::open(&folder.join("calibrations"))?;
        let images = file.images.into_iter().map(|image| {
            let id: CalibrationId = image
                .calibration
                .parse()
                .map_err(|error| wrong(format!("images: calibration: {error}")))?;
            let calibration = calibrations.get(&id)?.ok_or_else(|| {
                wrong(format!(
                    "images: there is no calibrations/{id}.json beside it"
                ))
            })?;
            Ok(DataSetImage {
                path: folder.join("images").join(image.file_name),
                calibration,
                truth: truths.remove(&image.id).unwrap_or_else(nobody),
            })
        });
        let images = images.collect::<Result<_, DataSetError>>()?;
        if let Some(id) = truths.keys().next() {
            return Err(wrong(format!(
                "annotations: image_id {id} is no image's id"
            )));
        }
        Ok(Self { images })
    }
}

fn nobody() -> GroundTruth<BBox<FramePixels>> {
    GroundTruth {
        persons: Vec::new(),
        ignore_regions: Vec::new(),
    }
}

#[cfg(test)]
mod tests;
