//! MultiCol-SLAM's `InteriorOrientationFisheye*.yaml`, known from the `LaFiDa` data set:
//! Scaramuzza's model with x along the columns (<https://github.com/urbste/MultiCol-SLAM>,
//! `cam_model_omni.cpp`).
//!
//! Flat `Camera.key: value` lines. Published files leave out the space after some colons, which
//! YAML would not read, so they are read line by line.

use std::collections::HashMap;

use super::{Camera, FormatError, column_first::ColumnFirst, fields::whole_pixels};
use crate::native::NativeImage;

/// Most coefficients of a polynomial; real ones have five.
const MAX_COEFFICIENTS: u32 = 64;

pub(super) fn read(text: &str) -> Result<Camera, FormatError> {
    let settings = Settings::new(text);
    let count = settings.whole("nrpol")?;
    if !(1..=MAX_COEFFICIENTS).contains(&count) {
        return Err(FormatError::invalid(
            "Camera.nrpol",
            format!("it is {count}: 1 to {MAX_COEFFICIENTS} coefficients are read"),
        ));
    }
    let polynomial: Result<_, _> = (0..count)
        .map(|index| settings.number(&format!("a{index}")))
        .collect();
    let lens = ColumnFirst {
        polynomial: polynomial?,
        c: settings.number("c")?,
        d: settings.number("d")?,
        e: settings.number("e")?,
        cx: settings.number("u0")?,
        cy: settings.number("v0")?,
    };
    let image = NativeImage {
        width: settings.whole("Iw")?,
        height: settings.whole("Ih")?,
    };
    Ok(Camera::new(Some(image), lens.into_lens()?))
}

/// The values of the `Camera.` keys.
struct Settings<'a>(HashMap<&'a str, &'a str>);

impl<'a> Settings<'a> {
    fn new(text: &'a str) -> Self {
        let entries = text.lines().filter_map(|line| {
            let line = line.split('#').next()?;
            let (key, value) = line.split_once(':')?;
            Some((key.trim().strip_prefix("Camera.")?, value.trim()))
        });
        Self(entries.collect())
    }

    fn number(&self, key: &str) -> Result<f64, FormatError> {
        let name = format!("Camera.{key}");
        let Some(value) = self.0.get(key) else {
            return Err(FormatError::invalid(name, "it is missing from the file"));
        };
        value.parse().map_err(|_| {
            let value: String = value.chars().take(40).collect();
            FormatError::invalid(name, format!("it is {value:?}: a number is needed"))
        })
    }

    fn whole(&self, key: &str) -> Result<u32, FormatError> {
        let number = self.number(key)?;
        whole_pixels(number).ok_or_else(|| {
            FormatError::invalid(
                format!("Camera.{key}"),
                format!("it is {number}: a whole number is needed"),
            )
        })
    }
}
