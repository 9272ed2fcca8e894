//! From the content of a stored or uploaded file to calibrations under their IDs.
//!
//! Reasons for which a calibration cannot be used or was not changed, or for which the outcome is
//! unknown.

use std::{collections::BTreeMap, sync::Arc};

use lookdown_calibration::{
    Calibration, CalibrationFile, CalibrationId, FormatError,
    export::Target,
    formats::FileCamera,
    native::{NativeCalibration, NativeImage, NativeValue},
    warning::Warning,
};
use lookdown_detect::parameters::DetectDefaults;

use crate::calibration_store::StoreError;

/// Most characters of a camera's name that are repeated to its sender.
const MAX_NAME_CHARS: usize = 64;

/// A calibration that serves.
#[derive(Debug, Clone)]
pub struct CalibrationEntry {
    /// The checked camera.
    pub calibration: Arc<Calibration>,
    /// The same in the native format, whatever format its file has.
    pub native: NativeCalibration,
    /// The defaults of detection parameters for this camera.
    pub defaults: DetectDefaults,
    /// The assumptions of the reader.
    pub notes: Vec<Warning>,
    /// The name of its file in the store.
    pub file: String,
}

/// The cameras of a file, each under its ID.
pub(super) type Cameras = Vec<(String, Result<CalibrationEntry, FormatError>)>;

/// The cameras that the file called `name`, of the ID `stem`, holds.
pub(super) fn cameras(
    stem: &CalibrationId,
    name: &str,
    content: &[u8],
) -> Result<Cameras, FormatError> {
    let file = CalibrationFile::parse(content)?;
    let checked = file.calibrations(stem.as_str(), content);
    let is_alone = checked.len() == 1;
    let cameras = file.cameras.into_iter().zip(checked);
    let cameras = cameras.map(|(described, (id, checked))| {
        let entry = if is_alone && id != stem.as_str() {
            let problem =
                format!("it is {id:?}, but the file's name says \"{stem}\": make them equal");
            Err(FormatError::invalid("id", problem))
        } else {
            checked.and_then(|calibration| entry(calibration, described, name))
        };
        (id, entry)
    });
    Ok(cameras.collect())
}

fn entry(
    calibration: Calibration,
    described: FileCamera,
    name: &str,
) -> Result<CalibrationEntry, FormatError> {
    let described = described.camera?;
    let (width, height) = calibration.image_size();
    let defaults = defaults(&described.detect)?;
    Ok(CalibrationEntry {
        native: described.to_native(calibration.id().to_string(), NativeImage { width, height }),
        defaults,
        notes: described.notes,
        calibration: Arc::new(calibration),
        file: name.to_owned(),
    })
}

/// Checks the defaults of detection parameters in a calibration.
///
/// # Errors
/// [`FormatError`] for a parameter without defaults, and a value out of range.
pub fn defaults(detect: &BTreeMap<String, NativeValue>) -> Result<DetectDefaults, FormatError> {
    let texts: Vec<_> = detect
        .iter()
        .map(|(name, value)| (name.as_str(), value.to_string()))
        .collect();
    let pairs = texts.iter().map(|(name, value)| (*name, value.as_str()));
    DetectDefaults::parse(pairs)
        .map_err(|error| FormatError::invalid(format!("detect.{}", error.name), error.problem))
}

impl CalibrationEntry {
    /// The content of its native file.
    pub fn native_file(&self) -> String {
        // The native format has a place for everything.
        let exported = Target::Native.write(&self.native);
        exported.map_or_else(|_| String::new(), |exported| exported.content)
    }
}

/// The options for reading an uploaded file.
#[derive(Debug, Clone, Default)]
pub struct Reading {
    /// The camera of the file that is meant, by its name there, if there are several.
    pub camera: Option<String>,
    /// The size of the frames, for formats that do not have it.
    pub size: Option<NativeImage>,
}

/// The calibration `id` that an upload means, as the native file called `name`: its only camera, or
/// the one that `reading` names.
pub(super) fn import(
    id: &CalibrationId,
    name: &str,
    content: &[u8],
    reading: &Reading,
) -> Result<(CalibrationEntry, String), ChangeError> {
    let mut file = CalibrationFile::parse(content)?;
    if let Some(size) = reading.size {
        file.assume_size(size)?;
    }
    let camera = reading.camera.as_deref();
    let names: Vec<_> = file
        .cameras
        .iter()
        .enumerate()
        .map(|(index, camera)| camera.name.clone().unwrap_or_else(|| index.to_string()))
        .collect();
    let chosen = match camera {
        Some(wanted) => names.iter().position(|name| name == wanted),
        None if names.len() == 1 => Some(0),
        None => {
            return Err(ChangeError::SeveralCameras {
                names: names.iter().map(|name| shown(name)).collect(),
            });
        }
    };
    let Some(chosen) = chosen else {
        return Err(ChangeError::UnknownCamera {
            camera: shown(camera.unwrap_or_default()),
            names: names.iter().map(|name| shown(name)).collect(),
        });
    };
    let described = file.cameras.swap_remove(chosen);
    file.cameras = vec![described];
    let (found, checked) = file.calibrations(id.as_str(), content).swap_remove(0);
    if found != id.as_str() {
        let problem = format!("it is {found:?}, but the address says \"{id}\": make them equal");
        return Err(FormatError::invalid("id", problem).into());
    }
    let imported = entry(checked?, file.cameras.swap_remove(0), name)?;
    let written = imported.native_file();
    // What is stored must read back: it will be read by others, and after the next start.
    let (_, stored) = cameras(id, name, written.as_bytes())?.swap_remove(0);
    let stored = CalibrationEntry {
        notes: imported.notes,
        ..stored?
    };
    Ok((stored, written))
}

/// As much of a camera's name as helps its sender.
fn shown(name: &str) -> String {
    name.chars().take(MAX_NAME_CHARS).collect()
}

/// A calibration that was not changed, or that could not be read back afterwards. Every message is
/// one sentence with the remedy.
#[derive(Debug, thiserror::Error)]
pub enum ChangeError {
    /// The operator has switched changes off.
    #[error(
        "calibrations are not changed through this server (calibrations.writable is false): change \
         them where they are stored"
    )]
    NotWritable,
    /// There is no such calibration.
    #[error("there is no calibration \"{id}\": GET /calibrations lists those there are")]
    Unknown {
        /// The ID.
        id: CalibrationId,
    },
    /// The calibration belongs to a sample frame and is part of the program.
    #[error(
        "calibration \"{id}\" is built in and cannot be deleted: leave it, or store another one under this ID"
    )]
    Sample {
        /// The ID.
        id: CalibrationId,
    },
    /// The content makes no calibration.
    #[error(transparent)]
    Content(#[from] FormatError),
    /// The content holds several cameras and none was chosen.
    #[error(
        "the file holds {} cameras: choose one with ?camera=NAME: {}", names.len(), names.join(", ")
    )]
    SeveralCameras {
        /// Their names.
        names: Vec<String>,
    },
    /// The content does not hold the camera that was chosen.
    #[error("camera: the file holds {}, not {camera:?}", names.join(", "))]
    UnknownCamera {
        /// The name asked for.
        camera: String,
        /// The names there are.
        names: Vec<String>,
    },
    /// The calibration is not at the revision that the change was made for.
    #[error(
        "the calibration is {now}, which the condition of the request does not allow: get it, look \
         at what has changed, and send your change again"
    )]
    Outdated {
        /// The description of the problem.
        now: String,
    },
    /// The calibration shares its file with others.
    #[error("{file} holds several cameras ({}): change that file itself", ids.join(", "))]
    Shared {
        /// The name of the file.
        file: String,
        /// The IDs of the cameras.
        ids: Vec<String>,
    },
    /// The change was made, but could not be read back.
    #[error("the calibration was changed, but {0}")]
    Unseen(StoreError),
    /// The store did not do it.
    #[error(transparent)]
    Store(StoreError),
}

impl From<StoreError> for ChangeError {
    fn from(error: StoreError) -> Self {
        match error {
            StoreError::Changed { .. } => Self::Outdated {
                now: "being changed by another writer".to_owned(),
            },
            error => Self::Store(error),
        }
    }
}
