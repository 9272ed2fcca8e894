//! camodocal, as VINS-Mono, VINS-Fusion and AQUALOC store it: `model_type` `MEI` or
//! `KANNALA_BRANDT` (<https://github.com/hengli/camodocal>, `camera_models`).
//!
//! Its coefficients of Kannala and Brandt are called `k2` to `k5`, after the index of their power:
//! they are `k1` to `k4` everywhere else.

use lookdown_lens::geometry::lens::{KannalaBrandt, LensModel, Mei};

use super::{Camera, FormatError, camera_matrix::not_a_fisheye, fields::Fields};

pub(super) fn read(fields: &Fields<'_>) -> Result<Camera, FormatError> {
    let lens: LensModel = match fields.text("model_type")? {
        "MEI" => {
            let projection = fields.child("projection_parameters")?;
            let distortion = fields.child("distortion_parameters")?;
            let mirror = fields.child("mirror_parameters")?;
            let pinhole = projection.each(["gamma1", "gamma2", "u0", "v0"])?;
            let xi = mirror.number("xi")?;
            let [k1, k2, p1, p2] = distortion.each(["k1", "k2", "p1", "p2"])?;
            Mei::new(pinhole, xi, k1, k2, p1, p2).into()
        }
        "KANNALA_BRANDT" => {
            let projection = fields.child("projection_parameters")?;
            let pinhole = projection.each(["mu", "mv", "u0", "v0"])?;
            let k = projection.each(["k2", "k3", "k4", "k5"])?;
            KannalaBrandt::new(pinhole, k).into()
        }
        model @ ("PINHOLE" | "PINHOLE_FULL") => {
            return Err(fields.invalid("model_type", not_a_fisheye(model)));
        }
        other => {
            return Err(fields.invalid(
                "model_type",
                format!("it is {other:?}: MEI and KANNALA_BRANDT are read"),
            ));
        }
    };
    let image = fields.image("image_width", "image_height")?;
    Ok(Camera::new(Some(image), lens))
}
