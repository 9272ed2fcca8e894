//! The engine: converts the bytes of a frame to its report. The calling thread decodes the frame
//! and merges detections; the inference threads render views and run inference.

#[cfg(test)]
mod area_tests;
mod camera;
mod first_pass;
mod follow_pass;
#[cfg(test)]
mod follow_tests;
mod further_looks;
mod observation;

use std::{
    num::NonZeroUsize,
    sync::Arc,
    time::{Duration, Instant},
};

use lookdown_calibration::warning::{Warning, WarningCode};
use lookdown_imaging::{
    Frame,
    decode::{DecodeLimits, decode},
    with_even_light,
};
use lookdown_lens::geometry::{FootFilter, FootPlace};
use rayon::{ThreadPool, ThreadPoolBuilder};
use strum::VariantNames as _;

use super::{
    BatchOptions, CalibrationLookup, DefaultModels, DetectJob, DetectedFrame, DetectionReport,
    JobImage, Person, PipelineError, Search, Stage, StageTimings,
    follow::{FollowCache, with_candidates},
    merge,
    motion_cache::{CameraViews, MotionCache},
    network::InferenceThreads,
    report::{ModelUsed, ZoneCount},
    rig_cache::RigCache,
};
use crate::{
    detection::RefinementParameters,
    inference::{Model, ModelRegistry},
    metrics::{DetectMetrics, start_at_zero},
    parameters::DetectParameters,
};

use first_pass::FirstPass;

pub use observation::Observation;

/// The smallest frame side that can hold a lens image, pixels.
const MIN_FRAME_SIDE: u32 = 32;

/// The options of the engine.
#[derive(Debug, Clone)]
pub struct EngineOptions {
    /// Limits that are checked before a frame is decoded.
    pub decode_limits: DecodeLimits,
    /// The models for requests that name none.
    pub default_models: DefaultModels,
    /// Options for batches of views.
    pub batches: BatchOptions,
    /// Number of inference threads, equal to the number of sessions of each model.
    pub sessions: NonZeroUsize,
    /// Number of threads that build remap tables and render batches of several views.
    pub remap_threads: NonZeroUsize,
    /// Maximum memory of cached remap tables, bytes.
    pub rig_cache_bytes: usize,
}

impl EngineOptions {
    /// The default memory of cached remap tables, bytes.
    pub const RIG_CACHE_BYTES: usize = 256 << 20;

    /// Returns options with `threads` sessions and as many threads that render, a view in each run.
    pub fn new(default_models: DefaultModels, threads: NonZeroUsize) -> Self {
        Self {
            decode_limits: DecodeLimits::default(),
            default_models,
            batches: BatchOptions {
                max_views: NonZeroUsize::MIN,
                max_delay: Duration::ZERO,
            },
            sessions: threads,
            remap_threads: threads,
            rig_cache_bytes: Self::RIG_CACHE_BYTES,
        }
    }

    /// Returns options for tests: `model` for all profiles, one session, large batches.
    pub fn for_testing(model: &str) -> Self {
        let mut options = Self::new(DefaultModels::one(model.to_owned()), NonZeroUsize::MIN);
        options.batches.max_views = NonZeroUsize::MIN.saturating_add(127);
        options
    }
}

/// Finds persons in frames.
pub struct Engine {
    models: Arc<ModelRegistry>,
    inference: InferenceThreads,
    remappers: Arc<ThreadPool>,
    calibrations: Option<Arc<dyn CalibrationLookup>>,
    rigs: RigCache,
    motion_cache: MotionCache,
    follow_cache: FollowCache,
    /// The turn of all view plans about their axis, radians. A person is then seen in other views,
    /// so that several turns tell how much of a precision is chance.
    pub plan_turn: f64,
    /// The options.
    pub options: EngineOptions,
    pub(super) metrics: Arc<DetectMetrics>,
}

impl Engine {
    /// Creates an engine that runs `models`. Without `calibrations` every lens is assumed.
    ///
    /// # Errors
    /// Fails if the operating system cannot start the threads.
    pub fn new(
        models: Arc<ModelRegistry>,
        calibrations: Option<Arc<dyn CalibrationLookup>>,
        options: EngineOptions,
        metrics: Arc<DetectMetrics>,
    ) -> std::io::Result<Self> {
        let remappers = ThreadPoolBuilder::new()
            .num_threads(options.remap_threads.get())
            .thread_name(|index| format!("remap-{index}"))
            .build()
            .map_err(std::io::Error::other)?;
        let remappers = Arc::new(remappers);
        start_at_zero(&metrics.frame_searches, Search::VARIANTS);
        Ok(Self {
            models,
            inference: InferenceThreads::start(
                options.sessions,
                options.batches,
                &remappers,
                &metrics,
            )?,
            remappers,
            calibrations,
            rigs: RigCache::new(options.rig_cache_bytes, Arc::clone(&metrics)),
            motion_cache: MotionCache::default(),
            follow_cache: FollowCache::default(),
            plan_turn: 0.0,
            options,
            metrics,
        })
    }

    /// Returns the default models.
    pub fn default_models(&self) -> &DefaultModels {
        &self.options.default_models
    }

    /// Detects the persons in a frame. Blocks: do not call it on an async runtime thread.
    ///
    /// # Errors
    /// Returns a [`PipelineError`], which distinguishes client and server faults.
    pub fn detect(&self, job: &DetectJob) -> Result<DetectedFrame, PipelineError> {
        let mut observation = self.observe(job)?;
        let follow = observation.follow.take();
        let timeline = &job.ticket.timeline;
        let parameters = &job.parameters;
        timeline.enter(Stage::Refine, Instant::now());
        let found = |refinement: &RefinementParameters| self.persons(&observation, refinement);
        let persons = match follow {
            Some(follow) => follow.persons(&observation.camera.rig, found),
            None => found(&with_candidates(&parameters.refinement)),
        };
        timeline.leave(Instant::now());
        let foot_filter = &observation.camera.rig.geometry.areas.foot_filter;
        let mut placed = Placed::new(persons, foot_filter);
        let scores = scores(&placed.persons);
        placed.retain(parameters.refinement.score_threshold);
        let Placed {
            persons,
            margin,
            outside,
        } = placed;
        let views = observation.view_counts();
        let search = observation.search();
        let searches = &self.metrics.frame_searches;
        searches.with_label_values(&[search.name()]).inc();
        let zones = ZoneCount::for_zones(&observation.camera.rig.geometry.areas.zones, &persons);
        let calibration = observation.camera.used.clone();
        let camera = parameters.camera.clone();
        let report = DetectionReport {
            request_id: job.request_id.clone(),
            camera: camera.unwrap_or_else(|| calibration.id.clone()),
            received_at: job.received_at,
            captured_at: parameters.captured_at,
            calibration,
            image_width: observation.frame.width(),
            image_height: observation.frame.height(),
            crop_model: observation.crop_model().map(ModelUsed::from),
            model: ModelUsed::from(&*observation.model),
            profile: parameters.profile,
            refinement: parameters.refinement,
            defaults: parameters.defaults.clone(),
            persons,
            scores,
            margin,
            zones,
            search,
            views,
            batch_count: observation.batch_count,
            non_finite: observation.non_finite,
            timings: StageTimings {
                total: job.arrived.elapsed(),
                ..timeline.timings()
            },
            warnings: observation.warnings,
        };
        let rigs: Vec<_> = observation
            .passes
            .into_iter()
            .map(|pass| pass.rig)
            .collect();
        let has_no_masks = observation.camera.rig.has_no_masks();
        Ok(DetectedFrame {
            withdrawn: job.ticket.withdrawn.clone(),
            report,
            frame: observation.frame,
            outside,
            encoded: match &job.image {
                JobImage::Encoded(file) if has_no_masks => Some(file.clone()),
                _ => None,
            },
            rigs,
        })
    }

    /// Runs all stages up to and including inference.
    ///
    /// # Errors
    /// Returns a [`PipelineError`], which distinguishes client and server faults.
    pub fn observe(&self, job: &DetectJob) -> Result<Observation, PipelineError> {
        let timeline = &job.ticket.timeline;
        timeline.enter(Stage::Queue, job.arrived);
        timeline.enter(Stage::Decode, Instant::now());
        let model = self.model(&job.parameters)?;
        let (mut frame, orientation_applied) = match &job.image {
            JobImage::Encoded(file) => {
                let decoded = decode(file, &self.options.decode_limits)?;
                (Arc::new(decoded.frame), decoded.orientation_applied)
            }
            JobImage::Decoded(frame) => (Arc::clone(frame), false),
        };
        check_size(&frame)?;
        timeline.enter(Stage::Calibrate, Instant::now());

        let mut warnings = Vec::new();
        if orientation_applied {
            warnings.push(Warning::new(
                WarningCode::FrameRotated,
                "the frame was rotated according to its EXIF orientation; boxes are in pixels of the \
                 rotated frame",
            ));
        }
        let camera = self.camera(job, &frame, &model, &mut warnings)?;
        if !camera.rig.has_no_masks() {
            camera.rig.blank(Arc::make_mut(&mut frame));
        }
        let even = with_even_light(&frame).map(Arc::new);
        let mut observation = Observation {
            profile: job.parameters.profile,
            tuning: job.parameters.profile.tuning(),
            passes: Vec::with_capacity(3),
            is_searched: true,
            follow: None,
            unchanged_views: 0,
            batch_count: 0,
            non_finite: 0,
            timeline: timeline.clone(),
            network_frame: even.unwrap_or_else(|| Arc::clone(&frame)),
            frame,
            camera,
            model,
            warnings,
        };
        match self.follow_pass(job, &mut observation) {
            FirstPass::Search => {}
            pass => {
                if let FirstPass::Crops(task) = pass {
                    observation.wait_for(&task)?;
                }
                if self.confirms_followed(&mut observation) {
                    timeline.leave(Instant::now());
                    return Ok(observation);
                }
                observation.passes.clear();
                observation.is_searched = true;
            }
        }
        let rig = Arc::clone(&observation.camera.rig);
        let model = Arc::clone(&observation.model);
        let cached = self.cached_views(job, &observation);
        let first = self.queue_pass(job, &observation, rig, model, cached);
        observation.wait_for(&first)?;
        self.look_again(job, &mut observation)?;
        Ok(observation)
    }

    /// Merges the detections of an observed frame into persons.
    pub fn persons(
        &self,
        observation: &Observation,
        refinement: &RefinementParameters,
    ) -> Vec<Person> {
        let Observation { passes, tuning, .. } = observation;
        merge::persons(passes, observation.profile, tuning, refinement)
    }

    /// Returns the camera's views in the motion cache, if the request enables motion detection.
    fn cached_views(&self, job: &DetectJob, seen: &Observation) -> Option<Arc<CameraViews>> {
        let camera = job.parameters.motion_camera()?;
        Some(
            self.motion_cache
                .camera_views(camera, &seen.camera.rig, &seen.model),
        )
    }

    /// Returns the model for requests that name none.
    pub(super) fn default_model(&self) -> Result<Arc<Model>, PipelineError> {
        let name = self.options.default_models.model();
        self.models.get(name).ok_or(PipelineError::ModelStarting)
    }

    /// Returns the model that the request names, or the default model of its profile.
    fn model(&self, parameters: &DetectParameters) -> Result<Arc<Model>, PipelineError> {
        let Some(name) = &parameters.model else {
            let name = self.options.default_models.model_of(parameters);
            return self.models.get(name).ok_or_else(|| {
                if parameters.floor {
                    PipelineError::NoFloorModel {
                        name: name.to_owned(),
                    }
                } else {
                    PipelineError::ModelStarting
                }
            });
        };
        self.models.get(name).ok_or_else(|| {
            let loaded = self.models.all();
            let loaded: Vec<_> = loaded.iter().map(|model| &*model.name).collect();
            PipelineError::UnknownModel {
                name: name.clone(),
                loaded: loaded.join(", "),
            }
        })
    }
}

/// Returns the scores of boxes, highest first.
#[expect(clippy::cast_possible_truncation, reason = "scores need few digits")]
fn scores(persons: &[Person]) -> Vec<f32> {
    persons.iter().map(|person| person.score as f32).collect()
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

/// The persons of a frame by the places of their feet.
#[derive(Default)]
struct Placed {
    /// Those who count.
    persons: Vec<Person>,
    /// Those in the margin of an area; `None` without areas.
    margin: Option<Vec<Person>>,
    /// All others.
    outside: Vec<Person>,
}

impl Placed {
    /// Sorts persons by the places of their feet, in their order.
    fn new(persons: Vec<Person>, filter: &FootFilter) -> Self {
        let mut placed = Self {
            margin: (!filter.areas.is_empty()).then(Vec::new),
            ..Self::default()
        };
        for person in persons {
            match filter.place(person.foot, person.floor) {
                FootPlace::Inside => placed.persons.push(person),
                FootPlace::Margin => placed.margin.get_or_insert_default().push(person),
                FootPlace::Outside => placed.outside.push(person),
            }
        }
        placed
    }

    /// Removes those of lower scores than the threshold.
    fn retain(&mut self, score_threshold: f64) {
        let margin = self.margin.iter_mut();
        for persons in margin.chain([&mut self.persons, &mut self.outside]) {
            persons.retain(|person| person.score >= score_threshold);
        }
    }
}

#[cfg(test)]
mod tests;
