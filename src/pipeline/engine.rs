//! The engine: everything between a frame's bytes and its report, on the calling thread.

mod camera;

use std::{
    sync::{Mutex, PoisonError},
    time::Instant,
};

use self::camera::FrameCamera;
use super::{
    DetectJob, Detected, DetectionReport, Person, PipelineError, Profile, StageTimings,
    error::internal, merge, report::ModelUsed, rig_cache::RigCache,
};
use crate::{
    calibration::CalibrationFolder,
    detection::RefinementParameters,
    geometry::FieldOfViewReading,
    imaging::{
        Frame, NetworkInput, ViewBatch,
        decode::{DecodeLimits, decode},
    },
    inference::{Detector, InferenceError, ViewDetection},
};

/// The smallest frame side that can hold a lens image, pixels.
const MIN_FRAME_SIDE: u32 = 32;

/// How the engine works.
#[derive(Debug, Clone)]
pub struct EngineOptions {
    /// What a picture may cost before it is decoded.
    pub decode_limits: DecodeLimits,
    /// Most views given to the network at once.
    pub max_batch_views: std::num::NonZeroUsize,
    /// How the paper's field of view is read.
    pub paper_field_of_view: FieldOfViewReading,
    /// Most memory that remap tables may hold, bytes.
    pub rig_cache_bytes: usize,
}

/// Finds persons in frames.
pub struct Engine {
    /// One frame at a time is in the network; the session itself uses several threads.
    detector: Mutex<Box<dyn Detector>>,
    input: NetworkInput,
    model: ModelUsed,
    calibrations: Option<CalibrationFolder>,
    rigs: RigCache,
    options: EngineOptions,
}

/// A frame after the network has seen it: all that refinement needs, so that other refinements
/// of the same frame cost no inference.
pub struct Observation {
    /// The decoded frame, EXIF orientation applied.
    pub frame: Frame,
    camera: FrameCamera,
    profile: Profile,
    per_view: Vec<Vec<ViewDetection>>,
    batch_count: usize,
    /// All but `refine` and `total`, which are still to come.
    timings: StageTimings,
    warnings: Vec<String>,
}

impl Observation {
    /// How many views the network saw.
    #[must_use]
    pub fn view_count(&self) -> usize {
        self.camera.rig.view_count()
    }
}

impl Engine {
    /// An engine around a detector; without `calibrations` every lens is assumed.
    #[must_use]
    pub fn new(
        detector: Box<dyn Detector>,
        calibrations: Option<CalibrationFolder>,
        options: EngineOptions,
    ) -> Self {
        Self {
            input: detector.input().clone(),
            model: ModelUsed {
                name: detector.name().to_owned(),
                revision: detector.revision().to_owned(),
            },
            detector: Mutex::new(detector),
            calibrations,
            rigs: RigCache::new(options.rig_cache_bytes),
            options,
        }
    }

    /// The model that answers.
    #[must_use]
    pub fn model(&self) -> &ModelUsed {
        &self.model
    }

    /// Runs the network once on blank views, so that the first frame finds it warm.
    ///
    /// # Errors
    /// [`InferenceError`] when the network cannot run.
    pub fn warm_up(&self) -> Result<(), InferenceError> {
        let mut batch = ViewBatch::default();
        for slot in batch.prepare(self.options.max_batch_views.get(), &self.input) {
            slot.fill(0.0);
        }
        let mut detector = self.detector.lock().unwrap_or_else(PoisonError::into_inner);
        detector.detect(&batch).map(|_| ())
    }

    /// Finds the persons in a frame. Blocks; keep it off the async runtime.
    ///
    /// # Errors
    /// [`PipelineError`], by who is at fault.
    pub fn detect(&self, job: &DetectJob) -> Result<Detected, PipelineError> {
        let observation = self.observe(job)?;
        let refining = Instant::now();
        let parameters = &job.parameters;
        let persons = self.persons(&observation, &parameters.refinement);
        let calibration = observation.camera.used;
        let report = DetectionReport {
            request_id: job.request_id.clone(),
            camera: parameters
                .camera
                .clone()
                .unwrap_or_else(|| calibration.id.clone()),
            received_at: job.received_at,
            captured_at: parameters.captured_at,
            calibration,
            image_width: observation.frame.width(),
            image_height: observation.frame.height(),
            model: self.model.clone(),
            profile: parameters.profile,
            refinement: parameters.refinement,
            persons,
            view_count: observation.camera.rig.view_count(),
            batch_count: observation.batch_count,
            timings: StageTimings {
                refine: refining.elapsed(),
                total: job.arrived.elapsed(),
                ..observation.timings
            },
            warnings: observation.warnings,
        };
        Ok(Detected {
            report,
            frame: observation.frame,
        })
    }

    /// Everything up to and including the network.
    ///
    /// # Errors
    /// [`PipelineError`], by who is at fault.
    pub fn observe(&self, job: &DetectJob) -> Result<Observation, PipelineError> {
        let started = Instant::now();
        self.check_model(job.parameters.model.as_deref())?;
        let decoded = decode(&job.image, &self.options.decode_limits)?;
        let frame = decoded.frame;
        check_size(&frame)?;
        let decoded_at = Instant::now();

        let mut warnings = Vec::new();
        if decoded.orientation_applied {
            warnings.push(
                "the frame was turned as its EXIF orientation says; boxes are in pixels of the \
                 turned frame"
                    .to_owned(),
            );
        }
        let camera = self.camera(job, &frame, &mut warnings)?;
        let calibrated_at = Instant::now();

        let mut observation = Observation {
            profile: job.parameters.profile,
            per_view: Vec::with_capacity(camera.rig.view_count()),
            batch_count: 0,
            timings: StageTimings {
                decode: decoded_at - started,
                calibrate: calibrated_at - decoded_at,
                queue: started.saturating_duration_since(job.arrived),
                ..StageTimings::default()
            },
            frame,
            camera,
            warnings,
        };
        self.infer(&mut observation)?;
        Ok(observation)
    }

    /// The persons in an observed frame.
    #[must_use]
    pub fn persons(
        &self,
        observation: &Observation,
        refinement: &RefinementParameters,
    ) -> Vec<Person> {
        merge::persons(
            &observation.per_view,
            &observation.camera.rig,
            &self.input,
            observation.profile.back_projection(),
            refinement,
        )
    }

    fn check_model(&self, wanted: Option<&str>) -> Result<(), PipelineError> {
        match wanted {
            Some(name) if name != self.model.name => Err(PipelineError::UnknownModel {
                name: name.to_owned(),
                loaded: self.model.name.clone(),
            }),
            _ => Ok(()),
        }
    }

    /// Renders the views and runs the network on them, batch by batch.
    fn infer(&self, observation: &mut Observation) -> Result<(), PipelineError> {
        let waiting = Instant::now();
        // A panic inside the run-time leaves no half-changed state of ours behind.
        let mut detector = self.detector.lock().unwrap_or_else(PoisonError::into_inner);
        observation.timings.queue += waiting.elapsed();
        let mut batch = ViewBatch::default();
        let views = observation.view_count();
        let step = self.options.max_batch_views.get();
        for start in (0..views).step_by(step) {
            let remapping = Instant::now();
            let range = start..views.min(start + step);
            let rig = &observation.camera.rig;
            rig.render(&observation.frame, range, &self.input, &mut batch);
            let inferring = Instant::now();
            let found = detector
                .detect(&batch)
                .map_err(|error| internal(anyhow::Error::new(error)))?;
            observation.timings.remap += inferring - remapping;
            observation.timings.inference += inferring.elapsed();
            observation.per_view.extend(found);
            observation.batch_count += 1;
        }
        Ok(())
    }
}

fn check_size(frame: &Frame) -> Result<(), PipelineError> {
    if frame.width().min(frame.height()) < MIN_FRAME_SIDE {
        return Err(PipelineError::FrameTooSmall {
            width: frame.width(),
            height: frame.height(),
            minimum: MIN_FRAME_SIDE,
        });
    }
    Ok(())
}

#[cfg(test)]
mod tests;
