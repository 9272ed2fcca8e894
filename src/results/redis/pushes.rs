//! A bounded queue of the messages that Redis pushes. A queue that overflows ends, and with it the
//! connection: the next one reads from the streams what it has missed.

use std::sync::Arc;

use parking_lot::Mutex;
use redis::{PushInfo, PushKind, Value};
use tokio::sync::{Notify, OwnedSemaphorePermit, Semaphore, mpsc};

/// Most bytes of the messages that wait, beside those of the largest report.
const MOST_BYTES: usize = 16 << 20;
/// Memory of a message in addition to its payload.
const MESSAGE_BYTES: usize = 1 << 10;

/// A message, and its share of the queue's memory.
type Waiting = (PushInfo, OwnedSemaphorePermit);

/// The receiving end of the queue.
pub(super) struct Pushes {
    messages: mpsc::Receiver<Waiting>,
    ended: Arc<Notify>,
}

/// Creates a queue: a function that accepts messages without waiting, and the receiving end.
pub(super) fn queue() -> (
    impl Fn(PushInfo) -> Result<(), ()> + Send + Sync + 'static,
    Pushes,
) {
    let (sender, messages) = mpsc::channel::<Waiting>(MOST_BYTES / MESSAGE_BYTES);
    let sender = Mutex::new(Some(sender));
    let bytes = Arc::new(Semaphore::new(MOST_BYTES));
    let ended = Arc::new(Notify::new());
    let pushes = Pushes {
        messages,
        ended: Arc::clone(&ended),
    };
    let accept = move |push: PushInfo| {
        let mut sender = sender.lock();
        let is_over = push.kind == PushKind::Disconnection;
        let size = u32::try_from(bytes_of(&push)).unwrap_or(u32::MAX);
        let share = Arc::clone(&bytes).try_acquire_many_owned(size);
        match (&*sender, share) {
            (Some(open), Ok(share)) if !is_over => open.try_send((push, share)).map_err(|_| ()),
            _ => {
                *sender = None;
                ended.notify_one();
                Err(())
            }
        }
    };
    (accept, pushes)
}

impl Pushes {
    /// The end of the connection or of the queue, at once, also while messages wait.
    pub(super) fn ended(&self) -> Arc<Notify> {
        Arc::clone(&self.ended)
    }

    /// Returns the next message. `None` when the connection or the queue has ended.
    pub(super) async fn next(&mut self) -> Option<PushInfo> {
        let (push, _) = self.messages.recv().await?;
        Some(push)
    }

    /// Returns the next message if it has arrived already.
    pub(super) fn waiting(&mut self) -> Option<PushInfo> {
        let (push, _) = self.messages.try_recv().ok()?;
        Some(push)
    }
}

fn bytes_of(push: &PushInfo) -> usize {
    let parts = push.data.iter().map(|part| match part {
        Value::BulkString(bytes) => bytes.len(),
        _ => 0,
    });
    MESSAGE_BYTES + parts.sum::<usize>()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn message(length: usize) -> PushInfo {
        PushInfo {
            kind: PushKind::SMessage,
            data: vec![Value::BulkString(vec![b'x'; length])],
        }
    }

    #[tokio::test]
    async fn messages_are_received_in_order_until_it_overflows() {
        let (accept, mut pushes) = queue();
        for length in 0..1000 {
            accept(message(length)).unwrap();
            assert_eq!(pushes.next().await, Some(message(length)));
        }
        let accepted = (0..MOST_BYTES).take_while(|_| accept(message(9000)).is_ok());
        let accepted = accepted.count();
        assert!((1..=MOST_BYTES / 9000).contains(&accepted), "{accepted}");
        for _ in 0..accepted {
            assert_eq!(pushes.next().await, Some(message(9000)));
        }
        assert_eq!(pushes.next().await, None);
    }

    #[tokio::test]
    async fn a_lost_connection_ends_the_queue() {
        let (accept, mut pushes) = queue();
        accept(message(1)).unwrap();
        let disconnection = PushInfo {
            kind: PushKind::Disconnection,
            data: Vec::new(),
        };
        accept(disconnection).unwrap_err();
        assert!(pushes.next().await.is_some());
        assert!(pushes.next().await.is_none());
    }
}
