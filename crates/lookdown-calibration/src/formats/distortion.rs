//! Names of distortion models, and the reasons for which some describe no fisheye.

/// A distortion model by any of its names.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Distortion {
    /// Kannala and Brandt: a polynomial of the angle, four coefficients.
    Fisheye,
    /// Radial and tangential terms of the ordinary pinhole camera.
    RadialTangential,
    /// Devernay and Faugeras, one coefficient.
    Fov,
    /// None at all.
    None,
}

/// Names under which programs store each.
const NAMES: [(Distortion, &[&str]); 4] = [
    (
        Distortion::Fisheye,
        &[
            "equidistant",
            "fisheye",
            "kannala_brandt",
            "kannala_brandt4",
            "kb4",
            "kannalabrandt8",
            "opencv_fisheye",
        ],
    ),
    (
        Distortion::RadialTangential,
        &[
            "plumb_bob",
            "radtan",
            "rational_polynomial",
            "brown_conrady",
            "thin_prism",
        ],
    ),
    (Distortion::Fov, &["fov"]),
    (Distortion::None, &["none", ""]),
];

impl Distortion {
    /// The model of that name.
    pub(super) fn from_name(name: &str) -> Option<Self> {
        let name = name.to_ascii_lowercase().replace('-', "_");
        let known = NAMES.iter().find(|(_, names)| names.contains(&&*name));
        known.map(|(distortion, _)| *distortion)
    }
}

/// Returns the error text for the radial and tangential distortion of a pinhole camera.
pub(super) fn not_a_fisheye(model: &str) -> String {
    format!(
        "it is {model}, which describes ordinary lenses below 180° and not a fisheye, whatever the \
         camera is called: calibrate with a fisheye model (cv::fisheye in OpenCV, equidistant in \
         ROS, pinhole-equi in Kalibr)"
    )
}

/// The four coefficients of a fisheye; more are accepted when they are 0, fewer are not.
pub(super) fn four(coefficients: &[f64]) -> Result<[f64; 4], String> {
    match coefficients {
        [k1, k2, k3, k4, rest @ ..] if rest.iter().all(|&more| more == 0.0) => {
            Ok([*k1, *k2, *k3, *k4])
        }
        _ => Err(format!(
            "it has {} numbers: 4 are needed, k1 to k4",
            coefficients.len()
        )),
    }
}

/// Returns true for coefficients without distortion.
pub(super) fn are_all_zero(coefficients: &[f64]) -> bool {
    coefficients.iter().all(|&coefficient| coefficient == 0.0)
}
