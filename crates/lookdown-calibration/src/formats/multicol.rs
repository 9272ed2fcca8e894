//! MultiCol-SLAM's `InteriorOrientationFisheye*.yaml`, known from the `LaFiDa` data set:
//! Scaramuzza's model with x along the columns (<https://github.com/urbste/MultiCol-SLAM>,
//! `cam_model_omni.cpp`).
//!
//! Flat `Camera.key: value` lines. Published files leave out the space after some colons, which
//! YAML would not read, so they are read line by line.

use serde_json::Value;

use super::{Camera, FormatError, column_first::ColumnFirst, fields::Fields};

/// Most coefficients of a polynomial; real ones have five.
const MAX_COEFFICIENTS: f64 = 64.0;

pub(super) fn read(text: &str) -> Result<Camera, FormatError> {
    let entries = text.lines().filter_map(|line| {
        let (key, value) = line.split('#').next()?.split_once(':')?;
        Some((key.trim().to_owned(), Value::from(value.trim())))
    });
    let settings = Value::Object(entries.collect());
    let settings = Fields::new(&settings)?;
    let count = settings.number("Camera.nrpol")?;
    if !(1.0..=MAX_COEFFICIENTS).contains(&count) {
        let problem = format!("it is {count}: 1 to {MAX_COEFFICIENTS} coefficients are read");
        return Err(settings.invalid("Camera.nrpol", problem));
    }
    let indices = (0_u32..).take_while(|index| f64::from(*index) < count);
    let polynomial = indices.map(|index| settings.number(&format!("Camera.a{index}")));
    let lens = ColumnFirst {
        polynomial: polynomial.collect::<Result<_, _>>()?,
        affine: settings.each(["Camera.c", "Camera.d", "Camera.e"])?,
        center: settings.each(["Camera.u0", "Camera.v0"])?,
    };
    let image = settings.image("Camera.Iw", "Camera.Ih")?;
    Ok(Camera::new(Some(image), lens.into_lens()?))
}
