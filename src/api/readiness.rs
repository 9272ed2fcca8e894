//! The phase of the server's life: warming up, ready or stopping.

use tokio::sync::watch;

/// The phase of the server's life.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Phase {
    /// The models have not run yet.
    WarmingUp,
    /// The server accepts frames.
    Ready,
    /// The server is shutting down and finishes the requests that have arrived.
    Stopping,
}

/// The current [`Phase`]. Clones share it.
#[derive(Debug, Clone)]
pub struct Readiness(watch::Sender<Phase>);

impl Default for Readiness {
    fn default() -> Self {
        Self(watch::Sender::new(Phase::WarmingUp))
    }
}

impl Readiness {
    /// Marks the end of the warm-up. A server that is already stopping stays in that phase.
    pub fn warmed_up(&self) {
        self.0.send_if_modified(|phase| {
            let warming_up = *phase == Phase::WarmingUp;
            if warming_up {
                *phase = Phase::Ready;
            }
            warming_up
        });
    }

    /// Marks the beginning of the shutdown.
    pub fn stopping(&self) {
        self.0.send_replace(Phase::Stopping);
    }

    /// Returns the current phase.
    pub fn phase(&self) -> Phase {
        *self.0.borrow()
    }

    /// Waits for the end of the warm-up.
    pub async fn ready(&self) {
        // `self` holds the sender, so the channel stays open.
        let _ = self
            .0
            .subscribe()
            .wait_for(|phase| *phase != Phase::WarmingUp)
            .await;
    }
}
