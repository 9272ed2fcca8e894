//! The engine: everything between a frame's bytes and its report, on the calling thread.

mod camera;
mod closer;

use std::{
    num::NonZeroUsize,
    sync::{Arc, Mutex, PoisonError},
    time::Instant,
};

use rayon::{ThreadPool, ThreadPoolBuildError, ThreadPoolBuilder};

use self::camera::FrameCamera;
use super::{
    DefaultModels, DetectJob, DetectParameters, Detected, DetectionReport, Person, PipelineError,
    Profile, StageTimings, camera_rig::CameraRig, error::internal, look::Look, merge,
    report::ModelUsed, rig_cache::RigCache,
};
use crate::{
    calibration::Calibrations,
    detection::RefinementParameters,
    geometry::FieldOfViewReading,
    imaging::{
        Frame, ViewBatch,
        decode::{DecodeLimits, decode},
    },
    inference::{Model, ModelRegistry},
};

/// The smallest frame side that can hold a lens image, pixels.
const MIN_FRAME_SIDE: u32 = 32;

/// How the engine works.
#[derive(Debug, Clone)]
pub struct EngineOptions {
    /// What a picture may cost before it is decoded.
    pub decode_limits: DecodeLimits,
    /// Which model answers requests that name none.
    pub default_models: DefaultModels,
    /// Most views given to the network at once.
    pub max_batch_views: NonZeroUsize,
    /// Threads that render views.
    pub remap_threads: NonZeroUsize,
    /// How the paper's field of view is read.
    pub paper_field_of_view: FieldOfViewReading,
    /// Most memory that remap tables may hold, bytes.
    pub rig_cache_bytes: usize,
}

/// Finds persons in frames.
pub struct Engine {
    models: Arc<ModelRegistry>,
    /// One frame at a time is in a network, whichever: the networks share their cores.
    network_turn: Mutex<()>,
    remappers: ThreadPool,
    calibrations: Option<Arc<Calibrations>>,
    rigs: RigCache,
    options: EngineOptions,
}

/// A frame after the network has seen it: all that refinement needs, so that other refinements
/// of the same frame cost no inference.
pub struct Observation {
    /// The decoded frame, EXIF orientation applied.
    pub frame: Frame,
    camera: FrameCamera,
    model: Arc<Model>,
    profile: Profile,
    looks: Vec<Look>,
    batch_count: usize,
    non_finite: usize,
    timings: StageTimings,
    warnings: Vec<String>,
}

impl Observation {
    /// How many views the network saw.
    #[must_use]
    pub fn view_count(&self) -> usize {
        self.looks.iter().map(|look| look.rig.view_count()).sum()
    }

    /// Where the time went so far: `refine` and `total` are still to come.
    #[must_use]
    pub fn timings(&self) -> &StageTimings {
        &self.timings
    }

    /// The model that looked.
    #[must_use]
    pub fn model(&self) -> &Model {
        &self.model
    }
}

impl Engine {
    /// An engine that looks with `models`; without `calibrations` every lens is assumed.
    ///
    /// # Errors
    /// When the operating system gives no threads.
    pub fn new(
        models: Arc<ModelRegistry>,
        calibrations: Option<Arc<Calibrations>>,
        options: EngineOptions,
    ) -> Result<Self, ThreadPoolBuildError> {
        let remappers = ThreadPoolBuilder::new()
            .num_threads(options.remap_threads.get())
            .thread_name(|index| format!("remap-{index}"))
            .build()?;
        Ok(Self {
            models,
            network_turn: Mutex::new(()),
            remappers,
            calibrations,
            rigs: RigCache::new(options.rig_cache_bytes),
            options,
        })
    }

    /// Which model answers requests that name none.
    #[must_use]
    pub fn default_models(&self) -> &DefaultModels {
        &self.options.default_models
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
        let view_count = observation.view_count();
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
            model: ModelUsed {
                name: observation.model.name().to_owned(),
                revision: observation.model.revision().to_owned(),
            },
            profile: parameters.profile,
            refinement: parameters.refinement,
            persons,
            view_count,
            batch_count: observation.batch_count,
            non_finite: observation.non_finite,
            timings: StageTimings {
                refine: observation.timings.refine + refining.elapsed(),
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
        let model = self.model(&job.parameters)?;
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
        let camera = self.camera(job, &frame, &model, &mut warnings)?;
        let calibrated_at = Instant::now();

        let mut observation = Observation {
            profile: job.parameters.profile,
            looks: Vec::with_capacity(3),
            batch_count: 0,
            non_finite: 0,
            timings: StageTimings {
                decode: decoded_at - started,
                calibrate: calibrated_at - decoded_at,
                queue: started.saturating_duration_since(job.arrived),
                ..StageTimings::default()
            },
            frame,
            camera,
            model,
            warnings,
        };
        let (rig, model) = (
            Arc::clone(&observation.camera.rig),
            Arc::clone(&observation.model),
        );
        self.look(&mut observation, rig, model)?;
        for (rig, model) in self.closer(job, &mut observation) {
            self.look(&mut observation, Arc::new(rig), model)?;
        }
        Ok(observation)
    }

    /// The persons in an observed frame.
    #[must_use]
    pub fn persons(
        &self,
        observation: &Observation,
        refinement: &RefinementParameters,
    ) -> Vec<Person> {
        let back_projection = observation.profile.back_projection();
        merge::persons(&observation.looks, back_projection, refinement)
    }

    pub(super) fn options(&self) -> &EngineOptions {
        &self.options
    }

    /// The model that answers requests which name none.
    pub(super) fn default_model(&self, profile: Profile) -> Result<Arc<Model>, PipelineError> {
        let name = self.options.default_models.of(profile);
        self.models.get(name).ok_or(PipelineError::ModelStarting)
    }

    /// The model that a request named, or the one for its profile.
    fn model(&self, parameters: &DetectParameters) -> Result<Arc<Model>, PipelineError> {
        let Some(name) = &parameters.model else {
            return self.default_model(parameters.profile);
        };
        self.models.get(name).ok_or_else(|| {
            let loaded = self.models.all();
            let loaded: Vec<_> = loaded.iter().map(|model| model.name()).collect();
            PipelineError::UnknownModel {
                name: name.clone(),
                loaded: loaded.join(", "),
            }
        })
    }

    /// Renders the views of a rig and runs the network on them, batch by batch.
    fn look(
        &self,
        observation: &mut Observation,
        rig: Arc<CameraRig>,
        model: Arc<Model>,
    ) -> Result<(), PipelineError> {
        let waiting = Instant::now();
        // Guards nothing that a panic could leave half changed.
        let _turn = self
            .network_turn
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        observation.timings.queue += waiting.elapsed();
        let mut batch = ViewBatch::default();
        let views = rig.view_count();
        let mut per_view = Vec::with_capacity(views);
        let step = self.options.max_batch_views.get();
        for start in (0..views).step_by(step) {
            let remapping = Instant::now();
            let range = start..views.min(start + step);
            let frame = &observation.frame;
            self.remappers
                .install(|| rig.render(frame, range, model.input(), &mut batch));
            let inferring = Instant::now();
            let found = model
                .detect(&batch)
                .map_err(|error| internal(anyhow::Error::new(error)))?;
            observation.timings.remap += inferring - remapping;
            observation.timings.inference += inferring.elapsed();
            per_view.extend(found.per_view);
            observation.non_finite += found.non_finite;
            observation.batch_count += 1;
        }
        observation.looks.push(Look {
            rig,
            model,
            per_view,
        });
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
