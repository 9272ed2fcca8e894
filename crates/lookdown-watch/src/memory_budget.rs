//! The memory for frames of all cameras of this process together.
//!
//! A camera may hold a few large frames: one that is being received, one that waits, one that is
//! being sent. A thousand hostile ones must not add up, so all frames count against one budget. A
//! camera with small frames is served however much the others hold.

use std::sync::{
    Arc,
    atomic::{AtomicUsize, Ordering},
};

/// Most bytes of all frames, beside those of small ones.
const MAX_BYTES: usize = 512 << 20;
/// Most bytes that a reservation may have however much the others hold.
const SMALL_BYTES: usize = 1 << 20;

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

impl Reservation {
    /// Reserves this many bytes for a frame, which may be shared.
    ///
    /// # Errors
    /// [`Exhausted`].
    pub(crate) fn of(bytes: usize) -> Result<Arc<Self>, Exhausted> {
        let mut reservation = Self::default();
        reservation.resize(bytes)?;
        Ok(Arc::new(reservation))
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
}
