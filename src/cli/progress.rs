//! The progress of a long run: one line that changes on a terminal, otherwise occasional lines.

use std::{
    io::{self, IsTerminal, Write},
    time::{Duration, Instant},
};

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

#[cfg(test)]
mod tests {
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
}
