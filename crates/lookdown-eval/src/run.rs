//! Runs the engine over the images of a data set.
//!
//! Processes several images concurrently, with results in the order of the images. Not by rayon: a
//! thread of its pool that waits for the engine's pool would begin a further image meanwhile.

use std::{
    num::NonZeroUsize,
    panic::resume_unwind,
    sync::atomic::{AtomicBool, AtomicUsize, Ordering},
    thread,
    time::{Duration, Instant},
};

use lookdown_common::files::{self, FileError, MAX_IMAGE_BYTES};
use lookdown_detect::{
    parameters::DetectParameters,
    pipeline::{DetectJob, Engine, JobImage},
};

use crate::{DataSet, DataSetImage, DetectedRow, FoundPerson, RowCost, RowName};

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
        model: observation.model.name.clone(),
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

/// Runs `work` for each item, on at most `at_once` threads. The results equal those of one thread,
/// regardless of the order in which items finish: the error is that of the first item with an
/// error, and no item is started after an error.
fn in_order<T: Sync, R: Send, E: Send>(
    items: &[T],
    at_once: NonZeroUsize,
    work: impl Fn(&T) -> Result<R, E> + Sync,
) -> Result<Vec<R>, E> {
    let next = AtomicUsize::new(0);
    let failed = AtomicBool::new(false);
    let take_turns = || {
        let mut results = Vec::new();
        while !failed.load(Ordering::Relaxed) {
            // Items are started in their order, so everything before a failed one is finished.
            let index = next.fetch_add(1, Ordering::Relaxed);
            let Some(item) = items.get(index) else { break };
            let result = work(item);
            failed.fetch_or(result.is_err(), Ordering::Relaxed);
            results.push((index, result));
        }
        results
    };
    let mut results = thread::scope(|scope| {
        let helpers: Vec<_> = (1..at_once.get().min(items.len()))
            .map(|number| {
                let thread = thread::Builder::new().name(format!("evaluation-{number}"));
                thread.spawn_scoped(scope, take_turns)
            })
            .collect();
        let mut results = take_turns();
        // If the operating system refuses a helper thread, the other threads do its work.
        for helper in helpers.into_iter().flatten() {
            results.extend(helper.join().unwrap_or_else(|panic| resume_unwind(panic)));
        }
        results
    });
    results.sort_unstable_by_key(|(index, _)| *index);
    results.into_iter().map(|(_, result)| result).collect()
}

#[cfg(test)]
mod tests {
    use std::sync::Barrier;

    use super::*;

    const TWO: NonZeroUsize = NonZeroUsize::new(2).unwrap();

    #[test]
    fn two_items_run_concurrently_and_results_keep_their_order() {
        let both_begun = Barrier::new(2);
        let result: Result<Vec<u32>, ()> = in_order(&[1, 2, 3, 4], TWO, |item| {
            both_begun.wait();
            Ok(item * 10)
        });
        assert_eq!(result, Ok(vec![10, 20, 30, 40]));
    }

    #[test]
    fn the_error_is_that_of_the_first_failed_item() {
        let both_begun = Barrier::new(2);
        let result: Result<Vec<()>, u32> = in_order(&[1, 2], TWO, |item| {
            both_begun.wait();
            Err(*item)
        });
        assert_eq!(result, Err(1));
    }

    #[test]
    fn no_item_is_started_after_an_error() {
        let begun = AtomicUsize::new(0);
        let result: Result<Vec<()>, &str> = in_order(&[0; 100], NonZeroUsize::MIN, |_| {
            begun.fetch_add(1, Ordering::Relaxed);
            Err("broken")
        });
        assert_eq!((result, begun.into_inner()), (Err("broken"), 1));
    }
}
