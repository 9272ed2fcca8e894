//! Reports on their way to Redis. Whoever has found something puts it here and goes on; of too many,
//! the oldest are dropped.

use std::{
    collections::VecDeque,
    sync::{Mutex, MutexGuard, PoisonError},
};

use tokio::sync::Notify;

use crate::results::{NewPicture, NewReport};

/// What may wait: minutes of a few cameras.
const MOST_REPORTS: usize = 1000;
const MOST_BYTES: usize = 32 << 20;

/// A report, perhaps with its picture.
#[derive(Debug)]
pub(super) struct Parcel {
    pub(super) report: NewReport,
    pub(super) picture: Option<NewPicture>,
}

/// Reports that wait, oldest first.
#[derive(Debug, Default)]
pub(super) struct Outbox {
    waiting: Mutex<Waiting>,
    changed: Notify,
}

#[derive(Debug, Default)]
struct Waiting {
    parcels: VecDeque<Parcel>,
    bytes: usize,
    /// Whether one was taken and is not done with.
    one_is_taken: bool,
    dropped: u64,
}

impl Outbox {
    /// Puts a report behind the others. Never waits.
    pub(super) fn push(&self, report: NewReport, picture: Option<NewPicture>) {
        let parcel = Parcel { report, picture };
        let mut waiting = self.waiting();
        waiting.drop_picture_of(&parcel.report.camera);
        waiting.bytes += parcel.bytes();
        waiting.parcels.push_back(parcel);
        while waiting.parcels.len() > MOST_REPORTS || waiting.bytes > MOST_BYTES {
            waiting.take_first();
            waiting.dropped += 1;
        }
        drop(waiting);
        self.changed.notify_waiters();
    }

    /// Takes the first report, when there is one; [`Outbox::done`] says when it is done with.
    pub(super) async fn first(&self) -> Parcel {
        loop {
            let changed = self.changed.notified();
            tokio::pin!(changed);
            // Listens before it looks: nothing is missed in between.
            changed.as_mut().enable();
            if let Some(first) = self.take() {
                return first;
            }
            changed.await;
        }
    }

    /// The report that was taken is where it belongs, or was `refused` for ever.
    pub(super) fn done(&self, refused: bool) {
        let mut waiting = self.waiting();
        waiting.one_is_taken = false;
        waiting.dropped += u64::from(refused);
        drop(waiting);
        self.changed.notify_waiters();
    }

    /// Waits until nothing waits.
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

    /// How many are not done with.
    pub(super) fn count(&self) -> usize {
        let waiting = self.waiting();
        waiting.parcels.len() + usize::from(waiting.one_is_taken)
    }

    /// How many were dropped or refused.
    pub(super) fn dropped(&self) -> u64 {
        self.waiting().dropped
    }

    fn take(&self) -> Option<Parcel> {
        let mut waiting = self.waiting();
        let first = waiting.take_first()?;
        waiting.one_is_taken = true;
        Some(first)
    }

    fn waiting(&self) -> MutexGuard<'_, Waiting> {
        // No change can panic half-way.
        self.waiting.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Parcel {
    fn bytes(&self) -> usize {
        self.report.bytes() + self.picture.as_ref().map_or(0, NewPicture::bytes)
    }
}

impl Waiting {
    /// A picture that another follows is of no use any more.
    fn drop_picture_of(&mut self, camera: &str) {
        let mut own = self.parcels.iter_mut().rev();
        let last = own.find(|parcel| parcel.report.camera == camera);
        if let Some(picture) = last.and_then(|parcel| parcel.picture.take()) {
            self.bytes -= picture.bytes();
        }
    }

    fn take_first(&mut self) -> Option<Parcel> {
        let first = self.parcels.pop_front()?;
        self.bytes -= first.bytes();
        Some(first)
    }
}

#[cfg(test)]
mod tests {
    use bytes::Bytes;
    use jiff::Timestamp;

    use super::*;

    fn report(persons: usize, length: usize) -> NewReport {
        NewReport {
            camera: "lobby".to_owned(),
            received_at: Timestamp::UNIX_EPOCH,
            persons,
            json: Bytes::from(vec![b' '; length]),
        }
    }

    #[tokio::test]
    async fn reports_leave_in_the_order_in_which_they_came() {
        let outbox = Outbox::default();
        let (taken, ()) = tokio::join!(
            async {
                [outbox.first().await, outbox.first().await].map(|parcel| parcel.report.persons)
            },
            async {
                outbox.push(report(1, 1), None);
                outbox.push(report(2, 1), None);
            }
        );
        assert_eq!(taken, [1, 2]);
    }

    #[tokio::test]
    async fn of_too_many_reports_the_oldest_are_dropped_and_counted() {
        for length in [1, MOST_BYTES / 10] {
            let outbox = Outbox::default();
            for number in 0..2 * MOST_REPORTS {
                outbox.push(report(number, length), None);
            }
            let kept = outbox.count();
            assert!((1..=MOST_REPORTS).contains(&kept), "{kept}");
            assert!(kept * length <= MOST_BYTES);
            assert_eq!(outbox.dropped(), (2 * MOST_REPORTS - kept) as u64);
            assert_eq!(outbox.first().await.report.persons, 2 * MOST_REPORTS - kept);
        }
    }

    #[tokio::test]
    async fn it_is_empty_when_the_last_report_is_done_with() {
        let outbox = Outbox::default();
        outbox.is_empty().await;
        outbox.push(report(1, 1), None);
        tokio::join!(outbox.is_empty(), async {
            outbox.first().await;
            assert_eq!(outbox.count(), 1);
            outbox.done(true);
        });
        assert_eq!((outbox.count(), outbox.dropped()), (0, 1));
    }

    #[tokio::test]
    async fn of_a_camera_only_the_latest_picture_waits() {
        let outbox = Outbox::default();
        let picture = |length| NewPicture {
            frame: Bytes::from(vec![0; length]),
            sketch: Bytes::new(),
        };
        for number in 1..=9 {
            outbox.push(report(number, 1), Some(picture(MOST_BYTES / 2)));
        }
        assert_eq!((outbox.count(), outbox.dropped()), (9, 0));
        for number in 1..=9 {
            let parcel = outbox.first().await;
            assert_eq!(parcel.report.persons, number);
            assert_eq!(parcel.picture.is_some(), number == 9);
        }
    }
}
