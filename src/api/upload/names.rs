//! The parameters that may come with a frame.

use super::form::FieldUse;
use crate::{
    api::{
        answer::AnswerOptions,
        problem::{Problem, ProblemKind},
    },
    pipeline::DetectParameters,
};

/// The names of the frame's field.
const FRAME_NAMES: [&str; 2] = ["img", "image"];
/// Most characters of an unknown name that are repeated to its sender.
const MAX_NAME_CHARS: usize = 64;

/// Whether there is a parameter of this name.
pub(super) fn is_parameter(name: &str) -> bool {
    names().any(|known| known == name)
}

/// What a field of the form is for.
pub(super) fn use_of(name: &str) -> FieldUse {
    if FRAME_NAMES.contains(&name) {
        FieldUse::Frame
    } else if is_parameter(name) {
        FieldUse::Parameter
    } else {
        FieldUse::Refused
    }
}

/// What the sender of another name is told.
pub(super) fn unknown_parameter(name: &str) -> Problem {
    let shown: String = name.chars().take(MAX_NAME_CHARS).collect();
    let known = names().collect::<Vec<_>>().join(", ");
    let detail = format!(
        "there is no such field or parameter: send the frame as `img` or `image`; the parameters are \
         {known}"
    );
    Problem::of_parameter(ProblemKind::UnknownParameter, &shown, &detail)
}

fn names() -> impl Iterator<Item = &'static str> {
    DetectParameters::NAMES
        .into_iter()
        .chain(AnswerOptions::NAMES)
}
