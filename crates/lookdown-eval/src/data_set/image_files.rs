//! The files below a folder, and the lookup of the image to which an annotation refers.

use std::{
    collections::HashMap,
    ffi::OsStr,
    path::{Path, PathBuf},
};

use lookdown_common::files::{self, FileError, IMAGE_ENDINGS, has_ending};

/// Most levels of folders. The largest data sets have five.
const MAX_DEPTH: usize = 12;
/// Most files and folders. The largest data sets have some 300 000.
const MAX_ENTRIES: usize = 2_000_000;

/// Every file below a folder, sorted.
pub(super) struct Files(Vec<PathBuf>);

/// Images by name.
pub(super) struct ImageFileIndex {
    by_stem: HashMap<Box<OsStr>, Vec<PathBuf>>,
}

impl Files {
    /// Lists the files below `root`.
    pub(super) fn below(root: &Path) -> Result<Self, FileError> {
        let mut files = Vec::new();
        let mut folders = vec![(root.to_owned(), 0)];
        let mut entries = 0;
        while let Some((folder, depth)) = folders.pop() {
            let unreadable = |error| FileError::unreadable(&folder, &error);
            for entry in std::fs::read_dir(&folder).map_err(unreadable)? {
                let path = entry.map_err(unreadable)?.path();
                entries += 1;
                let is_folder = path.is_dir();
                if entries > MAX_ENTRIES || (is_folder && depth == MAX_DEPTH) {
                    return Err(FileError::new(
                        root,
                        format!(
                            "has more than {MAX_ENTRIES} files or {MAX_DEPTH} levels of folders; \
                             name the data set's own folder"
                        ),
                    ));
                }
                if is_folder {
                    folders.push((path, depth + 1));
                } else {
                    files.push(path);
                }
            }
        }
        files.sort_unstable();
        Ok(Self(files))
    }

    /// The JSON files of a COCO layout: `annotations.json`, or else those in `annotations/`, or
    /// else those in `root` itself.
    pub(super) fn in_coco_layout(&self, root: &Path) -> Vec<PathBuf> {
        let single = root.join("annotations.json");
        if self.0.binary_search(&single).is_ok() {
            return vec![single];
        }
        let json_in = |folder: &Path| {
            let mut json = self.ending_in("json");
            json.retain(|path| path.parent() == Some(folder));
            json
        };
        let in_annotations = json_in(&root.join("annotations"));
        if in_annotations.is_empty() {
            json_in(root)
        } else {
            in_annotations
        }
    }

    /// The files with this extension, given in lower case.
    pub(super) fn ending_in(&self, ending: &str) -> Vec<PathBuf> {
        self.named(|path| has_ending(path, &[ending]))
    }

    /// The files for which `is_wanted` returns true.
    pub(super) fn named(&self, is_wanted: impl Fn(&Path) -> bool) -> Vec<PathBuf> {
        let wanted = self.0.iter().filter(|path| is_wanted(path));
        wanted.cloned().collect()
    }

    /// The images among the files.
    pub(super) fn image_files(&self) -> ImageFileIndex {
        let mut by_stem: HashMap<Box<OsStr>, Vec<PathBuf>> = HashMap::new();
        for path in self.0.iter().filter(|path| is_image_file(path)) {
            if let Some(stem) = path.file_stem() {
                by_stem.entry(stem.into()).or_default().push(path.clone());
            }
        }
        ImageFileIndex { by_stem }
    }
}

impl ImageFileIndex {
    /// The image with the name `file_name` in annotations, with or without folders before it.
    pub(super) fn by_file_name(&self, file_name: &Path) -> Result<PathBuf, String> {
        let name = file_name.file_name();
        let same_name = self.with_stem(file_name.file_stem());
        let same_name: Vec<_> = same_name
            .iter()
            .filter(|path| path.file_name() == name)
            .collect();
        let same_folders = same_name.iter().filter(|path| path.ends_with(file_name));
        let same_folders: Vec<_> = same_folders.copied().collect();
        let found = if same_folders.is_empty() {
            same_name
        } else {
            same_folders
        };
        the_only(&found, file_name)
    }

    /// The image with the same name as the annotation file `beside`. It is looked up in the same
    /// folder, else in a folder of the same name except for underscores (PIROPO's `omni1A_test2` is
    /// `omni_1A_test2` in its box annotations), else anywhere.
    pub(super) fn named_like(&self, beside: &Path) -> Result<PathBuf, String> {
        let same_stem: Vec<_> = self.with_stem(beside.file_stem()).iter().collect();
        let here = same_stem
            .iter()
            .find(|path| path.parent() == beside.parent());
        if let Some(here) = here {
            return Ok((*here).clone());
        }
        let folder = bare_folder_name(beside);
        let same_folder = same_stem
            .iter()
            .filter(|path| bare_folder_name(path) == folder);
        let same_folder: Vec<_> = same_folder.copied().collect();
        let found = if same_folder.is_empty() {
            same_stem
        } else {
            same_folder
        };
        the_only(&found, Path::new(beside.file_stem().unwrap_or_default()))
    }

    fn with_stem(&self, stem: Option<&OsStr>) -> &[PathBuf] {
        stem.and_then(|stem| self.by_stem.get(stem))
            .map_or(&[], Vec::as_slice)
    }
}

/// The images directly in `folder`, by name.
pub(super) fn image_files_in(folder: &Path) -> Result<Vec<PathBuf>, FileError> {
    let mut image_files = Files::below(folder)?.named(is_image_file);
    image_files.retain(|path| path.parent() == Some(folder));
    Ok(image_files)
}

/// The name of the folder that contains a file, without underscores.
fn bare_folder_name(path: &Path) -> Option<String> {
    let folder = path.parent()?.file_name()?;
    Some(folder.to_string_lossy().replace('_', ""))
}

fn the_only(found: &[&PathBuf], name: &Path) -> Result<PathBuf, String> {
    match found {
        [only] => Ok((*only).clone()),
        [] => Err(format!("no image {} was found", name.display())),
        [first, second, ..] => Err(format!(
            "the image {} may be {} or {}; keep one of them, or evaluate their folders separately",
            name.display(),
            first.display(),
            second.display()
        )),
    }
}

fn is_image_file(path: &Path) -> bool {
    has_ending(path, &IMAGE_ENDINGS)
}

/// Reads the text of a file of at most `max_bytes`.
pub(crate) fn read_text(path: &Path, max_bytes: u64) -> Result<String, FileError> {
    files::read_text(path, max_bytes).map_err(|error| FileError::unreadable(path, &error))
}

#[cfg(test)]
mod tests;
