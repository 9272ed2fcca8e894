//! Writing calibrations: the native format, and those of other programs where they have the lens.

mod colmap;
mod decimal;
mod equivalents;
mod kalibr;
mod opencv;
mod ros;

use strum::{EnumString, IntoStaticStr, VariantArray};

use super::native::{NativeCalibration, NativeMount};

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
            Self::Kalibr => kalibr::write(calibration),
            Self::Ros => ros::write(calibration),
            Self::Colmap => colmap::write(calibration),
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
