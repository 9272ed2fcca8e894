//! COLMAP's `cameras.txt`: a line per camera, `ID MODEL WIDTH HEIGHT PARAMS…`
//! (<https://colmap.github.io/cameras.html>).
//!
//! Its pixel coordinates begin at the corner of the first pixel: half a pixel is taken off the
//! principal point. `THIN_PRISM_FISHEYE` adds terms that no lens here has, so it is read only where
//! these are 0.

use lookdown_lens::geometry::{
    Pixel,
    lens::{Equidistant, Eucm, Fov, KannalaBrandt, LensModel, Rectilinear},
    pixels::to_pixel_center,
};

use super::{
    Camera, FileCamera, FormatError,
    camera_matrix::{are_all_zero, not_a_fisheye},
};
use crate::native::NativeImage;

pub(super) fn read(text: &str) -> Vec<FileCamera> {
    text.lines()
        .map(str::trim)
        .filter(|line| !(line.is_empty() || line.starts_with('#')))
        .map(|line| {
            let mut words = line.split_whitespace();
            let id = words.next().unwrap_or_default();
            FileCamera {
                name: Some(id.chars().take(20).collect()),
                camera: read_camera(&words.collect::<Vec<_>>()),
            }
        })
        .collect()
}

/// `MODEL WIDTH HEIGHT PARAMS…`
fn read_camera(words: &[&str]) -> Result<Camera, FormatError> {
    let [model, width, height, parameters @ ..] = words else {
        return Err(FormatError::invalid(
            "camera",
            "its line is too short: ID MODEL WIDTH HEIGHT PARAMS is needed",
        ));
    };
    let side = |word: &str| {
        word.parse()
            .map_err(|_| FormatError::invalid("WIDTH HEIGHT", "whole numbers of pixels are needed"))
    };
    let image = NativeImage {
        width: side(width)?,
        height: side(height)?,
    };
    let numbers: Result<Vec<f64>, _> = parameters.iter().map(|word| word.parse()).collect();
    let numbers = numbers.map_err(|_| FormatError::invalid("PARAMS", "numbers are needed"))?;
    Ok(Camera::new(Some(image), lens(model, &numbers)?))
}

fn lens(model: &str, parameters: &[f64]) -> Result<LensModel, FormatError> {
    let pinhole = |fx, fy, cx, cy| {
        let center = to_pixel_center(Pixel::new(cx, cy));
        [fx, fy, center.x, center.y]
    };
    Ok(match (model, parameters) {
        ("SIMPLE_PINHOLE", &[f, cx, cy]) => Rectilinear::new(pinhole(f, f, cx, cy)).into(),
        ("PINHOLE", &[fx, fy, cx, cy]) => Rectilinear::new(pinhole(fx, fy, cx, cy)).into(),
        ("SIMPLE_FISHEYE", &[f, cx, cy]) => Equidistant::new(pinhole(f, f, cx, cy)).into(),
        ("FISHEYE", &[fx, fy, cx, cy]) => Equidistant::new(pinhole(fx, fy, cx, cy)).into(),
        ("SIMPLE_RADIAL_FISHEYE", &[f, cx, cy, k]) => {
            KannalaBrandt::new(pinhole(f, f, cx, cy), [k, 0.0, 0.0, 0.0]).into()
        }
        ("RADIAL_FISHEYE", &[f, cx, cy, k1, k2]) => {
            KannalaBrandt::new(pinhole(f, f, cx, cy), [k1, k2, 0.0, 0.0]).into()
        }
        ("OPENCV_FISHEYE", &[fx, fy, cx, cy, k1, k2, k3, k4]) => {
            KannalaBrandt::new(pinhole(fx, fy, cx, cy), [k1, k2, k3, k4]).into()
        }
        ("THIN_PRISM_FISHEYE", &[fx, fy, cx, cy, k1, k2, p1, p2, k3, k4, sx1, sy1]) => {
            if !are_all_zero(&[p1, p2, sx1, sy1]) {
                return Err(FormatError::invalid(
                    "THIN_PRISM_FISHEYE",
                    format!(
                        "p1, p2, sx1, sy1 are {p1}, {p2}, {sx1}, {sy1}: tangential and thin-prism \
                         terms have no lens here, reconstruct with OPENCV_FISHEYE"
                    ),
                ));
            }
            KannalaBrandt::new(pinhole(fx, fy, cx, cy), [k1, k2, k3, k4]).into()
        }
        ("FOV", &[fx, fy, cx, cy, omega]) => Fov::new(pinhole(fx, fy, cx, cy), omega).into(),
        ("EUCM", &[fx, fy, cx, cy, alpha, beta]) => {
            Eucm::new(pinhole(fx, fy, cx, cy), alpha, beta).into()
        }
        ("SIMPLE_RADIAL" | "RADIAL" | "OPENCV" | "FULL_OPENCV", _) => {
            return Err(FormatError::invalid("MODEL", not_a_fisheye(model)));
        }
        _ => {
            return Err(FormatError::invalid(
                "MODEL",
                format!(
                    "it is {model} with {} parameters: OPENCV_FISHEYE (8), RADIAL_FISHEYE (5), \
                     SIMPLE_RADIAL_FISHEYE (4), FISHEYE (4), SIMPLE_FISHEYE (3), FOV (5), EUCM (6), \
                     THIN_PRISM_FISHEYE (12), PINHOLE (4) and SIMPLE_PINHOLE (3) are read",
                    parameters.len()
                ),
            ));
        }
    })
}
