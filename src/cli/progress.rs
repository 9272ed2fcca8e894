//! The progress of a long run: one line that changes on a terminal, otherwise occasional lines.
//!
//! Errors: of writes to standard output, and as one sentence.

use std::{
    fs,
    io::{self, IsTerminal, Write},
    path::Path,
    time::{Duration, Instant},
};

use anyhow::Context;
use parking_lot::Mutex;

/// Approximate number of lines per run without a terminal.
const LINES: usize = 10;

/// The progress of one run over images, on standard error.
pub(super) struct Progress(Mutex<Lines>);

impl Progress {
    /// Starts with no image done of `total`.
    pub(super) fn start(name: &str, total: usize) -> Self {
        Self(Mutex::new(Lines {
            name: name.to_owned(),
            total,
            done: 0,
            started: Instant::now(),
        }))
    }

    /// Counts another image. May be called from any thread.
    pub(super) fn advance(&self) {
        let mut lines = self.0.lock();
        lines.done += 1;
        let line = lines.line(lines.started.elapsed());
        let mut errors = io::stderr();
        // A failure to print the progress does not stop the run.
        let _ = if errors.is_terminal() {
            write!(errors, "\r{line}\x1b[K")
        } else if lines.is_due() {
            writeln!(errors, "{line}")
        } else {
            Ok(())
        };
    }
}

impl Drop for Progress {
    /// Ends the line of a terminal.
    fn drop(&mut self) {
        let mut errors = io::stderr();
        if errors.is_terminal() {
            let _ = writeln!(errors);
        }
    }
}

/// Progress lines, limited in number so that they do not flood a log.
struct Lines {
    name: String,
    total: usize,
    done: usize,
    started: Instant,
}

impl Lines {
    /// Returns true if the last image has a line without a terminal.
    fn is_due(&self) -> bool {
        self.done.is_multiple_of(self.total.div_ceil(LINES).max(1)) || self.done == self.total
    }

    /// Returns the line for the last image.
    fn line(&self, elapsed: Duration) -> String {
        let Self {
            name, total, done, ..
        } = self;
        let to_go = total.saturating_sub(*done) as f64 / (*done).max(1) as f64;
        let seconds = elapsed.as_secs_f64() * to_go;
        format!("{name}: {done} of {total} images, about {seconds:.0} s left")
    }
}

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

    fn lines_of(total: usize) -> Vec<String> {
        let line_after = |done| {
            let lines = Lines {
                name: "fast".to_owned(),
                total,
                done,
                started: Instant::now(),
            };
            lines
                .is_due()
                .then(|| lines.line(Duration::from_secs(done as u64)))
        };
        (1..=total).filter_map(line_after).collect()
    }

    #[test]
    fn a_long_run_prints_about_ten_progress_lines() {
        let lines = lines_of(1000);
        assert_eq!(lines.len(), 10);
        assert_eq!(lines[2], "fast: 300 of 1000 images, about 700 s left");
    }

    #[test]
    fn the_last_image_always_has_a_line() {
        for total in [1, 9, 11, 34, 101] {
            let end = format!("{total} of {total} images, about 0 s left");
            assert!(lines_of(total).last().unwrap().ends_with(&end));
        }
    }

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
