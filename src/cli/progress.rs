//! The progress of a long run: a bar on a terminal, otherwise occasional lines.

use std::{
    io::{self, IsTerminal, Write},
    time::{Duration, Instant},
};

use indicatif::{ProgressBar, ProgressStyle};
use parking_lot::Mutex;

/// Approximate number of lines per run without a terminal.
const LINES: usize = 10;
const BAR: &str = "{prefix} {wide_bar} {pos} of {len} images, {eta} left";

/// The progress of one run over images, on standard error.
pub(super) enum Progress {
    /// On a terminal.
    Bar(ProgressBar),
    /// Without a terminal.
    Lines(Mutex<Lines>),
}

impl Progress {
    /// Starts with no image done of `total`.
    pub(super) fn start(name: &str, total: usize) -> Self {
        if !io::stderr().is_terminal() {
            return Self::Lines(Mutex::new(Lines {
                name: name.to_owned(),
                total,
                done: 0,
                started: Instant::now(),
            }));
        }
        let style = ProgressStyle::with_template(BAR);
        let bar = ProgressBar::new(total as u64)
            .with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
            .with_prefix(name.to_owned());
        Self::Bar(bar)
    }

    /// Counts another image. May be called from any thread.
    pub(super) fn advance(&self) {
        match self {
            Self::Bar(bar) => bar.inc(1),
            Self::Lines(lines) => {
                let mut lines = lines.lock();
                lines.done += 1;
                if let Some(line) = lines.due(lines.started.elapsed()) {
                    // A failure to print the progress does not stop the run.
                    let _ = writeln!(io::stderr(), "{line}");
                }
            }
        }
    }

    /// Ends the run. The bar stays visible.
    pub(super) fn finish(&self) {
        if let Self::Bar(bar) = self {
            bar.abandon();
        }
    }
}

/// Progress lines, limited in number so that they do not flood a log.
pub(super) struct Lines {
    name: String,
    total: usize,
    done: usize,
    started: Instant,
}

impl Lines {
    /// Returns the line for the last image, if one is due.
    fn due(&self, elapsed: Duration) -> Option<String> {
        let Self {
            name, total, done, ..
        } = self;
        if !done.is_multiple_of(total.div_ceil(LINES).max(1)) && done != total {
            return None;
        }
        #[expect(
            clippy::cast_precision_loss,
            reason = "an approximate value is sufficient"
        )]
        let to_go = total.saturating_sub(*done) as f64 / (*done).max(1) as f64;
        let seconds = elapsed.as_secs_f64() * to_go;
        Some(format!(
            "{name}: {done} of {total} images, about {seconds:.0} s left"
        ))
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
            lines.due(Duration::from_secs(done as u64))
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
