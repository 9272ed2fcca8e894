//! COCO files, and those of CEPDOF and RAPiD, whose boxes have an angle.
//!
//! `images[]`: `id`, `file_name`, `width`, `height`, and in Lookdown's data sets `calibration`.
//! `annotations[]`: `image_id`, `bbox`, `iscrowd`, `category_id`, and in Lookdown's data sets
//! `visible_fraction`. A `bbox` is `[left, top, width, height]`, or, in CEPDOF and RAPiD, `[cx, cy,
//! width, height, degrees clockwise]`, in corner-origin pixels.

use std::{
    collections::HashMap,
    path::{Path, PathBuf},
    sync::Arc,
};

use lookdown_calibration::{Calibration, CalibrationId};
use lookdown_common::files::FileError;
use lookdown_detect::detection::BBox;
use serde::Deserialize;

use super::{DataSet, DataSetImage, ImageFileIndex, ImageId, image_files::read_text};
use crate::{AnnotatedPerson, Outline, RotatedBox, Scoring};

/// The largest common file, that of COCO's training set, has 450 MB.
const MAX_BYTES: u64 = 1024 * 1024 * 1024;

#[derive(Deserialize)]
struct CocoFile {
    images: Vec<CocoImage>,
    annotations: Vec<CocoAnnotation>,
    #[serde(default)]
    categories: Vec<CocoCategory>,
}

#[derive(Deserialize)]
struct CocoImage {
    id: ImageId,
    file_name: PathBuf,
    width: Option<u32>,
    height: Option<u32>,
    calibration: Option<String>,
}

#[derive(Deserialize)]
struct CocoAnnotation {
    image_id: ImageId,
    bbox: Vec<f64>,
    #[serde(default)]
    iscrowd: u8,
    category_id: Option<u64>,
    visible_fraction: Option<f64>,
}

#[derive(Deserialize)]
struct CocoCategory {
    id: u64,
    name: String,
}

/// Reads the annotations of a folder with `calibrations/`, whose images are in `images/` or beside
/// the annotations.
pub(super) fn read_own_folder(folder: &Path, file: &Path) -> Result<DataSet, FileError> {
    let mut calibrations = Calibrations::new(folder.join("calibrations"));
    let place = |name: &Path| {
        let [inside, beside] = [folder.join("images").join(name), folder.join(name)];
        let is_beside = !inside.exists() && beside.is_file();
        Ok(if is_beside { beside } else { inside })
    };
    let mut reader = Reader::default();
    reader.read(file, Some(&mut calibrations), place)?;
    Ok(reader.data_set())
}

/// Reads annotation files as one data set.
pub(super) fn read_files(
    files: &[PathBuf],
    image_files: &ImageFileIndex,
) -> Result<DataSet, FileError> {
    let mut reader = Reader::default();
    for file in files {
        reader.read(file, None, |name| image_files.by_file_name(name))?;
    }
    Ok(reader.data_set())
}

/// The calibrations of a data set that were read so far.
struct Calibrations {
    folder: PathBuf,
    read: HashMap<CalibrationId, Arc<Calibration>>,
}

impl Calibrations {
    fn new(folder: PathBuf) -> Self {
        let read = HashMap::default();
        Self { folder, read }
    }

    /// Returns the calibration with this ID, or `None` without a file.
    fn get(&mut self, id: &CalibrationId) -> Result<Option<Arc<Calibration>>, FileError> {
        if let Some(known) = self.read.get(id) {
            return Ok(Some(Arc::clone(known)));
        }
        let file = self.folder.join(format!("{id}.json"));
        if !file.is_file() {
            return Ok(None);
        }
        let calibration = Arc::new(Calibration::read(&file)?);
        self.read.insert(id.clone(), Arc::clone(&calibration));
        Ok(Some(calibration))
    }
}

#[derive(Default)]
struct Reader {
    images: Vec<DataSetImage>,
    index_by_id: HashMap<ImageId, usize>,
    /// The scoring of the boxes read so far.
    scoring: Option<Scoring>,
}

impl Reader {
    fn read(
        &mut self,
        path: &Path,
        mut calibrations: Option<&mut Calibrations>,
        image_file: impl Fn(&Path) -> Result<PathBuf, String>,
    ) -> Result<(), FileError> {
        let wrong = |problem: String| FileError::new(path, problem);
        let file: CocoFile = serde_json::from_str(&read_text(path, MAX_BYTES)?)
            .map_err(|error| wrong(format!("not a COCO annotation file: {error}")))?;
        for image in &file.images {
            let index = self.images.len();
            if self.index_by_id.insert(image.id.clone(), index).is_some() {
                return Err(wrong(format!(
                    "images: the id {} occurs twice in the data set",
                    image.id
                )));
            }
            let image_file = image_file(&image.file_name)
                .map_err(|problem| wrong(format!("images: {problem}")))?;
            let mut read = DataSetImage::empty(image.id.clone(), image_file);
            read.size = image.width.zip(image.height).map(Into::into);
            if let (Some(calibrations), Some(id)) = (calibrations.as_mut(), &image.calibration) {
                let id: CalibrationId = id
                    .parse()
                    .map_err(|error| wrong(format!("images: calibration: {error}")))?;
                read.calibration = Some(calibrations.get(&id)?.ok_or_else(|| {
                    wrong(format!(
                        "images: there is no calibrations/{id}.json beside it"
                    ))
                })?);
            }
            self.images.push(read);
        }
        let person = person_category(&file.categories).map_err(wrong)?;
        for (position, annotation) in file.annotations.iter().enumerate() {
            if person.is_some() && annotation.category_id != person {
                continue;
            }
            let id = &annotation.image_id;
            let index = *self
                .index_by_id
                .get(id)
                .ok_or_else(|| wrong(format!("annotations: image_id {id} is not an image's id")))?;
            self.annotate(index, annotation)
                .map_err(|problem| wrong(format!("annotations[{position}].{problem}")))?;
        }
        Ok(())
    }

    fn annotate(&mut self, index: usize, annotation: &CocoAnnotation) -> Result<(), String> {
        let image = &mut self.images[index];
        let (scoring, outline) = outline(&annotation.bbox, image.size)?;
        if *self.scoring.get_or_insert(scoring) != scoring {
            return Err(format!(
                "bbox: has {} numbers, unlike the previous ones; give all boxes 4 or all 5",
                annotation.bbox.len()
            ));
        }
        if annotation.iscrowd != 0 {
            image.truth.ignore_regions.push(outline);
            return Ok(());
        }
        if let Some(fraction) = annotation.visible_fraction
            && !(0.0..=1.0).contains(&fraction)
        {
            return Err(format!(
                "visible_fraction: {fraction} is outside 0 to 1; give the visible share"
            ));
        }
        image.truth.persons.push(AnnotatedPerson {
            visible_fraction: annotation.visible_fraction,
            ..AnnotatedPerson::from(outline)
        });
        Ok(())
    }

    fn data_set(self) -> DataSet {
        DataSet {
            images: self.images,
            scoring: self.scoring.unwrap_or(Scoring::AxisParallel),
        }
    }
}

/// The category of persons: the one named `person`, or else the only one. `None` if the file has no
/// categories, so that every annotation is a person.
fn person_category(categories: &[CocoCategory]) -> Result<Option<u64>, String> {
    let person = categories
        .iter()
        .find(|category| category.name.eq_ignore_ascii_case("person"));
    match (person, categories) {
        (Some(category), _) | (None, [category]) => Ok(Some(category.id)),
        (None, []) => Ok(None),
        (None, _) => Err("categories: none of several is named person; rename one".to_owned()),
    }
}

fn outline(bbox: &[f64], size: Option<[u32; 2]>) -> Result<(Scoring, Outline), String> {
    match *bbox {
        [left, top, width, height] => {
            let bbox = BBox::new([left, top, left + width, top + height])
                .map_err(|error| format!("bbox: {error}"))?;
            Ok((Scoring::AxisParallel, Outline::AxisParallel(bbox)))
        }
        [cx, cy, width, height, degrees] => {
            let size = size.ok_or(
                "bbox: is rotated, but its image has no width and height; add them to the image",
            )?;
            let rotated = RotatedBox::new([cx, cy, width, height], degrees.to_radians(), size)
                .ok_or_else(|| {
                    format!(
                        "bbox: {bbox:?} is not a rotated box; give finite cx, cy, width, height \
                         and degrees, with extents of at least 0"
                    )
                })?;
            Ok((Scoring::Rotated, Outline::Rotated(rotated)))
        }
        _ => Err(format!(
            "bbox: has {} numbers; give 4 (left, top, width, height) or 5 (cx, cy, width, \
             height, degrees)",
            bbox.len()
        )),
    }
}

#[cfg(test)]
mod tests;
