//! A bounded queue of reports for Redis. Publishing never waits. When the queue is full, the oldest
//! reports are dropped.

use std::collections::VecDeque;

use parking_lot::Mutex;
use tokio::sync::Notify;

use crate::{annotated_image::StoredFrame, metrics::IntCounter, results::NewReport};

/// Most reports that wait: minutes of a few cameras.
const MOST_REPORTS: usize = 1000;
const MOST_BYTES: usize = 32 << 20;

/// A report, possibly with its image.
#[derive(Debug)]
pub(super) struct PendingReport {
    pub(super) report: NewReport,
    pub(super) image: Option<StoredFrame>,
}

/// The queue, oldest first.
#[derive(Debug)]
pub(super) struct Outbox {
    // No change can panic before it is complete.
    waiting: Mutex<Waiting>,
    changed: Notify,
    /// Reports that were dropped or refused.
    dropped: IntCounter,
}

#[derive(Debug, Default)]
struct Waiting {
    reports: VecDeque<PendingReport>,
    bytes: usize,
    /// True while a report was taken and is not done.
    one_is_taken: bool,
}

impl Outbox {
    /// Creates an empty queue that counts dropped and refused reports in `dropped`.
    pub(super) fn new(dropped: IntCounter) -> Self {
        Self {
            waiting: Mutex::default(),
            changed: Notify::new(),
            dropped,
        }
    }

    /// Appends a report. Never waits.
    pub(super) fn push(&self, report: NewReport, image: Option<StoredFrame>) {
        let pending = PendingReport { report, image };
        let mut waiting = self.waiting.lock();
        waiting.drop_image_of(&pending.report.camera);
        waiting.bytes += pending.bytes();
        waiting.reports.push_back(pending);
        while waiting.reports.len() > MOST_REPORTS || waiting.bytes > MOST_BYTES {
            waiting.take_first();
            self.dropped.inc();
        }
        drop(waiting);
        self.changed.notify_waiters();
    }

    /// Waits for the first report and takes it. [`Outbox::done`] completes it.
    pub(super) async fn first(&self) -> PendingReport {
        loop {
            let changed = self.changed.notified();
            tokio::pin!(changed);
            // Registers for the notification before the check, so that no report is missed in
            // between.
            changed.as_mut().enable();
            if let Some(first) = self.take() {
                return first;
            }
            changed.await;
        }
    }

    /// Completes the report that was taken: it was stored, or it was `refused` permanently.
    pub(super) fn done(&self, refused: bool) {
        let mut waiting = self.waiting.lock();
        waiting.one_is_taken = false;
        drop(waiting);
        self.dropped.inc_by(u64::from(refused));
        self.changed.notify_waiters();
    }

    /// Waits until the queue is empty.
    pub(super) async fn is_empty(&self) {
        loop {
            let changed = self.changed.notified();
            tokio::pin!(changed);
            changed.as_mut().enable();
            if self.count() == 0 {
                return;
            }
            changed.await;
        }
    }

    /// The number of reports that are not done.
    pub(super) fn count(&self) -> usize {
        let waiting = self.waiting.lock();
        waiting.reports.len() + usize::from(waiting.one_is_taken)
    }

    fn take(&self) -> Option<PendingReport> {
        let mut waiting = self.waiting.lock();
        let first = waiting.take_first()?;
        waiting.one_is_taken = true;
        Some(first)
    }
}

impl PendingReport {
    fn bytes(&self) -> usize {
        self.report.bytes() + self.image.as_ref().map_or(0, StoredFrame::bytes)
    }
}

impl Waiting {
    /// Drops the camera's queued image, as a later report replaces it.
    fn drop_image_of(&mut self, camera: &str) {
        let mut own = self.reports.iter_mut().rev();
        let last = own.find(|pending| pending.report.camera == camera);
        if let Some(image) = last.and_then(|pending| pending.image.take()) {
            self.bytes -= image.bytes();
        }
    }

    fn take_first(&mut self) -> Option<PendingReport> {
        let first = self.reports.pop_front()?;
        self.bytes -= first.bytes();
        Some(first)
    }
}

#[cfg(test)]
mod tests {
    use bytes::Bytes;
    use jiff::Timestamp;

    use super::*;

    fn outbox() -> Outbox {
        Outbox::new(IntCounter::new("dropped", "Dropped reports.").unwrap())
    }

    fn report(persons: usize, length: usize) -> NewReport {
        NewReport {
            camera: "lobby".to_owned(),
            received_at: Timestamp::UNIX_EPOCH,
            persons,
            scores: None,
            json: Bytes::from(vec![b' '; length]),
        }
    }

    #[tokio::test]
    async fn reports_are_taken_in_arrival_order() {
        let outbox = outbox();
        let (taken, ()) = tokio::join!(
            async {
                [outbox.first().await, outbox.first().await].map(|pending| pending.report.persons)
            },
            async {
                outbox.push(report(1, 1), None);
                outbox.push(report(2, 1), None);
            }
        );
        assert_eq!(taken, [1, 2]);
    }

    #[tokio::test]
    async fn a_full_outbox_drops_and_counts_the_oldest_reports() {
        for length in [1, MOST_BYTES / 10] {
            let outbox = outbox();
            for number in 0..2 * MOST_REPORTS {
                outbox.push(report(number, length), None);
            }
            let kept = outbox.count();
            assert!((1..=MOST_REPORTS).contains(&kept), "{kept}");
            assert!(kept * length <= MOST_BYTES);
            assert_eq!(outbox.dropped.get(), (2 * MOST_REPORTS - kept) as u64);
            assert_eq!(outbox.first().await.report.persons, 2 * MOST_REPORTS - kept);
        }
    }

    #[tokio::test]
    async fn the_outbox_is_empty_when_the_last_report_is_done() {
        let outbox = outbox();
        outbox.is_empty().await;
        outbox.push(report(1, 1), None);
        tokio::join!(outbox.is_empty(), async {
            outbox.first().await;
            assert_eq!(outbox.count(), 1);
            outbox.done(true);
        });
        assert_eq!((outbox.count(), outbox.dropped.get()), (0, 1));
    }

    #[tokio::test]
    async fn only_the_latest_image_of_a_camera_waits() {
        let outbox = outbox();
        let image = |length| StoredFrame {
            jpeg: Bytes::from(vec![0; length]),
            sketch: Bytes::new(),
        };
        for number in 1..=9 {
            outbox.push(report(number, 1), Some(image(MOST_BYTES / 2)));
        }
        assert_eq!((outbox.count(), outbox.dropped.get()), (9, 0));
        for number in 1..=9 {
            let pending = outbox.first().await;
            assert_eq!(pending.report.persons, number);
            assert_eq!(pending.image.is_some(), number == 9);
        }
    }
}
