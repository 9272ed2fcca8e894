//! One pass over a data set for several rows.

use lookdown_detect::{parameters::DetectParameters, pipeline::Engine};
use lookdown_eval::{DataSet, DetectedRow, EvaluationError, detect};

use crate::{cli::progress::Progress, settings::Settings};

/// Detects the persons of a data set once for all rows of a group.
pub(in crate::cli) fn detect_group(
    engine: &Engine,
    data_set: &DataSet,
    group: &[DetectParameters],
    settings: &Settings,
) -> Result<Vec<DetectedRow>, EvaluationError> {
    let name = group.first().map_or("", |first| first.profile.name());
    let progress = Progress::start(name, data_set.images.len());
    let at_once = settings.threads.frame_workers;
    let rows = detect(engine, data_set, group, at_once, || progress.advance());
    progress.finish();
    rows
}
