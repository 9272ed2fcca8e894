//! How slowly a body may come: no stretch of a few seconds may bring fewer bytes than the least
//! rate would.

use std::{num::NonZeroU64, time::Duration};

use tokio::time::Instant;

/// How long nothing at all may come.
const PATIENCE: Duration = Duration::from_secs(5);

/// How long the sender of a body may be waited for: each byte buys time, up to [`PATIENCE`].
pub(in crate::api) struct Pace {
    /// `None`: any rate will do.
    least_bytes_per_second: Option<NonZeroU64>,
    late_at: Instant,
}

impl Pace {
    pub(in crate::api) fn begin(least_bytes_per_second: Option<NonZeroU64>) -> Self {
        Self {
            least_bytes_per_second,
            late_at: Instant::now() + PATIENCE,
        }
    }

    /// Until when to wait for more: until the sender is too slow, or until `deadline`.
    pub(in crate::api) fn late_at(&self, deadline: Instant) -> Instant {
        match self.least_bytes_per_second {
            Some(_) => self.late_at.min(deadline),
            None => deadline,
        }
    }

    /// Some bytes have come.
    #[expect(clippy::cast_precision_loss, reason = "time bought, not bytes counted")]
    pub(in crate::api) fn came(&mut self, bytes: usize) {
        let Some(least) = self.least_bytes_per_second else {
            return;
        };
        let bought = (bytes as f64 / least.get() as f64).min(PATIENCE.as_secs_f64());
        let longest = Instant::now() + PATIENCE;
        self.late_at = (self.late_at + Duration::from_secs_f64(bought)).min(longest);
    }
}
