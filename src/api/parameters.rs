//! The parameters of `POST /detect`: those of the detection and those of the response.

#[cfg(test)]
mod reference;

use crate::{
    annotated_image::AnnotationOptions,
    api::answer,
    pipeline::{DetectParameters, ParameterSpec},
};

/// Lists all parameters in the order of the documentation.
pub(super) fn all() -> impl Iterator<Item = &'static ParameterSpec> {
    let tables = [
        DetectParameters::TABLE,
        answer::TABLE,
        AnnotationOptions::TABLE,
    ];
    tables.into_iter().flatten()
}

/// Takes the parameters of a table out of those of a request.
pub(super) fn take(
    given: &mut Vec<(String, String)>,
    table: &[ParameterSpec],
) -> Vec<(String, String)> {
    let is_known = |name: &str| table.iter().any(|spec| spec.name == name);
    let taken = given.extract_if(.., |(name, _)| is_known(name));
    taken.collect()
}

/// Borrows the parameters of a request for a parser.
pub(super) fn pairs(given: &[(String, String)]) -> impl Iterator<Item = (&str, &str)> {
    given
        .iter()
        .map(|(name, value)| (name.as_str(), value.as_str()))
}
