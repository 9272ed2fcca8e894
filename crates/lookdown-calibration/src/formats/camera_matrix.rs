//! A camera matrix with distortion coefficients, as OpenCV and ROS share it.

use super::{
    FormatError,
    distortion::{Distortion, are_all_zero, four, not_a_fisheye},
    fields::Fields,
};
use lookdown_lens::geometry::lens::{KannalaBrandt, LensModel, Pinhole, Rectilinear};

/// The 3×3 matrix, row by row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct CameraMatrix {
    pub(super) pinhole: Pinhole,
    /// Shift of the column per unit of y, pixels.
    pub(super) skew: f64,
}

impl CameraMatrix {
    /// Reads the matrix in a field.
    pub(super) fn read(fields: &Fields<'_>, key: &str) -> Result<Self, FormatError> {
        let [fx, skew, cx, zero, fy, cy, bottom @ ..] = fields.exactly::<9>(key, "3 rows of 3")?;
        if [fx, fy] == [0.0, 0.0] {
            return Err(
                fields.invalid(key, "its focal lengths are 0: the camera is not calibrated")
            );
        }
        if zero != 0.0 || bottom != [0.0, 0.0, 1.0] {
            return Err(fields.invalid(
                key,
                "its rows must be fx, skew, cx; 0, fy, cy; 0, 0, 1: it may be stored column by \
                 column",
            ));
        }
        Ok(Self {
            pinhole: [fx, fy, cx, cy],
            skew,
        })
    }

    /// The lens with this matrix and distortion; `model` and `coefficients` are the fields that
    /// the distortion came from.
    pub(super) fn lens(
        self,
        distortion: Distortion,
        values: &[f64],
        fields: &Fields<'_>,
        (model, coefficients): (&str, &str),
    ) -> Result<LensModel, FormatError> {
        match distortion {
            Distortion::Fisheye => {
                let k = four(values).map_err(|problem| fields.invalid(coefficients, problem))?;
                Ok(LensModel::from(KannalaBrandt {
                    skew: self.skew,
                    ..KannalaBrandt::new(self.pinhole, k)
                }))
            }
            Distortion::None | Distortion::RadialTangential if are_all_zero(values) => {
                Ok(Rectilinear::new(self.pinhole).into())
            }
            Distortion::None => {
                Err(fields.invalid(model, "it says none, but there are coefficients"))
            }
            Distortion::RadialTangential | Distortion::Fov => {
                let name = fields.text(model);
                let name = name.unwrap_or("radial and tangential distortion");
                Err(fields.invalid(model, not_a_fisheye(name)))
            }
        }
    }
}
