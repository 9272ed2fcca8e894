//! `fisheyeIntrinsics` or `fisheyeParameters` of MATLAB as `jsonencode` writes them
//! (<https://www.mathworks.com/help/vision/ref/fisheyeintrinsics.html>): Scaramuzza's model with x
//! along the columns and z out of the lens.
//!
//! The polynomial has no linear term: `a0 a2 a3 a4`. The size is height, then width. The first
//! pixel has its center at 1.

use super::{
    Camera, FormatError,
    column_first::ColumnFirst,
    fields::{Fields, whole_pixels},
};
use crate::native::NativeImage;

/// The field that marks the format.
pub(super) const POLYNOMIAL: &str = "MappingCoefficients";

pub(super) fn read(fields: &Fields<'_>) -> Result<Camera, FormatError> {
    let intrinsics = "Intrinsics";
    let camera = if fields.has(intrinsics) {
        fields.child(intrinsics)?
    } else {
        fields.clone()
    };
    let [a0, a2, a3, a4] = camera.exactly(POLYNOMIAL, "a0, a2, a3, a4")?;
    let names = ["DistortionCenter", "StretchMatrix"];
    let mut lens = ColumnFirst::read(&camera, names, &[a0, 0.0, a2, a3, a4])?;
    (lens.cx, lens.cy) = (lens.cx - 1.0, lens.cy - 1.0);
    let size = "ImageSize";
    let sides = camera.exactly(size, "height and width")?.map(whole_pixels);
    let [Some(height), Some(width)] = sides else {
        return Err(camera.invalid(size, "whole numbers of pixels are needed"));
    };
    Ok(Camera::new(
        Some(NativeImage { width, height }),
        lens.into_lens()?,
    ))
}
