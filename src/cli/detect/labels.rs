//! `--format`: what was found, as files for annotation tools.

use std::{
    collections::HashMap,
    fs,
    path::{Path, PathBuf},
};

use anyhow::{Context, bail};
use lookdown_detect::pipeline::DetectionReport;

use super::image_files::ImageFile;
use crate::annotation_formats::{AnnotatedImage, AnnotationFormat, BoxKind};

/// The annotations of one run.
pub(super) struct Labels {
    format: AnnotationFormat,
    boxes: BoxKind,
    folder: PathBuf,
    images: Vec<AnnotatedImage>,
}

impl Labels {
    /// No annotations yet. Looking takes long, so that what would fail at the end fails now.
    ///
    /// # Errors
    /// Returns an error if two images would share a name or a file, or `folder` cannot be made.
    pub(super) fn start(
        format: AnnotationFormat,
        boxes: BoxKind,
        folder: &Path,
        image_files: &[ImageFile],
    ) -> anyhow::Result<Self> {
        let mut taken: HashMap<String, &Path> = HashMap::new();
        for image_file in image_files {
            let own_file = format.own_file(&image_file.name);
            let place = own_file.unwrap_or_else(|| image_file.name.clone());
            if let Some(other) = taken.insert(place, &image_file.path) {
                bail!(
                    "--format {format}: {} and {} would share their annotations: rename one, or \
                     name the folder above both",
                    other.display(),
                    image_file.path.display()
                );
            }
        }
        fs::create_dir_all(folder).with_context(|| unwritable(folder))?;
        Ok(Self {
            format,
            boxes,
            folder: folder.to_owned(),
            images: Vec::with_capacity(image_files.len()),
        })
    }

    /// Takes in what was found in an image.
    pub(super) fn add(&mut self, image_file: &ImageFile, report: &DetectionReport) {
        let image = AnnotatedImage::new(report, image_file.name.clone());
        self.images.push(image);
    }

    /// Writes the files.
    pub(super) fn write(&self) -> anyhow::Result<()> {
        for file in self.format.files(&self.images, self.boxes) {
            let path = self.folder.join(&file.path);
            let folder = path.parent().unwrap_or(&self.folder);
            fs::create_dir_all(folder).with_context(|| unwritable(folder))?;
            fs::write(&path, file.content).with_context(|| unwritable(&path))?;
        }
        Ok(())
    }
}

fn unwritable(path: &Path) -> String {
    format!("--out: {} cannot be written", path.display())
}
