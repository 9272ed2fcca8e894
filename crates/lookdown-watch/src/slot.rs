//! A place for one value, in which the newest value replaces the one before.

use std::sync::atomic::{AtomicBool, Ordering};

use parking_lot::Mutex;
use tokio::sync::Notify;

/// A slot for the newest value. It holds one value at most, so a slow reader skips old values and
/// never delays the writer.
#[derive(Debug)]
pub(crate) struct Slot<T> {
    value: Mutex<Option<T>>,
    is_closed: AtomicBool,
    changed: Notify,
}

impl<T> Default for Slot<T> {
    fn default() -> Self {
        Self {
            value: Mutex::default(),
            is_closed: AtomicBool::default(),
            changed: Notify::new(),
        }
    }
}

impl<T> Slot<T> {
    /// Stores a value. Returns the value that it replaces.
    pub(crate) fn put(&self, value: T) -> Option<T> {
        let replaced = self.value.lock().replace(value);
        self.changed.notify_one();
        replaced
    }

    /// Drops the value.
    pub(crate) fn clear(&self) {
        *self.value.lock() = None;
    }

    /// Announces that no value follows.
    pub(crate) fn close(&self) {
        self.is_closed.store(true, Ordering::Release);
        self.changed.notify_one();
    }

    /// Waits for a value and removes it. `None` if the slot is empty and closed. There is one
    /// reader at most.
    pub(crate) async fn take(&self) -> Option<T> {
        loop {
            let changed = self.changed.notified();
            // Read before the value: no value follows then.
            let is_closed = self.is_closed.load(Ordering::Acquire);
            let value = self.value.lock().take();
            if value.is_some() || is_closed {
                return value;
            }
            changed.await;
        }
    }
}

#[cfg(test)]
mod tests {
    use std::{sync::Arc, time::Duration};

    use super::*;

    #[tokio::test]
    async fn the_newest_value_replaces_the_one_before() {
        let slot = Slot::default();
        assert_eq!(slot.put(1), None);
        assert_eq!(slot.put(2), Some(1));
        assert_eq!(slot.take().await, Some(2));
    }

    #[tokio::test]
    async fn a_reader_waits_for_the_next_value() {
        let slot = Arc::new(Slot::default());
        let reader = tokio::spawn({
            let slot = Arc::clone(&slot);
            async move { slot.take().await }
        });
        tokio::time::sleep(Duration::from_millis(5)).await;
        slot.put(7);
        assert_eq!(reader.await.unwrap(), Some(7));
    }

    #[tokio::test]
    async fn a_closed_slot_still_returns_its_last_value() {
        let slot = Slot::default();
        slot.put(3);
        slot.close();
        assert_eq!(slot.take().await, Some(3));
        assert_eq!(slot.take().await, None);
    }
}
