//! `fisheyeIntrinsics` or `fisheyeParameters` of MATLAB as `jsonencode` writes them
//! (<https://www.mathworks.com/help/vision/ref/fisheyeintrinsics.html>): Scaramuzza's model with x
//! along the columns and z out of the lens. `cameraIntrinsicsKB` has the model of `cv::fisheye`
//! (<https://www.mathworks.com/help/vision/ref/cameraintrinsicskb.html>).
//!
//! The polynomial has no linear term: `a0 a2 a3 a4`. The size is height, then width. The first
//! pixel has its center at 1.

use super::{
    Camera, FormatError,
    column_first::ColumnFirst,
    fields::{Fields, whole_pixels},
};
use crate::native::NativeImage;
use lookdown_lens::geometry::lens::KannalaBrandt;

const POLYNOMIAL: &str = "MappingCoefficients";
/// The fields that mark the format.
pub(super) const FIELDS: [&str; 2] = [POLYNOMIAL, "DistortionCoefficients"];

pub(super) fn read(fields: &Fields<'_>) -> Result<Camera, FormatError> {
    let camera = fields.or_child("Intrinsics")?;
    let size = "ImageSize";
    let sides = camera.exactly(size, "height and width")?.map(whole_pixels);
    let [Some(height), Some(width)] = sides else {
        return Err(camera.invalid(size, "whole numbers of pixels are needed"));
    };
    let image = Some(NativeImage { width, height });
    if camera.has(FIELDS[1]) {
        let [fx, fy] = camera.exactly("FocalLength", "fx, fy")?;
        let [cx, cy] = camera.exactly("PrincipalPoint", "column and row")?;
        let k = camera.exactly(FIELDS[1], "k1 to k4")?;
        let lens = KannalaBrandt::new([fx, fy, cx - 1.0, cy - 1.0], k);
        return Ok(Camera::new(image, lens));
    }
    let [a0, a2, a3, a4] = camera.exactly(POLYNOMIAL, "a0, a2, a3, a4")?;
    let names = ["DistortionCenter", "StretchMatrix"];
    let mut lens = ColumnFirst::read(&camera, names, &[a0, 0.0, a2, a3, a4])?;
    lens.center = lens.center.map(|pixel| pixel - 1.0);
    Ok(Camera::new(image, lens.into_lens()?))
}
