//! Which camera a frame came from: a named calibration, or a lens assumed from its circle.

use std::{f64::consts::FRAC_PI_2, sync::Arc};

use super::Engine;
use crate::{
    calibration::{Areas, Calibration, CalibrationId, CameraGeometry},
    geometry::{Lens, Mount},
    imaging::{
        Frame, NetworkInput,
        lens_circle::{assumed_circle, find_lens_circle},
    },
    inference::Model,
    pipeline::{
        DetectJob, PipelineError, Profile,
        camera_rig::CameraRig,
        error::internal,
        report::CalibrationUsed,
        rig_cache::{RigCacheUse, RigCamera, RigKey},
    },
};

/// Circles are rounded to this share of the radius, so that the jitter of one camera's frames
/// finds one rig: a quarter of a percent moves no box by a visible amount.
const CIRCLE_STEP_SHARE: f64 = 1.0 / 400.0;

/// The camera of a frame.
pub(super) struct FrameCamera {
    pub(super) used: CalibrationUsed,
    pub(super) rig: Arc<CameraRig>,
}

impl Engine {
    /// How full the memory for remap tables is, and how often they were built and dropped.
    #[must_use]
    pub fn rig_cache_use(&self) -> RigCacheUse {
        self.rigs.usage()
    }

    pub(super) fn camera(
        &self,
        job: &DetectJob,
        frame: &Frame,
        model: &Model,
        warnings: &mut Vec<String>,
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
            assumed: false,
        };
        let camera = RigCamera::Calibrated {
            id: used.id.clone(),
            revision: used.revision.clone(),
        };
        let rig = self.rig(camera, geometry, frame, profile, model.input());
        Ok(FrameCamera { used, rig })
    }

    fn find_calibration(&self, id: &CalibrationId) -> Result<Arc<Calibration>, PipelineError> {
        let found = match &self.calibrations {
            Some(calibrations) => calibrations
                .get(id)
                .map_err(|error| internal(anyhow::Error::new(error)))?,
            None => None,
        };
        found.ok_or_else(|| PipelineError::UnknownCalibration { id: id.to_string() })
    }

    fn assumed_camera(
        &self,
        frame: &Frame,
        profile: Profile,
        model: &Model,
        warnings: &mut Vec<String>,
    ) -> Result<FrameCamera, PipelineError> {
        let (circle, how) = match find_lens_circle(frame) {
            Some(circle) => (circle, "found in the frame"),
            None => (
                assumed_circle(frame.width(), frame.height()),
                "taken to be as large as the frame, as none was found",
            ),
        };
        let step = (circle.radius * CIRCLE_STEP_SHARE).max(0.5);
        #[expect(
            clippy::cast_possible_truncation,
            reason = "steps within a bounded frame"
        )]
        let steps = |value: f64| (value / step).round() as i64;
        let camera = RigCamera::Assumed {
            cx: steps(circle.cx),
            cy: steps(circle.cy),
            radius: steps(circle.radius),
        };
        let lens = Lens::equidistant_circle(circle.cx, circle.cy, circle.radius, FRAC_PI_2)
            .map_err(|error| internal(anyhow::Error::new(error)))?;
        warnings.push(format!(
            "no calibration was named: an equidistant lens of 180° looking straight down was \
             assumed, its circle {how} (centre {:.1}, {:.1}, radius {:.1} pixels)",
            circle.cx + 0.5,
            circle.cy + 0.5,
            circle.radius
        ));
        let geometry = CameraGeometry {
            lens,
            mount: Mount::default(),
            areas: Areas::default(),
        };
        let used = CalibrationUsed {
            id: "assumed".to_owned(),
            revision: format!("{:.0}-{:.0}-{:.0}", circle.cx, circle.cy, circle.radius),
            assumed: true,
        };
        let rig = self.rig(camera, geometry, frame, profile, model.input());
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
            let plan = profile.view_plan(self.options.paper_field_of_view);
            let (width, height) = (frame.width(), frame.height());
            self.remappers
                .install(|| CameraRig::new(geometry, width, height, plan.as_ref(), input))
        })
    }
}
