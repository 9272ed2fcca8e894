//! Warnings about calibrations that can be used, but are implausible.

use super::{AreaShare, Calibration};
use crate::warning::{Warning, WarningCode};
use lookdown_lens::geometry::{Lens, Ray};

/// A lens center farther than this from the frame's, as a share of the side, is rare.
const OFF_CENTER: f64 = 0.1;
/// Pixels are square to within this in nearly all cameras.
const SQUARE_PIXELS: f64 = 0.05;
/// A lens that sees no farther than this off its axis (radians) is not a fisheye.
const NARROW: f64 = 1.0;
/// A mask that hides less than this (percent of the frame) is rare.
const SMALL: f64 = 0.1;
/// Far enough from the axis to measure the scale there, radians.
const NEAR_AXIS: f64 = 0.01;

impl Calibration {
    /// Returns the implausible properties: the field, its value, and its usual cause.
    pub fn warnings(&self) -> Vec<Warning> {
        let lens = self.lens();
        let mut warnings = self.off_center();
        if let Some((across, down)) = scales_at_axis(lens)
            && (across / down - 1.0).abs() > SQUARE_PIXELS
        {
            let message = format!(
                "the lens has {across:.1} pixels per radian across and {down:.1} down at its axis: \
                 frames are rarely squeezed, check the focal lengths and the frame size"
            );
            warnings.push(Warning::new(WarningCode::FocalLengthsDiffer, message));
        }
        if lens.max_theta() < NARROW {
            let message = format!(
                "the lens sees only {:.0}°: for a fisheye of a ceiling camera 160° to 220° are \
                 usual, check the model and its coefficients",
                2.0 * lens.max_theta().to_degrees()
            );
            warnings.push(Warning::new(WarningCode::FieldOfViewNarrow, message));
        }
        let (width, height) = self.image_size();
        let shares = self.areas().shares(width, height).into_iter();
        let small =
            shares.filter(|share| share.field.starts_with("masks") && share.percent < SMALL);
        warnings.extend(small.map(|AreaShare { field, percent }| {
            let message = format!(
                "{field} hides {percent:.3} % of the frame: give its corners in pixels of frames of \
                 {width}×{height}"
            );
            Warning::new(WarningCode::MaskSmall, message)
        }));
        warnings
    }

    fn off_center(&self) -> Vec<Warning> {
        let center = self.lens().principal_point();
        let (width, height) = self.image_size();
        let (middle_x, middle_y) = (f64::from(width - 1) / 2.0, f64::from(height - 1) / 2.0);
        let is_near = |value: f64, middle: f64, side: u32| {
            (value - middle).abs() <= OFF_CENTER * f64::from(side)
        };
        if is_near(center.x, middle_x, width) && is_near(center.y, middle_y, height) {
            return Vec::new();
        }
        let cause = if is_near(center.y, middle_x, width) && is_near(center.x, middle_y, height) {
            "row and column are swapped"
        } else {
            "the frame size is not the one it was calibrated with, or the frame was cropped"
        };
        let message = format!(
            "cx, cy is {:.1}, {:.1}, far from the middle of the frame ({middle_x:.1}, \
             {middle_y:.1}): perhaps {cause}",
            center.x, center.y
        );
        vec![Warning::new(WarningCode::PrincipalPointOffCenter, message)]
    }
}

/// Pixels per radian at the optical axis, across and down.
fn scales_at_axis(lens: &Lens) -> Option<(f64, f64)> {
    let center = lens.principal_point();
    let across = lens.project(&Ray::new(NEAR_AXIS.sin(), 0.0, NEAR_AXIS.cos()))?;
    let down = lens.project(&Ray::new(0.0, NEAR_AXIS.sin(), NEAR_AXIS.cos()))?;
    Some((
        (across - center).norm() / NEAR_AXIS,
        (down - center).norm() / NEAR_AXIS,
    ))
}

#[cfg(test)]
mod tests {
    use crate::CalibrationFile;
    use crate::warning::{Warning, WarningCode};

    fn warnings(cx: f64, cy: f64, fx: f64, max_theta: f64) -> Vec<Warning> {
        let content = format!(
            r#"{{"id":"hall","image":{{"width":1000,"height":600}},"lens":{{"model":"equidistant",
                "fx":{fx},"fy":300,"cx":{cx},"cy":{cy},"max_theta":{max_theta}}}}}"#
        );
        let file = CalibrationFile::parse(content.as_bytes()).expect("a whole file");
        let mut cameras = file.calibrations("hall", content.as_bytes());
        let (_, calibration) = cameras.remove(0);
        calibration.expect("a plausible camera").warnings()
    }

    #[test]
    fn an_ordinary_camera_has_no_warning() {
        assert!(warnings(498.0, 303.0, 301.0, 1.6).is_empty());
    }

    #[test]
    fn each_warning_has_a_code_and_the_value() {
        for (warnings, code, expected) in [
            (
                warnings(299.5, 499.5, 300.0, 1.6),
                WarningCode::PrincipalPointOffCenter,
                "cx, cy is 299.5, 499.5, far from the middle of the frame (499.5, 299.5): perhaps \
                 row and column are swapped",
            ),
            (
                warnings(299.5, 299.5, 300.0, 1.6),
                WarningCode::PrincipalPointOffCenter,
                "perhaps the frame size is not the one",
            ),
            (
                warnings(499.5, 299.5, 400.0, 1.6),
                WarningCode::FocalLengthsDiffer,
                "400.0 pixels per radian across and 300.0 down",
            ),
            (
                warnings(499.5, 299.5, 300.0, 0.5),
                WarningCode::FieldOfViewNarrow,
                "the lens sees only 57°",
            ),
        ] {
            assert_eq!(warnings.len(), 1, "{warnings:?}");
            assert_eq!(warnings[0].code, code);
            assert!(warnings[0].message.contains(expected), "{warnings:?}");
        }
    }
}
