//! The parameters of the known values of a camera.

use std::{ops::RangeInclusive, str::FromStr};

use anyhow::ensure;

use lookdown_detect::parameters::ParameterError;
use lookdown_lens::self_calibration::{FieldOfView, IdealLens, KnownCamera};
use strum::VariantNames;

/// The parameter of the projection of the lens.
pub(crate) const LENS: &str = "lens";
/// The parameter of the field of view of the lens circle.
pub(crate) const FIELD_OF_VIEW_DEG: &str = "field_of_view_deg";

/// The heights of cameras above the floor that can be given, meters.
const HEIGHTS_M: RangeInclusive<f64> = 0.01..=100.0;

/// Returns a height of a camera above the floor that was given, meters.
///
/// # Errors
/// A height that no camera has.
pub(crate) fn known_height(meters: f64) -> anyhow::Result<f64> {
    let (min, max) = (HEIGHTS_M.start(), HEIGHTS_M.end());
    ensure!(
        HEIGHTS_M.contains(&meters),
        "the height is {meters} m: give {min} to {max} meters"
    );
    Ok(meters)
}

/// Parses the known values of a camera: the name of an ideal lens and a field of view in degrees.
///
/// # Errors
/// [`ParameterError`] with the accepted values.
pub fn known_camera(
    lens: Option<&str>,
    field_of_view_deg: Option<&str>,
    is_on_ceiling: bool,
) -> Result<KnownCamera, ParameterError> {
    let lenses = format!("one of {}", IdealLens::VARIANTS.join(", "));
    let (min, max) = (FieldOfView::MIN_DEGREES, FieldOfView::MAX_DEGREES);
    let fields_of_view = format!("a number from {min} to {max}");
    Ok(KnownCamera {
        lens: parsed(LENS, lens, &lenses)?,
        field_of_view: parsed(FIELD_OF_VIEW_DEG, field_of_view_deg, &fields_of_view)?,
        is_on_ceiling,
    })
}

/// Parses an optional value; `rule` completes "… is not".
pub(crate) fn parsed<T: FromStr>(
    name: &str,
    value: Option<&str>,
    rule: &str,
) -> Result<Option<T>, ParameterError> {
    let refused = |value| ParameterError::is_not(name, value, rule);
    value
        .map(|value| value.parse().map_err(|_| refused(value)))
        .transpose()
}
