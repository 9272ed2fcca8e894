//! The last line that a child process writes to its standard error.

use tokio::{
    io::AsyncReadExt,
    process::ChildStderr,
    time::{Duration, timeout},
};

use lookdown_common::text::one_line;

/// Most bytes of a line that are kept.
const MAX_BYTES: usize = 1000;
/// Longest time to wait for the last line after the output has ended.
const LAST_WORDS: Duration = Duration::from_secs(1);

/// The last line of standard error, as far as it was read.
pub(crate) struct LastLine {
    stderr: ChildStderr,
    line: Vec<u8>,
    is_ended: bool,
    is_complete: bool,
}

impl LastLine {
    pub(crate) fn new(stderr: ChildStderr) -> Self {
        Self {
            stderr,
            line: Vec::new(),
            is_ended: false,
            is_complete: false,
        }
    }

    /// Reads further text. Never ends after the end of the text. May be cancelled.
    pub(crate) async fn read(&mut self) {
        if self.is_ended {
            std::future::pending::<()>().await;
        }
        let mut bytes = [0; 512];
        match self.stderr.read(&mut bytes).await {
            Ok(0) | Err(_) => self.is_ended = true,
            Ok(count) => self.push(&bytes[..count]),
        }
    }

    fn push(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            if byte == b'\n' || byte == b'\r' {
                self.is_complete = true;
                continue;
            }
            if std::mem::take(&mut self.is_complete) {
                self.line.clear();
            }
            if self.line.len() < MAX_BYTES {
                self.line.push(byte);
            }
        }
    }

    /// Reads the rest, and returns the last line. The wait for the rest is bounded, so a child that
    /// still runs is not waited for.
    pub(crate) async fn last(&mut self) -> String {
        let rest = async {
            while !self.is_ended {
                self.read().await;
            }
        };
        // A child that keeps its standard error open loses its last line.
        let _ = timeout(LAST_WORDS, rest).await;
        one_line(&String::from_utf8_lossy(&self.line))
    }
}
