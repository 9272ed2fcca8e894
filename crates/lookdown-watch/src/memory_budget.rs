//! The memory for frames of all cameras of this process together.
//!
//! A camera may hold a few large frames: one that is being received, one that waits, one that is
//! being sent. A thousand hostile ones must not add up, so all frames count against one budget. A
//! camera with small frames is served however much the others hold.

use std::sync::atomic::{AtomicUsize, Ordering};

use bytes::Bytes;

/// Most bytes of all frames, beside those of small ones.
const MAX_BYTES: usize = 512 << 20;
/// Most bytes that a reservation may have however much the others hold.
const SMALL_BYTES: usize = 1 << 20;

/// Returns the most bytes of a frame with which all of so many cameras fit into the budget: one
/// frame that is received, one that waits, one that is sent, and one whose memory is used again.
pub(crate) const fn frame_bytes(cameras: usize) -> usize {
    MAX_BYTES / (4 * cameras)
}

static BUDGET: MemoryBudget = MemoryBudget::new(MAX_BYTES);

/// The sum of all reservations.
#[derive(Debug)]
struct MemoryBudget {
    most: usize,
    used: AtomicUsize,
}

/// The budget is exhausted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Exhausted;

/// Reserved bytes, which are released with it.
#[derive(Debug)]
pub(crate) struct Reservation {
    budget: &'static MemoryBudget,
    bytes: usize,
}

impl MemoryBudget {
    const fn new(most: usize) -> Self {
        Self {
            most,
            used: AtomicUsize::new(0),
        }
    }
}

impl Default for Reservation {
    fn default() -> Self {
        Self {
            budget: &BUDGET,
            bytes: 0,
        }
    }
}

/// Bytes with their reservation.
struct Reserved {
    bytes: Bytes,
    _memory: Reservation,
}

impl AsRef<[u8]> for Reserved {
    fn as_ref(&self) -> &[u8] {
        &self.bytes
    }
}

impl Reservation {
    /// Returns the bytes with this reservation. It is released with their last clone, as a
    /// connection may still send a frame whose response has arrived.
    ///
    /// # Errors
    /// [`Exhausted`].
    pub(crate) fn hold(mut self, bytes: Bytes) -> Result<Bytes, Exhausted> {
        self.resize(bytes.len())?;
        Ok(Bytes::from_owner(Reserved {
            bytes,
            _memory: self,
        }))
    }

    /// Changes the number of bytes.
    ///
    /// # Errors
    /// [`Exhausted`]: the number is unchanged.
    pub(crate) fn resize(&mut self, bytes: usize) -> Result<(), Exhausted> {
        if let Some(more) = bytes.checked_sub(self.bytes) {
            let used = self.budget.used.fetch_add(more, Ordering::Relaxed) + more;
            if used > self.budget.most && bytes > SMALL_BYTES {
                self.budget.used.fetch_sub(more, Ordering::Relaxed);
                return Err(Exhausted);
            }
        } else {
            let less = self.bytes - bytes;
            self.budget.used.fetch_sub(less, Ordering::Relaxed);
        }
        self.bytes = bytes;
        Ok(())
    }
}

impl Drop for Reservation {
    fn drop(&mut self) {
        self.budget.used.fetch_sub(self.bytes, Ordering::Relaxed);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    static SMALL: MemoryBudget = MemoryBudget::new(4 << 20);

    fn reservation() -> Reservation {
        Reservation {
            budget: &SMALL,
            bytes: 0,
        }
    }

    #[test]
    fn small_frames_fit_beside_large_ones() {
        let mut large = reservation();
        large.resize(4 << 20).unwrap();
        let mut other = reservation();
        assert_eq!(other.resize(2 << 20), Err(Exhausted));
        other.resize(1 << 20).unwrap();
        drop(large);
        other.resize(2 << 20).unwrap();
        other.resize(0).unwrap();
        assert_eq!(SMALL.used.load(Ordering::Relaxed), 0);
    }

    #[test]
    fn a_frame_counts_until_its_last_clone_is_dropped() {
        static BUDGET: MemoryBudget = MemoryBudget::new(4 << 20);
        let reservation = Reservation {
            budget: &BUDGET,
            bytes: 0,
        };
        let frame = reservation.hold(Bytes::from(vec![1; 3 << 20])).unwrap();
        let sent = frame.clone();
        drop(frame);
        assert_eq!(BUDGET.used.load(Ordering::Relaxed), sent.len());
        drop(sent);
        assert_eq!(BUDGET.used.load(Ordering::Relaxed), 0);
    }
}
