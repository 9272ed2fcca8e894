//! Calibration files: from a path to checked cameras under their IDs.

use std::path::Path;

use lookdown_common::files::{self, FileError};
use nalgebra::{Unit, Vector3};

use super::{
    Areas, Calibration, CalibrationId,
    formats::{CalibrationFile, Camera, FileCamera, Format, FormatError},
    native::{NativeImage, NativeMount},
    plausibility,
    revision::revision_of,
    site::site_placement,
};
use lookdown_lens::geometry::{Lens, Mount};

/// Image sides accepted, pixels.
const IMAGE_SIDE: std::ops::RangeInclusive<u32> = 16..=65_536;
/// The height of a camera above the floor, meters.
const HEIGHT_M: std::ops::RangeInclusive<f64> = 0.01..=1000.0;
/// The largest deviation of `world_up` from unit length.
const UNIT_TOLERANCE: f64 = 1e-3;

/// The content of a calibration file, at most a byte more than [`CalibrationFile::parse`] accepts.
///
/// # Errors
/// [`FileError`].
pub fn content(path: &Path) -> Result<Vec<u8>, FileError> {
    // One byte more than is accepted, so that a larger file is recognized.
    files::read_start(path, CalibrationFile::MAX_BYTES as u64 + 1)
        .map_err(|error| FileError::unreadable(path, &error))
}

impl Calibration {
    /// Reads a calibration file with one camera, in any format of [`super::formats`].
    ///
    /// # Errors
    /// [`FileError`] when it cannot be read, is malformed, describes no camera or several.
    pub fn read(path: &Path) -> Result<Self, FileError> {
        read_camera(path, None).map(|(calibration, _)| calibration)
    }
}

/// Reads a file of any format: its only camera, or the one with this ID, checked and as stated.
///
/// # Errors
/// [`FileError`] when the file cannot be read or is malformed, when it does not have that
/// camera or has several, or when the camera cannot be used.
pub fn read_camera(path: &Path, id: Option<&str>) -> Result<(Calibration, Camera), FileError> {
    let in_file = |problem: FormatError| FileError::new(path, problem.to_string());
    let content = content(path)?;
    let mut file = CalibrationFile::parse(&content).map_err(in_file)?;
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let mut checked = file.calibrations(&stem, &content);
    let index = match id {
        Some(id) => checked.iter().position(|(found, _)| found == id),
        None => (checked.len() == 1).then_some(0),
    };
    let Some(index) = index else {
        let ids: Vec<_> = checked.iter().map(|(id, _)| id.as_str()).collect();
        return Err(in_file(not_one_of(&ids, id)));
    };
    let calibration = checked.swap_remove(index).1.map_err(in_file)?;
    let stated = file.cameras.swap_remove(index).camera.map_err(in_file)?;
    Ok((calibration, stated))
}

/// The problem of a file with these cameras, of which none has the ID that is wanted, or of which
/// one must be wanted.
fn not_one_of(ids: &[&str], wanted: Option<&str>) -> FormatError {
    let names = ids.join(", ");
    match wanted {
        Some(wanted) => {
            FormatError::invalid("camera", format!("the file holds {names}, not {wanted:?}"))
        }
        None => FormatError::invalid(
            "cameras",
            format!(
                "the file holds {}: name one of {names}, or take one out with `lookdown calibration \
                 convert --camera`",
                ids.len()
            ),
        ),
    }
}

/// A camera of a file under its ID.
type Checked = (String, Result<Calibration, FormatError>);

impl CalibrationFile {
    /// The file's cameras, checked, under the IDs they have when the file is called `stem`: a
    /// native file has its ID, a single camera has the name of its file, and one of several the
    /// file's and its own, as in `lobby-cam0`.
    pub fn calibrations(&self, stem: &str, content: &[u8]) -> Vec<Checked> {
        let several = self.cameras.len() > 1;
        let checked = self.cameras.iter().enumerate().map(|(index, entry)| {
            let id = self.id(stem, several.then_some(index), entry);
            let calibration = entry
                .camera
                .clone()
                .and_then(|camera| check(&id, &camera, content));
            (id, calibration)
        });
        checked.collect()
    }

    fn id(&self, stem: &str, index: Option<usize>, entry: &FileCamera) -> String {
        match (&entry.name, index) {
            (Some(id), _) if self.format == Format::Native => id.clone(),
            (_, None) => CalibrationId::from_names(stem, None),
            (Some(name), Some(_)) => CalibrationId::from_names(stem, Some(name)),
            (None, Some(index)) => CalibrationId::from_names(stem, Some(&index.to_string())),
        }
    }
}

/// Checks a camera's values.
fn check(id: &str, camera: &Camera, content: &[u8]) -> Result<Calibration, FormatError> {
    let invalid = |field: &str, problem: String| FormatError::invalid(field, problem);
    let id: CalibrationId = id
        .parse()
        .map_err(|error| invalid("id", format!("{error}")))?;
    let Some(NativeImage { width, height }) = camera.image else {
        return Err(FormatError::MissingSize);
    };
    if !(IMAGE_SIDE.contains(&width) && IMAGE_SIDE.contains(&height)) {
        let (least, most) = IMAGE_SIDE.into_inner();
        let problem = format!("{width}×{height} pixels; each side must be {least} to {most}");
        return Err(invalid("image", problem));
    }
    let ends_explicitly = camera.lens.max_theta().is_some();
    let lens = Lens::new(&camera.lens).map_err(|error| invalid("lens", error.to_string()))?;
    let mount = mount(&camera.mount).map_err(|problem| invalid("mount", problem))?;
    let whole = Calibration {
        id,
        revision: revision_of(content),
        image_width: width,
        image_height: height,
        lens,
        mount,
        areas: Areas::checked(camera, NativeImage { width, height }, &mount)?,
        site: site_placement(&camera.mount)?,
    };
    let within_frame = whole.clone().limited_to_image();
    plausibility::check(whole.lens(), width, height, within_frame.lens().max_theta())
        .map_err(|problem| invalid("lens", problem))?;
    // Where the file does not say where the lens image ends, it ends with the frame.
    Ok(if ends_explicitly { whole } else { within_frame })
}

fn mount(raw: &NativeMount) -> Result<Mount, String> {
    let up = Vector3::from(raw.world_up);
    let length = up.norm();
    // Written so that a length that is not a number is refused, too.
    let is_unit = (length - 1.0).abs() <= UNIT_TOLERANCE;
    if !is_unit {
        let [x, y, z] = raw.world_up;
        return Err(format!(
            "world_up is [{x}, {y}, {z}], of length {length:.3}: give a unit vector, such as \
             [0, 0, -1] for a camera that looks straight down"
        ));
    }
    if let Some(height) = raw.height_m
        && !HEIGHT_M.contains(&height)
    {
        return Err(format!(
            "height_m is {height}: give {} to {} meters, or leave it out",
            HEIGHT_M.start(),
            HEIGHT_M.end()
        ));
    }
    Ok(Mount::new(Unit::new_normalize(up), raw.height_m))
}

#[cfg(test)]
mod tests;
