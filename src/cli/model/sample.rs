//! Detection on a sample image with the model that is checked.

use std::path::Path;

use anyhow::Context;
use lookdown_common::files::{self, MAX_IMAGE_BYTES};
use lookdown_detect::{
    parameters::DetectParameters,
    pipeline::{DetectJob, DetectedFrame, JobImage},
};

use crate::{app::engine_for, settings::Settings};

/// Detects persons in the sample with the model of the settings.
pub(super) fn detect(
    settings: &Settings,
    sample: &Path,
    profile: &str,
) -> anyhow::Result<DetectedFrame> {
    let parameters = DetectParameters::parse([("profile", profile)])?;
    let engine = engine_for(settings, std::slice::from_ref(&parameters))?;
    let image = files::read(sample, MAX_IMAGE_BYTES)
        .with_context(|| format!("--sample: {} cannot be read", sample.display()))?;
    Ok(engine.detect(&DetectJob::local(
        sample.display().to_string(),
        JobImage::Encoded(image.into()),
        parameters,
        None,
    ))?)
}
