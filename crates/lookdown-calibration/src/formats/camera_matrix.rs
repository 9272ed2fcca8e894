//! A camera matrix with distortion coefficients, as OpenCV, ROS and other programs share it.
//!
//! The coefficients of some distortion models describe no fisheye.

use lookdown_lens::geometry::lens::{KannalaBrandt, LensModel, Pinhole, Rectilinear};
use serde_json::Value;

use super::{
    Camera, FileCamera, FormatError,
    fields::{Fields, whole_pixels},
};

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

/// The calibration of a `DepthAI` device (`cameraData`: pairs of a socket and a camera). A camera
/// has 14 coefficients; of those of a fisheye (`cameraType` 1) the first four count, as in
/// `cv::fisheye`.
pub(super) fn read_depthai(fields: &Fields<'_>) -> Result<Vec<FileCamera>, FormatError> {
    let mut cameras = Vec::new();
    for pair in fields.get("cameraData")?.as_array().into_iter().flatten() {
        let (Some(socket), Some(camera)) = (pair.get(0), pair.get(1).and_then(Value::as_object))
        else {
            return Err(fields.invalid("cameraData", "pairs of a socket and a camera are needed"));
        };
        let socket = socket.to_string();
        cameras.push(FileCamera {
            camera: read_depthai_camera(&fields.inside(&format!("cameraData[{socket}]"), camera)),
            name: Some(socket),
        });
    }
    Ok(cameras)
}

fn read_depthai_camera(camera: &Fields<'_>) -> Result<Camera, FormatError> {
    let image = camera.image("width", "height")?;
    let matrix = CameraMatrix::read(camera, "intrinsicMatrix")?;
    let mut values = camera.numbers("distortionCoeff")?;
    let is_fisheye = camera.number_or("cameraType", 0.0)? == 1.0;
    let distortion = if is_fisheye {
        values.truncate(4);
        Distortion::Fisheye
    } else {
        Distortion::RadialTangential
    };
    let lens = matrix.lens(
        distortion,
        &values,
        camera,
        ("cameraType", "distortionCoeff"),
    )?;
    Ok(Camera::new(Some(image), lens))
}

/// Lens profiles of gyroflow (<https://docs.gyroflow.xyz/app/technical-details/lens-profiles>):
/// `cv::fisheye` in `fisheye_params`, for frames of `calib_dimension`. A project file has the
/// profile in `calibration_data`.
///
/// The matrix of an anamorphic lens is that of the stretched frame.
pub(super) fn read_gyroflow(fields: &Fields<'_>) -> Result<Camera, FormatError> {
    let profile = fields.or_child("calibration_data")?;
    for (key, known) in [("distortion_model", "opencv_fisheye"), ("digital_lens", "")] {
        let value = profile.text(key).unwrap_or_default();
        if !value.is_empty() && value != known {
            let problem = format!(
                "it is {value:?}: only profiles of opencv_fisheye without a \
                 digital lens are read"
            );
            return Err(profile.invalid(key, problem));
        }
    }
    let lens = profile.child("fisheye_params")?;
    let mut matrix = CameraMatrix::read(&lens, "camera_matrix")?;
    let mut size = profile.child("calib_dimension")?.image("w", "h")?;
    let stretches = ["input_horizontal_stretch", "input_vertical_stretch"];
    for (axis, side) in [&mut size.width, &mut size.height].into_iter().enumerate() {
        // 0 stands for no stretch.
        let stretch = match profile.number_or(stretches[axis], 1.0)? {
            stretch if stretch > 0.01 => stretch,
            _ => 1.0,
        };
        matrix.pinhole[axis] /= stretch;
        matrix.pinhole[axis + 2] /= stretch;
        *side = whole_pixels((f64::from(*side) / stretch).round()).unwrap_or(0);
    }
    let values = lens.numbers("distortion_coeffs")?;
    let names = ("distortion_model", "distortion_coeffs");
    let lens = matrix.lens(Distortion::Fisheye, &values, &lens, names)?;
    Ok(Camera::new(Some(size), lens))
}
