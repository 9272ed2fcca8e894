//! The content of a calibration file: cameras that are not checked yet.

use std::collections::BTreeMap;

use serde_json::Value;

use super::{Format, FormatError, fields::Fields};
use crate::native::{
    NativeCalibration, NativeImage, NativeLine, NativeMask, NativeMount, NativePlace, NativeSource,
    NativeValue, NativeZone, SourcedValue,
};
use crate::warning::Warning;
use lookdown_lens::geometry::lens::LensModel;

/// Most cameras taken from one file.
pub(super) const MAX_CAMERAS: usize = 256;

/// The content of a calibration file.
#[derive(Debug, Clone, PartialEq)]
pub struct CalibrationFile {
    /// The format that was recognized.
    pub format: Format,
    /// Its cameras, in the file's order; at least one.
    pub cameras: Vec<FileCamera>,
}

/// One camera of a file.
#[derive(Debug, Clone, PartialEq)]
pub struct FileCamera {
    /// Its name in the file, where it has one.
    pub name: Option<String>,
    /// The camera; one that cannot be used does not spoil the others.
    pub camera: Result<Camera, FormatError>,
}

/// A camera as written in a file, not checked yet.
#[derive(Debug, Clone, PartialEq)]
pub struct Camera {
    /// The size of the frames it was calibrated with; some formats have none.
    pub image: Option<NativeImage>,
    /// The lens.
    pub lens: LensModel,
    /// Its mount; only native files have one, others mean straight down.
    pub mount: NativeMount,
    /// Its zones; only native files have some.
    pub zones: Vec<NativeZone>,
    /// Its lines; only native files have some.
    pub lines: Vec<NativeLine>,
    /// Its masks; only native files have some.
    pub masks: Vec<NativeMask>,
    /// The places where people can be; only native files have some.
    pub areas: Vec<NativePlace>,
    /// The places whose detections are left out; only native files have some.
    pub ignore: Vec<NativePlace>,
    /// Its defaults of detection parameters; only native files have some.
    pub detect: BTreeMap<String, NativeValue>,
    /// The sources of its values; only native files have some.
    pub sources: BTreeMap<SourcedValue, NativeSource>,
    /// The assumptions of the reader.
    pub notes: Vec<Warning>,
}

impl Camera {
    pub(super) fn new(image: Option<NativeImage>, lens: impl Into<LensModel>) -> Self {
        Self {
            image,
            lens: lens.into(),
            mount: NativeMount::default(),
            zones: Vec::new(),
            lines: Vec::new(),
            masks: Vec::new(),
            areas: Vec::new(),
            ignore: Vec::new(),
            detect: BTreeMap::new(),
            sources: BTreeMap::new(),
            notes: Vec::new(),
        }
    }

    /// Returns the camera as the content of a native file.
    pub fn to_native(&self, id: String, image: NativeImage) -> NativeCalibration {
        NativeCalibration {
            mount: self.mount.clone(),
            zones: self.zones.clone(),
            lines: self.lines.clone(),
            masks: self.masks.clone(),
            areas: self.areas.clone(),
            ignore: self.ignore.clone(),
            detect: self.detect.clone(),
            sources: self.sources.clone(),
            ..NativeCalibration::new(id, image, self.lens.clone())
        }
    }
}

impl CalibrationFile {
    /// Largest content that is read, bytes: a real calibration has a few hundred, one that carries
    /// its corner points some ten thousand.
    pub const MAX_BYTES: usize = 1024 * 1024;
}

/// The cameras of a format that holds several to a file: the entries that are cameras, by name.
pub(super) fn named(
    fields: &Fields<'_>,
    is_camera: impl Fn(&Value) -> bool,
    read: impl Fn(&Fields<'_>) -> Result<Camera, FormatError>,
) -> Vec<FileCamera> {
    let cameras = fields.map.iter().filter(|(_, entry)| is_camera(entry));
    cameras
        .map(|(name, _)| FileCamera {
            name: Some(name.clone()),
            camera: fields.child(name).and_then(|camera| read(&camera)),
        })
        .collect()
}

/// The camera of a format that holds one to a file.
pub(super) fn alone(camera: Result<Camera, FormatError>) -> Vec<FileCamera> {
    vec![FileCamera { name: None, camera }]
}
