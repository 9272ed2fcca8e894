//! Detections in files: COCO results, one file per row, which `pycocotools` can read.
//!
//! A file is a JSON array of `{"image_id", "category_id", "bbox": [left, top, width, height],
//! "score"}`, in corner-origin pixels. Lookdown's own files also have an `oriented_box`.

use std::{collections::HashMap, fs, io, path::Path};

use lookdown_common::{files::FileError, report::ReportOrientedBox};
use lookdown_detect::detection::BBox;
use lookdown_lens::geometry::{OrientedBox, Pixel};
use serde::{Deserialize, Serialize};

use crate::{
    DataSet, DetectedRow, FoundPerson, ImageId, RowName, data_set::image_files::read_text,
};

/// The category ID of `person` in COCO. Detections of other categories are skipped.
const PERSON: u64 = 1;
/// Enough for the results of a hundred thousand crowded images.
const MAX_BYTES: u64 = 1024 * 1024 * 1024;

#[derive(Serialize, Deserialize)]
struct Entry {
    image_id: ImageId,
    category_id: u64,
    bbox: [f64; 4],
    score: f64,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    /// Here with all digits.
    oriented_box: Option<ReportOrientedBox>,
}

impl RowName {
    /// The name of the row's file: `<profile>.<refinement>.<model>.json`.
    pub fn file_name(&self) -> String {
        match (self.profile, self.refinement) {
            (Some(profile), Some(refinement)) => {
                format!("{}.{refinement}.{}.json", profile.name(), self.model)
            }
            _ => format!("{}.json", self.model),
        }
    }

    /// Parses the name of a file. In a name of another form everything is the model.
    fn from_file(path: &Path) -> Self {
        let stem = path.file_stem().unwrap_or_default().to_string_lossy();
        Self::from_stem(&stem).unwrap_or_else(|| Self {
            profile: None,
            refinement: None,
            model: stem.into_owned(),
        })
    }

    fn from_stem(stem: &str) -> Option<Self> {
        let (profile, rest) = stem.split_once('.')?;
        let (refinement, model) = rest.split_once('.')?;
        Some(Self {
            profile: Some(profile.parse().ok()?),
            refinement: Some(refinement.parse().ok()?),
            model: model.to_owned(),
        })
    }
}

impl DetectedRow {
    /// Writes the row to its file in `folder`, which is created if it is missing.
    ///
    /// # Errors
    /// [`FileError`] if the file cannot be written.
    pub fn save(&self, folder: &Path, data_set: &DataSet) -> Result<(), FileError> {
        let path = folder.join(self.name.file_name());
        positions(data_set, &path)?;
        let images = data_set.images.iter().zip(&self.images);
        let entries: Vec<Entry> = images
            .flat_map(|(image, found)| found.iter().map(|person| entry(&image.id, person)))
            .collect();
        let write = || {
            fs::create_dir_all(folder)?;
            let file = io::BufWriter::new(fs::File::create(&path)?);
            serde_json::to_writer(file, &entries)?;
            io::Result::Ok(())
        };
        write().map_err(|error| FileError::new(&path, format!("cannot be written: {error}")))
    }

    /// Reads a row of detections in the images of `data_set`: Lookdown's own, or COCO results of
    /// any detector.
    ///
    /// # Errors
    /// [`FileError`] with the problem of the file.
    pub fn load(path: &Path, data_set: &DataSet) -> Result<Self, FileError> {
        let wrong = |problem: String| FileError::new(path, problem);
        let text = read_text(path, MAX_BYTES)?;
        let entries: Vec<Entry> = serde_json::from_str(&text)
            .map_err(|error| wrong(format!("not COCO results: {error}")))?;
        let position_of = positions(data_set, path)?;
        let mut images: Vec<Vec<FoundPerson>> = vec![Vec::new(); data_set.images.len()];
        for (index, entry) in entries.iter().enumerate() {
            if entry.category_id != PERSON {
                continue;
            }
            let position = position_of.get(&entry.image_id).ok_or_else(|| {
                wrong(format!(
                    "[{index}].image_id: {} is not an image of the data set",
                    entry.image_id
                ))
            })?;
            let found = found(entry).map_err(|problem| wrong(format!("[{index}].{problem}")))?;
            images[*position].push(found);
        }
        Ok(Self {
            name: RowName::from_file(path),
            refinement: None,
            cost: None,
            images,
        })
    }
}

/// The index of each image in its data set, by its ID in results.
fn positions<'a>(
    data_set: &'a DataSet,
    path: &Path,
) -> Result<HashMap<&'a ImageId, usize>, FileError> {
    let mut position_of = HashMap::with_capacity(data_set.images.len());
    for (position, image) in data_set.images.iter().enumerate() {
        if position_of.insert(&image.id, position).is_some() {
            return Err(FileError::new(
                path,
                format!(
                    "the data set has several images with the ID {}; give its annotation files \
                     one by one",
                    image.id
                ),
            ));
        }
    }
    Ok(position_of)
}

fn entry(image_id: &ImageId, person: &FoundPerson) -> Entry {
    let [left, top, _, _] = person.bbox.corners();
    Entry {
        image_id: image_id.clone(),
        category_id: PERSON,
        bbox: [left, top, person.bbox.width(), person.bbox.height()],
        score: person.score,
        oriented_box: person.oriented_box.map(|oriented| ReportOrientedBox {
            cx: oriented.center.x,
            cy: oriented.center.y,
            width: oriented.width,
            height: oriented.height,
            angle_deg: oriented.angle.to_degrees(),
        }),
    }
}

fn found(entry: &Entry) -> Result<FoundPerson, String> {
    let [left, top, width, height] = entry.bbox;
    let bbox = BBox::new([left, top, left + width, top + height])
        .map_err(|error| format!("bbox: {error}"))?;
    let oriented_box = entry.oriented_box.as_ref().map(|oriented| {
        OrientedBox::turned(
            Pixel::new(oriented.cx, oriented.cy),
            oriented.width,
            oriented.height,
            oriented.angle_deg.to_radians(),
        )
    });
    Ok(FoundPerson {
        bbox,
        oriented_box,
        score: entry.score,
    })
}

#[cfg(test)]
mod tests;
