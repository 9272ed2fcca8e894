//! Meanings of a provider's failures, in words that hold no secrets and stay the same while the
//! cause does: addresses with signatures, times and numbers of requests are left out.

use lookdown_common::text::causes;
use object_store::{
    Error,
    client::{HttpError, HttpErrorKind},
};

use crate::calibration_store::StoreError;

/// The text before the status in the client's message.
const STATUS: &str = "status code: ";
/// The longest status or code that is reported.
const MAX_WORDS: usize = 64;

/// The failure of a request to `place`.
pub(super) fn of(place: &str, error: &Error) -> StoreError {
    let place = place.to_owned();
    if let Some(problem) = transport(error) {
        return StoreError::Unreachable { place, problem };
    }
    let answer = answer(error);
    let problem = format!("it answers with an error{answer}");
    // Its own faults, and too many requests, concern every object.
    if answer.starts_with(" (5") || answer.starts_with(" (429") {
        StoreError::Unreachable { place, problem }
    } else {
        StoreError::Failed { place, problem }
    }
}

/// Returns the reason why the bucket did not answer, if it did not.
fn transport(error: &Error) -> Option<String> {
    let causes: Vec<_> = causes(error).skip(1).collect();
    let failed = causes
        .iter()
        .find_map(|cause| cause.downcast_ref::<HttpError>())?;
    if failed.kind() == HttpErrorKind::Timeout {
        return Some("no answer in time".to_owned());
    }
    causes.last().map(ToString::to_string)
}

/// The status and the provider's code for the failure, as in
/// ` (403 Forbidden, SignatureDoesNotMatch)`.
fn answer(error: &Error) -> String {
    let text = causes(error).skip(1).last().map(ToString::to_string);
    let text = text.unwrap_or_default();
    let status = text.split_once(STATUS).map(|(_, rest)| rest);
    let status = status.and_then(|rest| rest.split(':').next());
    let code = text.split_once("<Code>").map(|(_, rest)| rest);
    let code = code.and_then(|rest| rest.split("</Code>").next());
    let is_plain = |words: &&str| {
        let mut letters = words.chars();
        words.len() <= MAX_WORDS
            && letters.all(|letter| letter.is_ascii_alphanumeric() || letter == ' ')
    };
    let known: Vec<_> = [status, code]
        .into_iter()
        .flatten()
        .filter(is_plain)
        .collect();
    if known.is_empty() {
        String::new()
    } else {
        format!(" ({})", known.join(", "))
    }
}
