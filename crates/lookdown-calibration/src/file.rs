//! Calibration files: from a path to checked cameras under their IDs.
//!
//! The check that a lens and a frame belong together: most wrong calibrations are right ones for
//! another frame size.

use std::{f64::consts::FRAC_PI_2, path::Path};

use lookdown_common::files::{self, FileError};
use lookdown_lens::geometry::{Lens, Mount, Pixel, Ray};
use nalgebra::{Unit, Vector3};

use crate::{
    Areas, Calibration, CalibrationId,
    formats::{CalibrationFile, Camera, FileCamera, Format, FormatError},
    native::{NativeImage, NativeMount},
    revision::revision_of,
    site::site_placement,
};

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
    check_plausibility(whole.lens(), width, height, within_frame.lens().max_theta())
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

/// Pixels may be this much wider than high, or higher than wide: half-resolution video is.
const MAX_PIXEL_ASPECT: f64 = 2.5;
/// The lens image is at least this large, in units of the frame's shorter side.
const MIN_RIM_RADIUS: f64 = 0.125;
/// A frame whose corners are less off the axis than this was not made by a wide-angle lens,
/// radians.
const MIN_CORNER_THETA: f64 = 0.2;
/// A frame shows at least this share of the half space that its lens claims to see.
const MIN_CORNER_SHARE: f64 = 1.0 / 3.0;
/// An angle near the axis, where every lens is affine, radians.
const NEAR_AXIS: f64 = 1e-4;

/// Checks `lens` for frames of `width` × `height` pixels, of whose image the farthest
/// point is `corner_theta` radians off the axis.
fn check_plausibility(
    lens: &Lens,
    width: u32,
    height: u32,
    corner_theta: f64,
) -> Result<(), String> {
    let center = lens.principal_point();
    let (frame_width, frame_height) = (f64::from(width), f64::from(height));
    let is_inside = (-0.5..=frame_width - 0.5).contains(&center.x)
        && (-0.5..=frame_height - 0.5).contains(&center.y);
    if !is_inside {
        return Err(format!(
            "its center, cx {} and cy {}, lies outside the frame of {width}×{height} pixels: give \
             both in pixels of that frame",
            center.x, center.y
        ));
    }
    let near_axis = |x, y| distance(lens, center, &Ray::new(x, y, 1.0));
    let aspect = near_axis(NEAR_AXIS, 0.0) / near_axis(0.0, NEAR_AXIS);
    if !(1.0 / MAX_PIXEL_ASPECT..=MAX_PIXEL_ASPECT).contains(&aspect) {
        return Err(format!(
            "an angle is {aspect:.3} times as long across the frame as down it: the horizontal and \
             the vertical focal length (fx and fy, aspect, or c) belong to different images"
        ));
    }
    let rim = Ray::new(lens.max_theta().sin(), 0.0, lens.max_theta().cos());
    let rim_radius = distance(lens, center, &rim);
    if rim_radius < MIN_RIM_RADIUS * frame_width.min(frame_height) {
        return Err(format!(
            "its image ends {rim_radius:.0} pixels from the center, a speck in a frame of \
             {width}×{height}: give the focal length and the image size of the same image"
        ));
    }
    let expected = MIN_CORNER_THETA.max(MIN_CORNER_SHARE * lens.max_theta().min(FRAC_PI_2));
    if corner_theta < expected.min(lens.max_theta()) {
        return Err(format!(
            "the corners of a frame of {width}×{height} pixels are only {:.1}° off its axis: give \
             the focal length and the image size of the same image",
            corner_theta.to_degrees()
        ));
    }
    Ok(())
}

/// Returns the distance from the center at which the lens shows `ray`, pixels; infinite where it
/// does not show it.
fn distance(lens: &Lens, center: Pixel, ray: &Ray) -> f64 {
    lens.project_to_rim(ray)
        .map_or(f64::INFINITY, |pixel| (pixel - center).norm())
}

#[cfg(test)]
mod tests;
