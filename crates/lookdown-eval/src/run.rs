//! Runs the engine over the images of a data set.

use std::{
    num::NonZeroUsize,
    time::{Duration, Instant},
};

use lookdown_common::files::{self, FileError, MAX_IMAGE_BYTES};
use lookdown_detect::{
    parameters::DetectParameters,
    pipeline::{DetectJob, Engine, JobImage},
};

use super::{
    DataSet, DataSetImage, DetectedRow, FoundPerson, RowCost, RowName, in_order::in_order,
};

/// The detections of one image.
struct Seen {
    model: String,
    views: usize,
    /// Time up to and including the network.
    observing: Duration,
    /// The detections of each variant, and the time of its refinement.
    variants: Vec<(Vec<FoundPerson>, Duration)>,
}

/// Detects the persons in every image with each of `variants`, which differ only in their
/// refinement, with one inference per image. At most `at_once` images are in memory at a time.
/// `done` is called after each, from any thread. The results do not depend on `at_once`, except for
/// the times.
///
/// # Errors
/// [`FileError`] of the first image that cannot be used.
pub fn detect(
    engine: &Engine,
    data_set: &DataSet,
    variants: &[DetectParameters],
    at_once: NonZeroUsize,
    done: impl Fn() + Sync,
) -> Result<Vec<DetectedRow>, FileError> {
    let Some(first) = variants.first() else {
        return Ok(Vec::new());
    };
    let seen = in_order(&data_set.images, at_once, |image| {
        let seen = evaluate_image(engine, image, first, variants);
        done();
        seen
    })?;
    Ok(rows(seen, variants))
}

fn evaluate_image(
    engine: &Engine,
    image: &DataSetImage,
    first: &DetectParameters,
    variants: &[DetectParameters],
) -> Result<Seen, FileError> {
    let observation = engine
        .observe(&job(image, first)?)
        .map_err(|error| FileError::new(&image.path, error.to_string()))?;
    let refined = variants.iter().map(|variant| {
        let refining = Instant::now();
        let persons = engine.persons(&observation, &variant.refinement);
        let took = refining.elapsed();
        (persons.iter().map(FoundPerson::from).collect(), took)
    });
    Ok(Seen {
        model: observation.model().name().to_owned(),
        views: observation.view_count(),
        observing: observation.timings().worked(),
        variants: refined.collect(),
    })
}

fn job(image: &DataSetImage, parameters: &DetectParameters) -> Result<DetectJob, FileError> {
    let bytes = files::read(&image.path, MAX_IMAGE_BYTES)
        .map_err(|error| FileError::unreadable(&image.path, &error))?;
    Ok(DetectJob::local(
        String::new(),
        JobImage::Encoded(bytes.into()),
        parameters.clone(),
        image.calibration.clone(),
    ))
}

fn rows(seen: Vec<Seen>, variants: &[DetectParameters]) -> Vec<DetectedRow> {
    let model = seen.first().map_or("", |image| &image.model).to_owned();
    let count = u32::try_from(seen.len().max(1)).unwrap_or(u32::MAX);
    let views: usize = seen.iter().map(|image| image.views).sum();
    let views_per_image = views as f64 / f64::from(count);
    let observing: Duration = seen.iter().map(|image| image.observing).sum();
    let mut rows: Vec<_> = variants
        .iter()
        .map(|variant| DetectedRow {
            name: RowName {
                profile: Some(variant.profile),
                refinement: Some(variant.refinement.refinement),
                model: model.clone(),
            },
            refinement: Some(variant.refinement),
            cost: Some(RowCost {
                views: views_per_image,
                time_per_image: observing / count,
            }),
            images: Vec::with_capacity(seen.len()),
        })
        .collect();
    for image in seen {
        for (row, (found, refining)) in rows.iter_mut().zip(image.variants) {
            row.images.push(found);
            if let Some(cost) = &mut row.cost {
                cost.time_per_image += refining / count;
            }
        }
    }
    rows
}
