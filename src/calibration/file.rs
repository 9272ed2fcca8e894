//! The native calibration file: JSON, or YAML and TOML of the same shape.

use std::path::Path;

use nalgebra::{Unit, Vector3};

use super::{
    Calibration, CalibrationError, CalibrationId,
    native::{NativeCalibration, NativeImage, NativeMount},
    plausibility,
};
use crate::geometry::Mount;

/// File endings that are read, in the order in which they are looked for.
pub(super) const ENDINGS: [&str; 4] = ["json", "yaml", "yml", "toml"];
/// Largest file that is read: a real calibration has a few hundred bytes.
const MAX_BYTES: u64 = 1024 * 1024;
/// Image sides accepted, pixels.
const IMAGE_SIDE: std::ops::RangeInclusive<u32> = 16..=65_536;
/// How far from unit length `world_up` may be.
const UNIT_TOLERANCE: f64 = 1e-3;

/// Reads and checks one file.
pub(super) fn read(path: &Path) -> Result<Calibration, CalibrationError> {
    let unreadable = |source| CalibrationError::Unreadable {
        path: path.to_owned(),
        source,
    };
    let size = std::fs::metadata(path).map_err(unreadable)?.len();
    if size > MAX_BYTES {
        return Err(malformed(
            path,
            format!("it has {size} bytes; at most {MAX_BYTES} are read"),
        ));
    }
    let bytes = std::fs::read(path).map_err(unreadable)?;
    let text = std::str::from_utf8(&bytes).map_err(|error| malformed(path, error.to_string()))?;
    let raw = parse(path, text)?;
    check(path, raw, &bytes)
}

fn malformed(path: &Path, detail: String) -> CalibrationError {
    CalibrationError::Malformed {
        path: path.to_owned(),
        detail,
    }
}

fn parse(path: &Path, text: &str) -> Result<NativeCalibration, CalibrationError> {
    let ending = path.extension().and_then(|ending| ending.to_str());
    let parsed = match ending {
        Some("json") => serde_json::from_str(text).map_err(|error| error.to_string()),
        Some("yaml" | "yml") => serde_saphyr::from_str(text).map_err(|error| first_line(&error)),
        Some("toml") => toml::from_str(text)
            .map_err(|error| format!("{}: {}", first_line(&error), error.message())),
        _ => Err(format!(
            "its name must end in one of {}",
            ENDINGS.join(", ")
        )),
    };
    parsed.map_err(|detail| malformed(path, detail))
}

/// What a parser says before it draws the place.
fn first_line(error: &impl std::fmt::Display) -> String {
    let text = error.to_string();
    text.lines().next().unwrap_or_default().to_owned()
}

fn check(
    path: &Path,
    raw: NativeCalibration,
    bytes: &[u8],
) -> Result<Calibration, CalibrationError> {
    let invalid = |field, problem| CalibrationError::Invalid {
        path: path.to_owned(),
        field,
        problem,
    };
    let id: CalibrationId = raw
        .id
        .parse()
        .map_err(|error| invalid("id", format!("{error}")))?;
    let NativeImage { width, height } = raw.image;
    if !(IMAGE_SIDE.contains(&width) && IMAGE_SIDE.contains(&height)) {
        let (least, most) = IMAGE_SIDE.into_inner();
        let problem = format!("{width}×{height} pixels; each side must be {least} to {most}");
        return Err(invalid("image", problem));
    }
    let ends_explicitly = raw.lens.max_theta().is_some();
    let lens = raw
        .lens
        .into_lens()
        .map_err(|error| invalid("lens", error.to_string()))?;
    let mount = mount(&raw.mount).map_err(|problem| invalid("mount", problem))?;
    let whole = Calibration::new(id, bytes, width, height, lens, mount);
    let within_frame = whole.clone().limited_to_image();
    plausibility::check(whole.lens(), width, height, within_frame.lens().max_theta())
        .map_err(|problem| invalid("lens", problem))?;
    // Where the file does not say where the lens image ends, it ends with the frame.
    Ok(if ends_explicitly { whole } else { within_frame })
}

fn mount(raw: &NativeMount) -> Result<Mount, String> {
    let up = Vector3::from(raw.world_up);
    let length = up.norm();
    // Written so that a length that is no number is refused, too.
    let is_unit = (length - 1.0).abs() <= UNIT_TOLERANCE;
    if !is_unit {
        let [x, y, z] = raw.world_up;
        return Err(format!(
            "world_up is [{x}, {y}, {z}], of length {length:.3}: give a unit vector, such as \
             [0, 0, -1] for a camera that looks straight down"
        ));
    }
    if let Some(height) = raw.height_m
        && !(height.is_finite() && height > 0.0)
    {
        return Err(format!(
            "height_m is {height}: give metres above 0, or leave it out"
        ));
    }
    Ok(Mount::new(Unit::new_normalize(up), raw.height_m))
}

#[cfg(test)]
mod tests;
