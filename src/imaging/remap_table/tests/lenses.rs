//! A lens of each model, as one may hang over a frame of 1680 × 1680 pixels.

use crate::geometry::{
    Lens,
    lens::{FThetaPolynomial, ImagePlane, LensModel, RadialTangential},
};

pub(super) const FRAME_SIDE: u32 = 1680;

/// Lenses of all fourteen models, by name, with the tangential distortion that only `mei` has.
pub(super) fn every_lens() -> Vec<Lens> {
    let distortion = RadialTangential {
        k1: -0.05,
        k2: 0.005,
        p1: 1e-3,
        p2: -5e-4,
    };
    let lenses = [
        (LensModel::Equidistant, 534.76, 1.57),
        (LensModel::Equisolid, 594.0, 1.57),
        (LensModel::Stereographic, 420.0, 1.57),
        (LensModel::Orthographic, 840.0, 1.5),
        (LensModel::Rectilinear, 300.0, 1.2),
        (
            LensModel::RadialPolynomial {
                coefficients: vec![0.0, 560.0, 8.0, -15.0, 2.0],
            },
            1.0,
            1.65,
        ),
        (
            LensModel::KannalaBrandt {
                k: [0.01, -0.005, 0.001, -0.0003],
            },
            530.0,
            1.6,
        ),
        (LensModel::Ucm { alpha: 0.6 }, 500.0, 1.6),
        (
            LensModel::Eucm {
                alpha: 0.6,
                beta: 1.1,
            },
            520.0,
            1.6,
        ),
        (
            LensModel::Mei {
                xi: 1.2,
                distortion,
            },
            1000.0,
            1.5,
        ),
        (
            LensModel::DoubleSphere {
                xi: -0.2,
                alpha: 0.6,
            },
            420.0,
            1.6,
        ),
        (
            LensModel::Ocam {
                polynomial: vec![-530.0, 0.0, 6e-4, -2e-7, 4e-10],
            },
            1.0,
            1.6,
        ),
        (LensModel::Fov { omega: 0.93 }, 540.0, 1.57),
        (
            LensModel::FTheta(FThetaPolynomial::AngleToPixel([
                0.0, 545.0, 6.0, -12.0, 2.0, -0.4,
            ])),
            1.0,
            1.65,
        ),
        (
            LensModel::FTheta(FThetaPolynomial::PixelToAngle([
                0.0, 1.8e-3, 2e-8, 1e-10, 0.0, 0.0,
            ])),
            1.0,
            1.6,
        ),
    ];
    let made = lenses.map(|(model, focal, max_theta)| {
        let plane = ImagePlane {
            skew: focal * 1e-4,
            row_skew: focal * -2e-4,
            ..ImagePlane::new(focal, focal * 0.998, 838.0, 842.25)
        };
        Lens::new(model, plane, Some(max_theta)).unwrap()
    });
    made.into()
}
