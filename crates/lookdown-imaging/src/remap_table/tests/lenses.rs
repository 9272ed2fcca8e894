//! A lens of each model, as one may hang over a frame of 1680 × 1680 pixels.

use lookdown_lens::geometry::{
    Lens,
    lens::{
        DoubleSphere, Equidistant, Equisolid, Eucm, FTheta, Fov, ImagePlane, KannalaBrandt,
        LensModel, Mei, Ocam, Orthographic, Pinhole, RadialPolynomial, Rectilinear, Stereographic,
        Ucm,
    },
};

pub(super) const FRAME_SIDE: u32 = 1680;
/// Replaced by the image plane of [`every_lens`].
const ANY_PINHOLE: Pinhole = [1.0, 1.0, 0.0, 0.0];
const CENTER: [f64; 2] = [0.0, 0.0];

/// Lenses of all fourteen models, by name, with the tangential distortion that only `mei` has.
pub(super) fn every_lens() -> Vec<Lens> {
    let lenses: [(LensModel, f64, f64); 15] = [
        (Equidistant::new(ANY_PINHOLE).into(), 534.76, 1.57),
        (Equisolid::new(ANY_PINHOLE).into(), 594.0, 1.57),
        (Stereographic::new(ANY_PINHOLE).into(), 420.0, 1.57),
        (Orthographic::new(ANY_PINHOLE).into(), 840.0, 1.5),
        (Rectilinear::new(ANY_PINHOLE).into(), 300.0, 1.2),
        (
            RadialPolynomial::new(vec![0.0, 560.0, 8.0, -15.0, 2.0], CENTER).into(),
            1.0,
            1.65,
        ),
        (
            KannalaBrandt::new(ANY_PINHOLE, [0.01, -0.005, 0.001, -0.0003]).into(),
            530.0,
            1.6,
        ),
        (Ucm::new(ANY_PINHOLE, 0.6).into(), 500.0, 1.6),
        (Eucm::new(ANY_PINHOLE, 0.6, 1.1).into(), 520.0, 1.6),
        (
            Mei::new(ANY_PINHOLE, 1.2, -0.05, 0.005, 1e-3, -5e-4).into(),
            1000.0,
            1.5,
        ),
        (DoubleSphere::new(ANY_PINHOLE, -0.2, 0.6).into(), 420.0, 1.6),
        (
            Ocam::new(vec![-530.0, 0.0, 6e-4, -2e-7, 4e-10], CENTER).into(),
            1.0,
            1.6,
        ),
        (Fov::new(ANY_PINHOLE, 0.93).into(), 540.0, 1.57),
        (
            f_theta(Some([0.0, 545.0, 6.0, -12.0, 2.0, -0.4]), None),
            1.0,
            1.65,
        ),
        (
            f_theta(None, Some([0.0, 1.8e-3, 2e-8, 1e-10, 0.0, 0.0])),
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
        Lens::on_plane(&model, plane, Some(max_theta)).unwrap()
    });
    made.into()
}

fn f_theta(angle_to_pixel: Option<[f64; 6]>, pixel_to_angle: Option<[f64; 6]>) -> LensModel {
    let [cx, cy] = CENTER;
    LensModel::FTheta(FTheta {
        angle_to_pixel,
        pixel_to_angle,
        c: 1.0,
        d: 0.0,
        e: 0.0,
        cx,
        cy,
        max_theta: None,
    })
}
