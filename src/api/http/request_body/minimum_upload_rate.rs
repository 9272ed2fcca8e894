//! The minimum upload rate, the protection against slow-body (slow-loris) clients: a period of a
//! few seconds must not bring fewer bytes than the rate requires.

use std::{num::NonZeroU64, time::Duration};

use tokio::time::Instant;

/// Longest time without any bytes.
const MAX_SILENCE: Duration = Duration::from_secs(5);

/// The time to wait for the next bytes. Each byte extends it, up to [`MAX_SILENCE`].
pub(in crate::api) struct MinimumUploadRate {
    /// Least rate; `None` for no limit.
    least_bytes_per_second: Option<NonZeroU64>,
    late_at: Instant,
}

impl MinimumUploadRate {
    pub(in crate::api) fn begin(least_bytes_per_second: Option<NonZeroU64>) -> Self {
        Self {
            least_bytes_per_second,
            late_at: Instant::now() + MAX_SILENCE,
        }
    }

    /// Returns the end of the wait: the time at which the client is too slow, or `deadline`.
    pub(in crate::api) fn late_at(&self, deadline: Instant) -> Instant {
        match self.least_bytes_per_second {
            Some(_) => self.late_at.min(deadline),
            None => deadline,
        }
    }

    /// Records received bytes.
    pub(in crate::api) fn came(&mut self, bytes: usize) {
        let Some(least) = self.least_bytes_per_second else {
            return;
        };
        let extension = (bytes as f64 / least.get() as f64).min(MAX_SILENCE.as_secs_f64());
        let longest = Instant::now() + MAX_SILENCE;
        self.late_at = (self.late_at + Duration::from_secs_f64(extension)).min(longest);
    }
}
