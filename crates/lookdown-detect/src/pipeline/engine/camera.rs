//! Selects the camera of a frame: a named calibration, or a lens assumed from the lens circle.

use std::{f64::consts::FRAC_PI_2, sync::Arc};

use lookdown_calibration::warning::{Warning, WarningCode};
use lookdown_calibration::{Areas, Calibration, CalibrationId, CameraGeometry};
use lookdown_lens::geometry::{Lens, Mount};

use super::Engine;
use crate::{
    inference::Model,
    parameters::Profile,
    pipeline::{
        DetectJob, PipelineError,
        camera_rig::CameraRig,
        error::internal,
        report::CalibrationUsed,
        rig_cache::{RigCamera, RigKey},
    },
};
use lookdown_imaging::{
    Frame, NetworkInput,
    lens_circle::{LensCircle, assumed_circle, find_lens_circle, shows_two_circles},
};

/// The rounding step of lens circles, as a share of the radius. Rounding maps the jittering circles
/// of one camera to one rig; a quarter of a percent does not move boxes visibly.
const CIRCLE_STEP_SHARE: f64 = 1.0 / 400.0;

/// Returns the rig key of the assumed camera, and the rounded circle. The rig must be built of the
/// latter: all circles with this key then get the same answers, whichever came first.
#[expect(
    clippy::cast_possible_truncation,
    reason = "steps within a bounded frame"
)]
fn rounded(circle: &LensCircle) -> (RigCamera, LensCircle) {
    // The step of the radius grows with the radius; the center uses the same step.
    let radius_steps = (circle.radius.max(1.0).ln() / CIRCLE_STEP_SHARE).round();
    let radius = (radius_steps * CIRCLE_STEP_SHARE).exp();
    let step = (radius * CIRCLE_STEP_SHARE).max(0.5);
    let [cx, cy] = [circle.cx, circle.cy].map(|center| (center / step).round());
    let camera = RigCamera::Assumed {
        cx: cx as i64,
        cy: cy as i64,
        radius: radius_steps as i64,
    };
    let circle = LensCircle {
        cx: cx * step,
        cy: cy * step,
        radius,
    };
    (camera, circle)
}

/// The rig of a frame's camera, with the calibration that the report names.
pub(super) struct FrameCamera {
    pub(super) used: CalibrationUsed,
    pub(super) rig: Arc<CameraRig>,
}

impl Engine {
    pub(super) fn camera(
        &self,
        job: &DetectJob,
        frame: &Frame,
        model: &Model,
        warnings: &mut Vec<Warning>,
    ) -> Result<FrameCamera, PipelineError> {
        let profile = job.parameters.profile;
        let calibration = match (&job.calibration, &job.parameters.calibration) {
            (Some(calibration), _) => Arc::clone(calibration),
            (None, Some(id)) => self.find_calibration(id)?,
            (None, None) => return self.assumed_camera(frame, profile, model, warnings),
        };
        let geometry = calibration
            .for_frame(frame.width(), frame.height())
            .map_err(|mismatch| PipelineError::AspectMismatch {
                id: calibration.id().to_string(),
                frame_width: frame.width(),
                frame_height: frame.height(),
                calibration_width: mismatch.image_width,
                calibration_height: mismatch.image_height,
            })?;
        let used = CalibrationUsed {
            id: calibration.id().to_string(),
            revision: calibration.revision().to_owned(),
            assumed_circle: None,
        };
        let camera = RigCamera::Calibrated {
            id: used.id.clone(),
            revision: used.revision.clone(),
        };
        let rig = self.rig(camera, geometry, frame, profile, &model.input);
        Ok(FrameCamera { used, rig })
    }

    fn find_calibration(&self, id: &CalibrationId) -> Result<Arc<Calibration>, PipelineError> {
        let found = match &self.calibrations {
            Some(calibrations) => {
                calibrations
                    .get(id)
                    .map_err(|unusable| PipelineError::UnusableCalibration {
                        id: id.to_string(),
                        problem: unusable.problem,
                    })?
            }
            None => None,
        };
        found.ok_or_else(|| PipelineError::UnknownCalibration { id: id.to_string() })
    }

    fn assumed_camera(
        &self,
        frame: &Frame,
        profile: Profile,
        model: &Model,
        warnings: &mut Vec<Warning>,
    ) -> Result<FrameCamera, PipelineError> {
        let middle = assumed_circle(frame.width(), frame.height());
        let found = find_lens_circle(frame);
        // A circle in the middle is that of one lens.
        let is_middle = |circle: &LensCircle| {
            (circle.cx - middle.cx).hypot(circle.cy - middle.cy) < circle.radius / 2.0
        };
        let has_two = !found.as_ref().is_some_and(is_middle) && shows_two_circles(frame);
        let found = found.filter(|_| !has_two);
        let circle = found.unwrap_or(middle);
        let (camera, circle) = rounded(&circle);
        let lens = Lens::equidistant_circle(circle.cx, circle.cy, circle.radius, FRAC_PI_2)
            .map_err(|error| internal(anyhow::Error::new(error)))?;
        warnings.push(Warning::new(
            WarningCode::LensAssumed,
            "no calibration was named: an equidistant lens of 180° that points straight down was \
             assumed, with the lens circle calibration.assumed_circle",
        ));
        if found.is_none() {
            let problem = if has_two {
                "the frame shows two lens circles: crop each to a frame of its own, and send these \
                 as two cameras"
            } else {
                "the frame shows no lens circle: the largest circle in the middle of the frame was \
                 assumed, name a calibration instead"
            };
            warnings.push(Warning::new(WarningCode::LensCircleNotFound, problem));
        }
        let geometry = CameraGeometry {
            lens,
            mount: Mount::default(),
            areas: Areas::default(),
        };
        let used = CalibrationUsed {
            id: "assumed".to_owned(),
            revision: format!("{:.0}-{:.0}-{:.0}", circle.cx, circle.cy, circle.radius),
            assumed_circle: Some(circle),
        };
        let rig = self.rig(camera, geometry, frame, profile, &model.input);
        Ok(FrameCamera { used, rig })
    }

    fn rig(
        &self,
        camera: RigCamera,
        geometry: CameraGeometry,
        frame: &Frame,
        profile: Profile,
        input: &NetworkInput,
    ) -> Arc<CameraRig> {
        let key = RigKey {
            camera,
            frame_size: (frame.width(), frame.height()),
            profile,
            input_size: (input.width, input.height),
        };
        self.rigs.get_or_build(&key, || {
            let plan = profile.view_plan().map(|plan| plan.turned(self.plan_turn));
            let (width, height) = (frame.width(), frame.height());
            self.remappers
                .install(|| CameraRig::new(geometry, width, height, plan.as_ref(), input))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn circle(cx: f64, cy: f64, radius: f64) -> LensCircle {
        LensCircle { cx, cy, radius }
    }

    #[test]
    fn different_circles_are_different_cameras() {
        let (camera, _) = rounded(&circle(840.0, 840.0, 830.0));
        for other in [
            circle(800.0, 800.0, 790.476),
            circle(846.0, 840.0, 830.0),
            circle(840.0, 840.0, 836.0),
        ] {
            assert_ne!(rounded(&other).0, camera);
        }
    }

    #[test]
    fn a_jittering_circle_is_one_camera_with_one_circle() {
        let camera = rounded(&circle(840.0, 840.0, 830.0));
        assert_eq!(rounded(&circle(840.2, 839.8, 830.2)), camera);
    }

    #[test]
    fn a_rounded_circle_moves_by_half_a_step_at_most() {
        let found = circle(839.3, 841.9, 830.7);
        let (_, used) = rounded(&found);
        let most = found.radius * CIRCLE_STEP_SHARE * 0.51;
        for (used, found) in [
            (used.cx, found.cx),
            (used.cy, found.cy),
            (used.radius, found.radius),
        ] {
            assert!((used - found).abs() <= most, "{used} {found}");
        }
    }
}
