//! The lens models: each file has the formula, symbols, domain, source, parameters and curve of
//! one. A new model is a file and a line of this list. `docs/geometry.md` has the table.

use super::{ImagePlane, LensError, curve::Curve, distortion::RadialTangential, model::Model};

lens_models! {
    equidistant::Equidistant,
    equisolid::Equisolid,
    stereographic::Stereographic,
    orthographic::Orthographic,
    rectilinear::Rectilinear,
    radial_polynomial::RadialPolynomial,
    kannala_brandt::KannalaBrandt,
    ucm::Ucm,
    eucm::Eucm,
    mei::Mei,
    double_sphere::DoubleSphere,
    ocam::Ocam,
    fov::Fov,
    f_theta::FTheta,
}
