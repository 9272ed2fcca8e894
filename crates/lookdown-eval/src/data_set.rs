//! Data sets: images with annotated persons, in common file formats.
//!
//! [`DataSet::open`] recognizes the format from the files at a path, and lists the formats. The
//! readers return an image's file, its ground truth and, if the data set has them, its calibration
//! and size.

mod coco;
mod content;
mod heads;
pub(crate) mod image_files;
mod voc;

use std::path::Path;

pub use content::ImageId;
pub use content::ScoringMismatch;
pub use content::{DataSet, DataSetImage};

use lookdown_common::files::FileError;

use self::image_files::{Files, ImageFileIndex};

const UNRECOGNIZED: &str = "holds no data set in a known format; expected annotations.json, \
                            annotations/*.json, *.json, *.xml or \
                            Ground_Truth_Annotations/groundTruth_*.csv";

impl DataSet {
    /// Opens the data set at `path`, which is one of:
    ///
    /// * a folder with `annotations.json` (COCO, each image with a `calibration`),
    ///   `calibrations/<id>.json`, and the images in `images/` or beside the annotations;
    /// * a COCO file, or a folder with `annotations.json`, `annotations/*.json` or `*.json` and
    ///   the images anywhere below it; boxes of five numbers are rotated (CEPDOF, RAPiD);
    /// * a folder with Pascal VOC XML files and the images of the same names anywhere below it
    ///   (VOC, boxes for PIROPO);
    /// * a PIROPO folder with head points, `Ground_Truth_Annotations/groundTruth_<sequence>.csv`
    ///   beside `<sequence>/`, or one such CSV file.
    ///
    /// # Errors
    /// [`FileError`], which names the file and the problem.
    pub fn open(path: &Path) -> Result<Self, FileError> {
        let unreadable = |error| FileError::unreadable(path, &error);
        if std::fs::metadata(path).map_err(unreadable)?.is_file() {
            return Self::open_file(path);
        }
        let annotations = path.join("annotations.json");
        if annotations.is_file() && path.join("calibrations").is_dir() {
            return coco::read_own_folder(path, &annotations);
        }
        let files = Files::below(path)?;
        let json = files.in_coco_layout(path);
        if !json.is_empty() {
            return coco::read_files(&json, &files.image_files());
        }
        let xml = files.ending_in("xml");
        if !xml.is_empty() {
            return voc::read_files(path, &xml, &files.image_files());
        }
        let heads = files.named(heads::is_head_file);
        if !heads.is_empty() {
            return heads::read_files(&heads);
        }
        Err(FileError::new(path, UNRECOGNIZED))
    }

    fn open_file(path: &Path) -> Result<Self, FileError> {
        let ending = path.extension().and_then(|ending| ending.to_str());
        let folder = path.parent().unwrap_or(Path::new("."));
        match ending {
            Some("json") => {
                let root = match folder.file_name() {
                    Some(name) if name == "annotations" => folder.parent().unwrap_or(folder),
                    _ => folder,
                };
                let image_files: ImageFileIndex = Files::below(root)?.image_files();
                coco::read_files(&[path.to_owned()], &image_files)
            }
            Some("csv") if heads::is_head_file(path) => heads::read_files(&[path.to_owned()]),
            _ => Err(FileError::new(path, UNRECOGNIZED)),
        }
    }
}

#[cfg(test)]
mod test_support;
#[cfg(test)]
mod tests;
