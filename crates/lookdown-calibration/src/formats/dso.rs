//! Camera files of DSO and of the data sets in its form (`camera.txt`): a model with its
//! parameters, the size of the frames, and two lines about the rectification
//! (<https://github.com/JakobEngel/dso#geometric-calibration-file>).
//!
//! `fx fy cx cy` are shares of the width and the height if `cx` and `cy` are below 1, and the first
//! pixel then begins at 0. Old files have no name of a model: 5 parameters are `FOV`, 8 `RadTan`.

use lookdown_lens::geometry::{
    Pixel,
    lens::{Fov, KannalaBrandt, LensModel, Rectilinear},
    pixels::to_pixel_center,
};

use super::{
    Camera, FormatError,
    camera_matrix::{are_all_zero, not_a_fisheye},
};
use crate::native::NativeImage;

/// Returns true for a text that begins with a model and the size of the frames.
pub(super) fn is_camera(text: &str) -> bool {
    parts(text).is_some_and(|(model, numbers, _)| match model {
        "" => [5, 8].contains(&numbers.len()),
        _ => ["Pinhole", "FOV", "RadTan", "EquiDistant", "KannalaBrandt"].contains(&model),
    })
}

pub(super) fn read(text: &str) -> Result<Camera, FormatError> {
    let (model, numbers, image) = parts(text).ok_or_else(incomplete)?;
    let lens = lens(model, &numbers, image)?;
    Ok(Camera::new(Some(image), lens))
}

fn incomplete() -> FormatError {
    FormatError::malformed("its first two lines are not those of DSO: a model and the size")
}

/// The name of the model, its parameters and the size of the frames.
fn parts(text: &str) -> Option<(&str, Vec<f64>, NativeImage)> {
    let mut lines = text.lines().map(str::trim).filter(|line| !line.is_empty());
    let first = lines.next()?;
    let begin = first.find(|letter: char| !letter.is_ascii_alphabetic())?;
    let (model, numbers) = first.split_at(begin);
    let numbers: Result<Vec<f64>, _> = numbers.split_whitespace().map(str::parse).collect();
    let (width, height) = lines.next()?.split_once(char::is_whitespace)?;
    let (width, height) = (width.parse().ok()?, height.trim().parse().ok()?);
    let numbers = numbers.ok().filter(|numbers| numbers.len() >= 4)?;
    Some((model, numbers, NativeImage { width, height }))
}

fn lens(model: &str, numbers: &[f64], image: NativeImage) -> Result<LensModel, FormatError> {
    let &[fx, fy, cx, cy, ref distortion @ ..] = numbers else {
        return Err(incomplete());
    };
    let pinhole = if cx < 1.0 && cy < 1.0 {
        let (width, height) = (f64::from(image.width), f64::from(image.height));
        let center = Pixel::new(cx * width, cy * height);
        let center = to_pixel_center(center);
        [fx * width, fy * height, center.x, center.y]
    } else {
        [fx, fy, cx, cy]
    };
    Ok(match (model, distortion) {
        ("EquiDistant" | "KannalaBrandt", &[k1, k2, k3, k4]) => {
            KannalaBrandt::new(pinhole, [k1, k2, k3, k4]).into()
        }
        ("FOV" | "", &[omega]) if omega != 0.0 => Fov::new(pinhole, omega).into(),
        ("RadTan" | "", [_, _, ..]) if !are_all_zero(distortion) => {
            return Err(FormatError::invalid("model", not_a_fisheye("RadTan")));
        }
        ("Pinhole" | "FOV" | "RadTan" | "", _) if are_all_zero(distortion) => {
            Rectilinear::new(pinhole).into()
        }
        _ => {
            let count = distortion.len();
            let problem = format!("{model} has {count} coefficients: FOV needs 1, EquiDistant 4");
            return Err(FormatError::invalid("parameters", problem));
        }
    })
}
