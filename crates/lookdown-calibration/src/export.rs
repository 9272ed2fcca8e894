//! Writing calibrations: the native format, and those of other programs where they have the lens.
//!
//! COLMAP's `cameras.txt` with one camera. It has no skew; its pixel coordinates begin at the
//! corner of the first pixel.

mod decimal;
mod equivalents;
mod opencv;

use lookdown_lens::geometry::{Pixel, lens::LensModel, pixels::to_corner_origin};
use strum::{EnumString, IntoStaticStr, VariantArray};

use crate::native::{NativeCalibration, NativeMount};

use decimal::join;
use equivalents::{eucm, kannala_brandt, mei, rectilinear};
use opencv::camera_matrix;

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
            Self::OpenCv => opencv::write(calibration),
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
