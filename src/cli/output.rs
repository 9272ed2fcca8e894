//! Errors: of writes to standard output, and as one sentence.

use std::{
    fs,
    io::{self, Write},
    path::Path,
};

use anyhow::Context;

/// The error of a write to standard output.
pub(super) const UNWRITABLE: &str = "standard output cannot be written";

/// Writes a text into the file of an option, or to standard output without a file.
pub(super) fn write_or_print(option: &str, file: Option<&Path>, text: &str) -> anyhow::Result<()> {
    match file {
        Some(file) => fs::write(file, text)
            .with_context(|| format!("{option}: {} cannot be written", file.display())),
        None => write!(io::stdout(), "{text}").context(UNWRITABLE),
    }
}

/// Returns true if the program that reads standard output has ended, such as `head`.
pub(super) fn is_closed_pipe(error: &anyhow::Error) -> bool {
    let mut causes = error.chain();
    let is_output = causes.any(|cause| cause.to_string() == UNWRITABLE);
    let mut causes = error
        .chain()
        .filter_map(|cause| cause.downcast_ref::<io::Error>());
    is_output && causes.any(|cause| cause.kind() == io::ErrorKind::BrokenPipe)
}

/// Formats an error with its causes. A cause that the text before it repeats is left out.
pub(super) fn with_causes(error: &anyhow::Error) -> String {
    let mut causes = error.chain().map(ToString::to_string);
    let first = causes.next().unwrap_or_default();
    causes.fold(first, |text, cause| {
        if text.ends_with(&cause) {
            text
        } else {
            format!("{text}: {cause}")
        }
    })
}

#[cfg(test)]
mod tests {
    use anyhow::anyhow;

    use super::*;

    #[test]
    fn each_cause_is_printed_once() {
        let cause = || anyhow!("it is missing");
        let repeated = cause().context("a.jpg cannot be read: it is missing");
        assert_eq!(
            with_causes(&repeated),
            "a.jpg cannot be read: it is missing"
        );
        let other = cause().context("a.jpg cannot be read");
        assert_eq!(with_causes(&other), "a.jpg cannot be read: it is missing");
    }
}
