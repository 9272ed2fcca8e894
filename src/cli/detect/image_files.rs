//! The images to detect people in: files as they are named, folders with all that is in them.

use std::{
    fs,
    path::{Path, PathBuf},
};

use anyhow::{Context, bail};
use lookdown_common::files::{IMAGE_ENDINGS, has_ending};

/// The maximum number of images of one run.
const MAX_IMAGES: usize = 100_000;
/// Most folders within each other.
const MAX_DEPTH: usize = 32;

/// An image to detect people in.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct ImageFile {
    /// Its file.
    pub path: PathBuf,
    /// Its path from the folder that was named, with `/` between its parts.
    pub name: String,
}

/// The files among `paths`, and the images below the folders among them in the order of their
/// names. Hidden files and folders are left out, and links to folders are not followed.
pub(super) fn image_files(paths: &[PathBuf]) -> anyhow::Result<Vec<ImageFile>> {
    let mut image_files = Vec::new();
    for path in paths {
        if path.is_dir() {
            let before = image_files.len();
            walk(path, "", MAX_DEPTH, &mut image_files)?;
            if image_files.len() == before {
                let path = path.display();
                bail!("{path}: there is no .jpg, .jpeg, .png or .webp file in this folder");
            }
        } else {
            let name = path.file_name().unwrap_or(path.as_os_str());
            image_files.push(ImageFile {
                path: path.clone(),
                name: name.to_string_lossy().into_owned(),
            });
        }
    }
    Ok(image_files)
}

fn walk(
    folder: &Path,
    prefix: &str,
    depth: usize,
    image_files: &mut Vec<ImageFile>,
) -> anyhow::Result<()> {
    let shown = folder.display();
    if depth == 0 {
        bail!("{shown}: folders lie more than {MAX_DEPTH} deep; name one further down");
    }
    let unreadable = || format!("{shown}: the folder cannot be read");
    let entries = fs::read_dir(folder).with_context(unreadable)?;
    let mut entries: Vec<_> = entries.collect::<Result<_, _>>().with_context(unreadable)?;
    entries.sort_by_key(fs::DirEntry::file_name);
    for entry in entries {
        let name = entry.file_name().to_string_lossy().into_owned();
        let path = entry.path();
        if name.starts_with('.') {
            continue;
        }
        if entry.file_type().with_context(unreadable)?.is_dir() {
            walk(&path, &format!("{prefix}{name}/"), depth - 1, image_files)?;
        } else if has_ending(&path, &IMAGE_ENDINGS) && path.is_file() {
            if image_files.len() >= MAX_IMAGES {
                bail!("{shown}: more than {MAX_IMAGES} images at once; name fewer");
            }
            image_files.push(ImageFile {
                path,
                name: format!("{prefix}{name}"),
            });
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder_with(files: &[&str]) -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        for file in files {
            let path = folder.path().join(file);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, "").unwrap();
        }
        folder
    }

    fn names(paths: &[PathBuf]) -> Vec<String> {
        let image_files = image_files(paths).unwrap();
        image_files
            .into_iter()
            .map(|image_file| image_file.name)
            .collect()
    }

    #[test]
    fn a_folder_lists_its_images_only_in_order_of_name() {
        let folder = folder_with(&[
            "b.JPG",
            "a/2.webp",
            "a/1.png",
            "notes.txt",
            ".x.jpg",
            ".git/y.png",
        ]);
        let path = folder.path().to_owned();
        assert_eq!(names(&[path]), ["a/1.png", "a/2.webp", "b.JPG"]);
    }

    #[test]
    fn a_file_is_taken_as_it_is_named() {
        let folder = folder_with(&["sub/image.dat"]);
        let file = folder.path().join("sub/image.dat");
        assert_eq!(
            names(&[file, "nowhere.jpg".into()]),
            ["image.dat", "nowhere.jpg"]
        );
    }

    #[test]
    fn a_folder_without_images_is_refused() {
        let folder = folder_with(&["notes.txt"]);
        let error = image_files(&[folder.path().to_owned()]).unwrap_err();
        assert!(error.to_string().contains("there is no .jpg"), "{error}");
    }

    #[cfg(unix)]
    #[test]
    fn a_folder_linked_into_itself_ends() {
        let folder = folder_with(&["a.jpg"]);
        std::os::unix::fs::symlink(folder.path(), folder.path().join("again")).unwrap();
        assert_eq!(names(&[folder.path().to_owned()]), ["a.jpg"]);
    }
}
