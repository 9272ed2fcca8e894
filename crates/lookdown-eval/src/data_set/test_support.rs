//! Data sets of a few small files.

use tempfile::TempDir;

use super::{DataSet, DataSetImage};
use crate::Outline;

/// A folder of files with these contents.
pub(super) fn folder(files: &[(&str, &str)]) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (name, content) in files {
        let path = folder.path().join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, content).unwrap();
    }
    folder
}

pub(super) fn open(folder: &TempDir) -> DataSet {
    DataSet::open(folder.path()).unwrap()
}

pub(super) fn refusal(folder: &TempDir) -> String {
    DataSet::open(folder.path()).unwrap_err().to_string()
}

/// `[x_min, y_min, x_max, y_max]` of every person that counts.
pub(super) fn boxes(image: &DataSetImage) -> Vec<[f64; 4]> {
    let counting = image.truth.persons.iter().filter(|person| person.counts);
    let boxes = counting.map(|person| match &person.outline {
        Outline::AxisParallel(bbox) => bbox.corners(),
        other => panic!("{other:?} is not an axis-parallel box"),
    });
    boxes.collect()
}
