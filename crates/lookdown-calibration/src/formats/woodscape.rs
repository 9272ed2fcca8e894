//! `WoodScape`: `intrinsic` with the radius in pixels as a polynomial of the angle
//! (<https://github.com/valeoai/WoodScape>, `scripts/calibration`).
//!
//! The principal point is an offset from the center of the image, which lies half a pixel before
//! `width / 2` because pixel centers are whole numbers.

use super::{Camera, FormatError, fields::Fields};
use lookdown_lens::geometry::lens::RadialPolynomial;

pub(super) fn read(fields: &Fields<'_>) -> Result<Camera, FormatError> {
    let intrinsic = fields.child("intrinsic")?;
    if intrinsic.has("model") && intrinsic.text("model")? != "radial_poly" {
        let problem = format!("it is {:?}: radial_poly is read", intrinsic.text("model")?);
        return Err(intrinsic.invalid("model", problem));
    }
    let image = intrinsic.image("width", "height")?;
    let center = |side: u32| f64::from(side) / 2.0 - 0.5;
    let [k1, k2, k3, k4] = intrinsic.each(["k1", "k2", "k3", "k4"])?;
    let aspect = intrinsic.number_or("aspect_ratio", 1.0)?;
    let cx = intrinsic.number("cx_offset")? + center(image.width);
    let cy = intrinsic.number("cy_offset")? + center(image.height);
    let lens = RadialPolynomial {
        aspect,
        ..RadialPolynomial::new(vec![0.0, k1, k2, k3, k4], [cx, cy])
    };
    Ok(Camera::new(Some(image), lens))
}
