//! Writing calibrations: the native format, and those of other programs where they have the lens.
//!
//! COLMAP's `cameras.txt` with one camera. It has no skew; its pixel coordinates begin at the
//! corner of the first pixel.

use std::fmt::{self, Display, Write};

use lookdown_lens::geometry::{
    Pixel,
    lens::{LensModel, Pinhole},
    pixels::to_corner_origin,
};
use strum::{EnumString, IntoStaticStr, VariantArray};

use crate::native::{NativeCalibration, NativeMount};

/// A format that is written.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, EnumString, IntoStaticStr, VariantArray, strum::VariantNames,
)]
#[strum(serialize_all = "lowercase")]
#[expect(missing_docs, reason = "the formats' own names")]
pub enum Target {
    Native,
    OpenCv,
    Kalibr,
    Ros,
    Colmap,
}

/// A written calibration.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Exported {
    /// The content of the file.
    pub content: String,
    /// Content that the format cannot hold, one sentence each.
    pub lost: Vec<String>,
}

/// A lens that a format does not have.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("{target} has no {model} lens: it holds {holds}, and the native format holds every lens")]
pub struct NotExpressible {
    target: &'static str,
    model: &'static str,
    holds: &'static str,
}

impl Target {
    /// Returns the name, as on the command line.
    pub fn name(self) -> &'static str {
        self.into()
    }

    /// Writes a calibration in this format.
    ///
    /// # Errors
    /// [`NotExpressible`] when the format does not have the lens.
    pub fn write(self, calibration: &NativeCalibration) -> Result<Exported, NotExpressible> {
        let content = match self {
            Self::Native => Some(native(calibration)),
            Self::OpenCv => write_opencv(calibration),
            Self::Kalibr => write_kalibr(calibration),
            Self::Ros => write_ros(calibration),
            Self::Colmap => write_colmap(calibration),
        };
        let content = content.ok_or(NotExpressible {
            target: self.name(),
            model: calibration.lens.name(),
            holds: self.holds(),
        })?;
        Ok(Exported {
            content,
            lost: self.lost(calibration),
        })
    }

    /// The lenses that the format has.
    fn holds(self) -> &'static str {
        match self {
            Self::Native => "every lens",
            Self::OpenCv => "kannala_brandt, mei, ucm, equidistant, stereographic and rectilinear",
            Self::Kalibr => {
                "kannala_brandt and mei without skew, eucm, ucm, double_sphere, fov, equidistant, \
                 stereographic and rectilinear"
            }
            Self::Ros => "kannala_brandt, equidistant and rectilinear",
            Self::Colmap => {
                "kannala_brandt without skew, eucm, ucm, fov, equidistant, stereographic and \
                 rectilinear"
            }
        }
    }

    fn lost(self, calibration: &NativeCalibration) -> Vec<String> {
        if self == Self::Native {
            return Vec::new();
        }
        let mut lost = Vec::new();
        if let Some(max_theta) = calibration.lens.max_theta() {
            lost.push(format!(
                "{} cannot tell where the lens image ends: max_theta {max_theta} is left out",
                self.name()
            ));
        }
        if calibration.mount != NativeMount::default() {
            lost.push(format!(
                "{} cannot tell how the camera hangs: mount is left out",
                self.name()
            ));
        }
        for (areas, count) in [
            ("zones", calibration.zones.len()),
            ("lines", calibration.lines.len()),
            ("masks", calibration.masks.len()),
            ("areas", calibration.areas.len()),
            ("ignored places (ignore)", calibration.ignore.len()),
            ("defaults (detect)", calibration.detect.len()),
        ] {
            if count > 0 {
                lost.push(format!(
                    "{} has no {areas}: those of the calibration ({count}) are left out",
                    self.name()
                ));
            }
        }
        lost
    }
}

fn native(calibration: &NativeCalibration) -> String {
    // Numbers and texts in structs: nothing here can fail to be written.
    let mut content = serde_json::to_string_pretty(calibration).unwrap_or_default();
    content.push('\n');
    content
}

fn write_colmap(calibration: &NativeCalibration) -> Option<String> {
    let lens = &calibration.lens;
    let (model, [fx, fy, cx, cy], rest) = match lens {
        LensModel::Fov(fov) => ("FOV", fov.pinhole(), vec![fov.omega]),
        _ => {
            if let Some((pinhole, k, skew)) = kannala_brandt(lens) {
                (skew == 0.0).then_some(("OPENCV_FISHEYE", pinhole, k.to_vec()))?
            } else if let Some((pinhole, alpha, beta)) = eucm(lens) {
                ("EUCM", pinhole, vec![alpha, beta])
            } else {
                ("PINHOLE", rectilinear(lens)?, Vec::new())
            }
        }
    };
    let center = to_corner_origin(Pixel::new(cx, cy));
    let mut parameters = vec![fx, fy, center.x, center.y];
    parameters.extend(rest);
    Some(format!(
        "# Camera list with one line of data per camera:\n#   CAMERA_ID, MODEL, WIDTH, HEIGHT, \
         PARAMS[]\n# Number of cameras: 1\n1 {model} {} {} {}\n",
        calibration.image.width,
        calibration.image.height,
        join(&parameters, " "),
    ))
}

fn write_kalibr(calibration: &NativeCalibration) -> Option<String> {
    let lens = &calibration.lens;
    let (model, intrinsics, distortion, coefficients) =
        if let Some((pinhole, k, skew)) = kannala_brandt(lens) {
            without(skew)?;
            ("pinhole", pinhole.to_vec(), "equidistant", k.to_vec())
        } else if let LensModel::Mei(_) = lens {
            let ([fx, fy, cx, cy], xi, bent, skew) = mei(lens)?;
            without(skew)?;
            ("omni", vec![xi, fx, fy, cx, cy], "radtan", bent.to_vec())
        } else if let LensModel::DoubleSphere(sphere) = lens {
            let [fx, fy, cx, cy] = sphere.pinhole();
            let parameters = vec![sphere.xi, sphere.alpha, fx, fy, cx, cy];
            ("ds", parameters, "none", Vec::new())
        } else if let LensModel::Fov(fov) = lens {
            let pinhole = fov.pinhole().to_vec();
            ("pinhole", pinhole, "fov", vec![fov.omega])
        } else if let Some(([fx, fy, cx, cy], alpha, beta)) = eucm(lens) {
            let parameters = vec![alpha, beta, fx, fy, cx, cy];
            ("eucm", parameters, "none", Vec::new())
        } else {
            ("pinhole", rectilinear(lens)?.to_vec(), "none", Vec::new())
        };
    Some(format!(
        "cam0:\n  cam_overlaps: []\n  camera_model: {model}\n  distortion_coeffs: [{}]\n  \
         distortion_model: {distortion}\n  intrinsics: [{}]\n  resolution: [{}, {}]\n  rostopic: \
         /{}/image_raw\n",
        join(&coefficients, ", "),
        join(&intrinsics, ", "),
        calibration.image.width,
        calibration.image.height,
        calibration.id,
    ))
}

fn without(skew: f64) -> Option<()> {
    (skew == 0.0).then_some(())
}

fn write_ros(calibration: &NativeCalibration) -> Option<String> {
    let lens = &calibration.lens;
    let (model, pinhole, skew, coefficients) =
        if let Some((pinhole, k, skew)) = kannala_brandt(lens) {
            ("equidistant", pinhole, skew, k.to_vec())
        } else {
            ("plumb_bob", rectilinear(lens)?, 0.0, vec![0.0; 5])
        };
    let matrix = camera_matrix(pinhole, skew);
    // Each row of the projection ends with a translation, here none.
    let projection: Vec<f64> = matrix
        .chunks(3)
        .flat_map(|row| [row, &[0.0]].concat())
        .collect();
    Some(format!(
        "image_width: {}\nimage_height: {}\ncamera_name: {}\ncamera_matrix:\n  rows: 3\n  cols: 3\n  \
         data: [{}]\ndistortion_model: {model}\ndistortion_coefficients:\n  rows: 1\n  cols: {}\n  \
         data: [{}]\nrectification_matrix:\n  rows: 3\n  cols: 3\n  data: [{}]\n\
         projection_matrix:\n  rows: 3\n  cols: 4\n  data: [{}]\n",
        calibration.image.width,
        calibration.image.height,
        calibration.id,
        join(&matrix, ", "),
        coefficients.len(),
        join(&coefficients, ", "),
        join(&[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0], ", "),
        join(&projection, ", "),
    ))
}

/// A number as every YAML reader takes it for a number.
///
/// Written so that it reads back as the same `f64`.
///
/// YAML 1.1 readers such as `PyYAML` take `1e-7` for a text: a point and a sign are put in.
struct Decimal(f64);

impl Display for Decimal {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let shortest = format!("{:?}", self.0);
        let Some((mantissa, exponent)) = shortest.split_once('e') else {
            return formatter.write_str(&shortest);
        };
        let point = if mantissa.contains('.') { "" } else { ".0" };
        let sign = if exponent.starts_with('-') { "" } else { "+" };
        write!(formatter, "{mantissa}{point}e{sign}{exponent}")
    }
}

/// Numbers with a separator between them.
fn join(numbers: &[f64], separator: &str) -> String {
    let decimals: Vec<_> = numbers
        .iter()
        .map(|&number| Decimal(number).to_string())
        .collect();
    decimals.join(separator)
}

/// The lens as another model, where the two are the same function.
fn rectilinear(lens: &LensModel) -> Option<Pinhole> {
    match lens {
        LensModel::Rectilinear(lens) => lens.pinhole(),
        _ => None,
    }
}

/// Kannala-Brandt: `k1 … k4` and the skew in pixels. The equidistant lens has none of them.
fn kannala_brandt(lens: &LensModel) -> Option<(Pinhole, [f64; 4], f64)> {
    match lens {
        LensModel::KannalaBrandt(lens) => Some((lens.pinhole(), lens.k, lens.skew)),
        LensModel::Equidistant(lens) => Some((lens.pinhole()?, [0.0; 4], 0.0)),
        _ => None,
    }
}

/// Unified camera model. The stereographic lens is the one with `alpha` ½:
/// `sin(theta) / (½ + ½ cos(theta)) = 2 tan(theta / 2)`.
fn ucm(lens: &LensModel) -> Option<(Pinhole, f64)> {
    match lens {
        LensModel::Ucm(lens) => Some((lens.pinhole(), lens.alpha)),
        LensModel::Stereographic(lens) => Some((lens.pinhole()?, 0.5)),
        _ => None,
    }
}

/// Enhanced unified camera model: `beta` 1 for the unified one.
fn eucm(lens: &LensModel) -> Option<(Pinhole, f64, f64)> {
    match lens {
        LensModel::Eucm(lens) => Some((lens.pinhole(), lens.alpha, lens.beta)),
        _ => ucm(lens).map(|(pinhole, alpha)| (pinhole, alpha, 1.0)),
    }
}

/// Mei's model: pinhole, `xi`, `k1 k2 p1 p2`, skew in pixels. The unified model is the one
/// without distortion: `xi = alpha / (1 − alpha)`, focal lengths divided by `1 − alpha`.
fn mei(lens: &LensModel) -> Option<(Pinhole, f64, [f64; 4], f64)> {
    if let LensModel::Mei(lens) = lens {
        let distortion = [lens.k1, lens.k2, lens.p1, lens.p2];
        return Some((lens.pinhole(), lens.xi, distortion, lens.skew));
    }
    let ([fx, fy, cx, cy], alpha) = ucm(lens)?;
    let rest = 1.0 - alpha;
    (rest > 0.0).then(|| ([fx / rest, fy / rest, cx, cy], alpha / rest, [0.0; 4], 0.0))
}

/// OpenCV's `FileStorage` YAML: `cv::fisheye`, `cv::omnidir`, or a camera without distortion.
fn write_opencv(calibration: &NativeCalibration) -> Option<String> {
    let lens = &calibration.lens;
    let (said, pinhole, skew, coefficients) = if let Some((pinhole, k, skew)) = kannala_brandt(lens)
    {
        ("fisheye_model: 1".to_owned(), pinhole, skew, k.to_vec())
    } else if let Some((pinhole, xi, distortion, skew)) = mei(lens) {
        let said = format!("xi: {}", Decimal(xi));
        (said, pinhole, skew, distortion.to_vec())
    } else {
        let said = "fisheye_model: 0".to_owned();
        (said, rectilinear(lens)?, 0.0, vec![0.0; 5])
    };
    // Every OpenCV reads this directive; 5 writes another one.
    let mut content = format!(
        "%YAML:1.0\n---\nimage_width: {}\nimage_height: {}\n{said}\n",
        calibration.image.width, calibration.image.height
    );
    let camera_matrix = camera_matrix(pinhole, skew);
    write_matrix(&mut content, "camera_matrix", 3, &camera_matrix);
    write_matrix(&mut content, "distortion_coefficients", 1, &coefficients);
    Some(content)
}

/// The 3×3 matrix, row by row.
fn camera_matrix([fx, fy, cx, cy]: Pinhole, skew: f64) -> [f64; 9] {
    [fx, skew, cx, 0.0, fy, cy, 0.0, 0.0, 1.0]
}

fn write_matrix(content: &mut String, name: &str, rows: usize, data: &[f64]) {
    let columns = data.len() / rows;
    // Writing to a String cannot fail.
    let _ = write!(
        content,
        "{name}: !!opencv-matrix\n   rows: {rows}\n   cols: {columns}\n   dt: d\n   data: [ {} ]\n",
        join(data, ", ")
    );
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exponents_have_a_point_and_a_sign() {
        for (number, expected) in [
            (1e-7, "1.0e-7"),
            (-1.5e-7, "-1.5e-7"),
            (1e20, "1.0e+20"),
            (0.1, "0.1"),
            (3.0, "3.0"),
        ] {
            assert_eq!(Decimal(number).to_string(), expected);
        }
    }
}
