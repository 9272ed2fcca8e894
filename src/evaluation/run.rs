//! Runs the engine over a data set and scores what it found.

use std::{
    path::PathBuf,
    time::{Duration, Instant},
};

use jiff::Timestamp;

use super::{DataSet, DataSetImage, EvaluatedImage, MatchingRule, NoPersons, ScoredBox, Summary};
use crate::{
    detection::Refinement,
    pipeline::{DetectJob, DetectParameters, Engine, Person, PipelineError, Profile},
};

/// The figures of one profile and refinement.
#[derive(Debug, Clone)]
pub struct EvaluatedRow {
    /// The profile.
    pub profile: Profile,
    /// The refinement.
    pub refinement: Refinement,
    /// The model that looked.
    pub model: String,
    /// How many views the network saw per image, on average.
    pub views: f64,
    /// Wall-clock time per image: observing it and this refinement of it.
    pub time_per_image: Duration,
    /// How good it was.
    pub summary: Summary,
}

/// An evaluation that could not be finished.
#[derive(Debug, thiserror::Error)]
pub enum EvaluationError {
    /// A picture cannot be read.
    #[error("{path}: cannot be read: {source}")]
    Unreadable {
        /// The picture.
        path: PathBuf,
        /// What the operating system said.
        source: std::io::Error,
    },
    /// A picture cannot be looked at.
    #[error("{path}: {source}")]
    Failed {
        /// The picture.
        path: PathBuf,
        /// What the engine said.
        source: PipelineError,
    },
    /// There is nothing to find.
    #[error(transparent)]
    NoPersons(#[from] NoPersons),
}

/// Evaluates each of `variants`, which differ in nothing but their refinement, on one inference
/// per image. `progress` is told how many images are done.
///
/// # Errors
/// [`EvaluationError`] at the first picture that cannot be used.
pub fn evaluate(
    engine: &Engine,
    data_set: &DataSet,
    variants: &[DetectParameters],
    mut progress: impl FnMut(usize),
) -> Result<Vec<EvaluatedRow>, EvaluationError> {
    let mut per_variant = vec![Vec::with_capacity(data_set.images.len()); variants.len()];
    let mut times = vec![Duration::ZERO; variants.len()];
    let mut views = 0;
    let mut model = String::new();
    for (done, image) in data_set.images.iter().enumerate() {
        let Some(first) = variants.first() else { break };
        let started = Instant::now();
        let observation =
            engine
                .observe(&job(image, first)?)
                .map_err(|source| EvaluationError::Failed {
                    path: image.path.clone(),
                    source,
                })?;
        let observing = started.elapsed();
        views += observation.view_count();
        observation.model().name().clone_into(&mut model);
        for ((variant, images), time) in variants.iter().zip(&mut per_variant).zip(&mut times) {
            let refining = Instant::now();
            let persons = engine.persons(&observation, &variant.refinement);
            *time += observing + refining.elapsed();
            let scored = |person: &Person| ScoredBox {
                bbox: data_set.outline(image, person.bbox, Some(&person.oriented_box)),
                score: person.score,
            };
            images.push(EvaluatedImage {
                truth: image.truth.clone(),
                detections: persons.iter().map(scored).collect(),
            });
        }
        progress(done + 1);
    }
    let count = u32::try_from(data_set.images.len().max(1)).unwrap_or(u32::MAX);
    #[expect(clippy::cast_precision_loss, reason = "far below 2^52 views")]
    let views_per_image = views as f64 / f64::from(count);
    let rows = variants.iter().zip(&per_variant).zip(times);
    rows.map(|((variant, images), time)| {
        Ok(EvaluatedRow {
            profile: variant.profile,
            refinement: variant.refinement.refinement,
            model: model.clone(),
            views: views_per_image,
            time_per_image: time / count,
            summary: Summary::of_images(images, MatchingRule::Coco)?,
        })
    })
    .collect()
}

fn job(image: &DataSetImage, parameters: &DetectParameters) -> Result<DetectJob, EvaluationError> {
    let bytes = std::fs::read(&image.path).map_err(|source| EvaluationError::Unreadable {
        path: image.path.clone(),
        source,
    })?;
    Ok(DetectJob {
        request_id: String::new(),
        received_at: Timestamp::now(),
        arrived: Instant::now(),
        image: bytes.into(),
        parameters: parameters.clone(),
        calibration: image.calibration.clone(),
    })
}
