//! From the lens fields of a native file to a lens.

use super::native::{
    NativeFTheta, NativeIdeal, NativeKannalaBrandt, NativeLens, NativeMei, NativeOcam,
    NativeRadialPolynomial,
};
use crate::geometry::{
    Lens, LensError,
    lens::{FThetaPolynomial, ImagePlane, LensModel, RadialTangential},
};

/// Lens fields that make no lens.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum LensFieldsError {
    /// The focal length is missing, or given in two ways.
    #[error("give either focal, or both fx and fy")]
    FocalLengths,
    /// The polynomial of an `f_theta` lens is missing, or given in two ways.
    #[error("give either angle_to_pixel or pixel_to_angle, the one that is exact")]
    FThetaPolynomials,
    /// The values make no lens.
    #[error(transparent)]
    Lens(#[from] LensError),
}

type Parts = (LensModel, ImagePlane);

impl NativeLens {
    /// Where the file says that the lens image ends, radians.
    #[must_use]
    pub fn max_theta(&self) -> Option<f64> {
        match self {
            Self::Equidistant(fields)
            | Self::Equisolid(fields)
            | Self::Stereographic(fields)
            | Self::Orthographic(fields)
            | Self::Rectilinear(fields) => fields.max_theta,
            Self::RadialPolynomial(fields) => fields.max_theta,
            Self::KannalaBrandt(fields) => fields.max_theta,
            Self::Ucm(fields) => fields.max_theta,
            Self::Eucm(fields) => fields.max_theta,
            Self::Mei(fields) => fields.max_theta,
            Self::DoubleSphere(fields) => fields.max_theta,
            Self::Ocam(fields) => fields.max_theta,
            Self::Fov(fields) => fields.max_theta,
            Self::FTheta(fields) => fields.max_theta,
        }
    }

    /// The lens, checked.
    ///
    /// # Errors
    /// [`LensFieldsError`] when the fields make no lens.
    pub fn into_lens(self) -> Result<Lens, LensFieldsError> {
        let max_theta = self.max_theta();
        let (model, plane) = match self {
            Self::Equidistant(fields) => ideal(LensModel::Equidistant, &fields)?,
            Self::Equisolid(fields) => ideal(LensModel::Equisolid, &fields)?,
            Self::Stereographic(fields) => ideal(LensModel::Stereographic, &fields)?,
            Self::Orthographic(fields) => ideal(LensModel::Orthographic, &fields)?,
            Self::Rectilinear(fields) => ideal(LensModel::Rectilinear, &fields)?,
            Self::RadialPolynomial(fields) => radial_polynomial(fields)?,
            Self::KannalaBrandt(fields) => kannala_brandt(&fields),
            Self::Ucm(fields) => (
                LensModel::Ucm {
                    alpha: fields.alpha,
                },
                ImagePlane::new(fields.fx, fields.fy, fields.cx, fields.cy),
            ),
            Self::Eucm(fields) => (
                LensModel::Eucm {
                    alpha: fields.alpha,
                    beta: fields.beta,
                },
                ImagePlane::new(fields.fx, fields.fy, fields.cx, fields.cy),
            ),
            Self::Mei(fields) => mei(&fields),
            Self::DoubleSphere(fields) => (
                LensModel::DoubleSphere {
                    xi: fields.xi,
                    alpha: fields.alpha,
                },
                ImagePlane::new(fields.fx, fields.fy, fields.cx, fields.cy),
            ),
            Self::Ocam(fields) => ocam(fields)?,
            Self::Fov(fields) => (
                LensModel::Fov {
                    omega: fields.omega,
                },
                ImagePlane::new(fields.fx, fields.fy, fields.cx, fields.cy),
            ),
            Self::FTheta(fields) => f_theta(&fields)?,
        };
        Ok(Lens::new(model, plane, max_theta)?)
    }
}

fn ideal(model: LensModel, fields: &NativeIdeal) -> Result<Parts, LensFieldsError> {
    let (fx, fy) = match (fields.focal, fields.fx, fields.fy) {
        (Some(focal), None, None) => {
            let focal = positive("focal", focal)?;
            (focal, focal)
        }
        (None, Some(fx), Some(fy)) => (fx, fy),
        _ => return Err(LensFieldsError::FocalLengths),
    };
    Ok((model, ImagePlane::new(fx, fy, fields.cx, fields.cy)))
}

fn radial_polynomial(fields: NativeRadialPolynomial) -> Result<Parts, LensFieldsError> {
    let aspect = positive("aspect", fields.aspect)?;
    let coefficients = fields.coefficients;
    Ok((
        LensModel::RadialPolynomial { coefficients },
        ImagePlane::new(1.0, aspect, fields.cx, fields.cy),
    ))
}

fn kannala_brandt(fields: &NativeKannalaBrandt) -> Parts {
    (
        LensModel::KannalaBrandt { k: fields.k },
        ImagePlane {
            skew: fields.skew,
            ..ImagePlane::new(fields.fx, fields.fy, fields.cx, fields.cy)
        },
    )
}

fn mei(fields: &NativeMei) -> Parts {
    let distortion = RadialTangential {
        k1: fields.k1,
        k2: fields.k2,
        p1: fields.p1,
        p2: fields.p2,
    };
    (
        LensModel::Mei {
            xi: fields.xi,
            distortion,
        },
        ImagePlane {
            skew: fields.skew,
            ..ImagePlane::new(fields.fx, fields.fy, fields.cx, fields.cy)
        },
    )
}

/// `column = x + e y + cx`, `row = d x + c y + cy`.
fn ocam(fields: NativeOcam) -> Result<Parts, LensFieldsError> {
    let plane = ImagePlane {
        skew: finite("e", fields.e)?,
        row_skew: finite("d", fields.d)?,
        ..ImagePlane::new(1.0, positive("c", fields.c)?, fields.cx, fields.cy)
    };
    let polynomial = fields.polynomial;
    Ok((LensModel::Ocam { polynomial }, plane))
}

/// `u = c x + d y + cx`, `v = e x + y + cy`.
fn f_theta(fields: &NativeFTheta) -> Result<Parts, LensFieldsError> {
    let polynomial = match (fields.angle_to_pixel, fields.pixel_to_angle) {
        (Some(coefficients), None) => FThetaPolynomial::AngleToPixel(coefficients),
        (None, Some(coefficients)) => FThetaPolynomial::PixelToAngle(coefficients),
        _ => return Err(LensFieldsError::FThetaPolynomials),
    };
    let plane = ImagePlane {
        skew: finite("d", fields.d)?,
        row_skew: finite("e", fields.e)?,
        ..ImagePlane::new(positive("c", fields.c)?, 1.0, fields.cx, fields.cy)
    };
    Ok((LensModel::FTheta(polynomial), plane))
}

/// `value`, which the image plane would name otherwise than the file does.
fn finite(name: &'static str, value: f64) -> Result<f64, LensError> {
    if value.is_finite() {
        return Ok(value);
    }
    Err(LensError::NotFinite { name, value })
}

fn positive(name: &'static str, value: f64) -> Result<f64, LensError> {
    let value = finite(name, value)?;
    if value > 0.0 {
        return Ok(value);
    }
    Err(LensError::NotPositive { name, value })
}
