//! The parameters of `POST /detect`: those of the detection and those of the response.

#[cfg(test)]
mod reference;

use lookdown_detect::parameters::{DetectParameters, ParameterSpec};

use crate::{annotated_image::AnnotationOptions, api::detect::answer};

/// Lists all parameters in the order of the documentation.
pub(super) fn all() -> impl Iterator<Item = &'static ParameterSpec> {
    let tables = [
        DetectParameters::TABLE,
        answer::TABLE,
        AnnotationOptions::TABLE,
    ];
    tables.into_iter().flatten()
}
