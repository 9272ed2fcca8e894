//! The request to stop: it is announced, then the server drains. A second request ends it at once.

use std::io;

use tokio::{
    signal::unix::{SignalKind, signal},
    sync::watch,
};

/// The stage of the shutdown.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Stage {
    /// No stop was requested.
    Running,
    /// The stop is announced, and requests are still served.
    Announced,
    /// Requests in flight are finished, and no new ones are accepted.
    Draining,
    /// Requests in flight are aborted.
    AtOnce,
}

/// Passes the request to stop to all components. Clones share it.
#[derive(Debug, Clone)]
pub struct Shutdown(watch::Sender<Stage>);

impl Default for Shutdown {
    fn default() -> Self {
        Self(watch::Sender::new(Stage::Running))
    }
}

impl Shutdown {
    /// Creates a shutdown that SIGTERM and SIGINT request, the latter without a grace period. From
    /// now on these signals no longer end the process by themselves, and SIGUSR1 and SIGUSR2 have
    /// no effect. Needs a tokio runtime.
    ///
    /// # Errors
    /// If the operating system refuses a handler.
    pub fn on_signals() -> io::Result<Self> {
        let shutdown = Self::default();
        let mut terminate = signal(SignalKind::terminate())?;
        let mut interrupt = signal(SignalKind::interrupt())?;
        // A handler stays for the life of the process: without one these signals would end it at
        // once.
        drop(signal(SignalKind::user_defined1())?);
        drop(signal(SignalKind::user_defined2())?);
        let asked = shutdown.clone();
        tokio::spawn(async move {
            while asked.stage() < Stage::AtOnce {
                tokio::select! {
                    _ = terminate.recv() => asked.request(),
                    _ = interrupt.recv() => asked.request_without_pause(),
                }
            }
        });
        Ok(shutdown)
    }

    /// Requests a graceful shutdown. A second request ends the server at once.
    pub fn request(&self) {
        self.ask_for(Stage::Announced);
    }

    /// Requests a graceful shutdown without a grace period.
    pub fn request_without_pause(&self) {
        self.ask_for(Stage::Draining);
    }

    fn ask_for(&self, stage: Stage) {
        self.0.send_modify(|now| {
            *now = match now {
                Stage::Running => stage,
                _ => Stage::AtOnce,
            }
        });
    }

    /// Requests of another shutdown what was requested of this one.
    pub fn pass_on(&self, to: &Self) {
        let stage = self.stage();
        to.0.send_modify(|now| *now = (*now).max(stage));
    }

    /// Ends the grace period.
    pub fn drain(&self) {
        self.0.send_modify(|now| *now = (*now).max(Stage::Draining));
    }

    fn stage(&self) -> Stage {
        *self.0.borrow()
    }

    /// Returns true if a stop was requested.
    pub fn is_requested(&self) -> bool {
        self.stage() >= Stage::Announced
    }

    /// Waits until a stop is requested.
    pub async fn requested(&self) {
        self.reached(Stage::Announced).await;
    }

    /// Waits until the server drains.
    pub async fn draining(&self) {
        self.reached(Stage::Draining).await;
    }

    /// Waits until an immediate stop is requested.
    pub async fn requested_at_once(&self) {
        self.reached(Stage::AtOnce).await;
    }

    async fn reached(&self, stage: Stage) {
        // The sender is `self`, so the channel cannot close during the wait.
        let _ = self.0.subscribe().wait_for(|now| *now >= stage).await;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stop_is_announced_then_drained_then_immediate() {
        let shutdown = Shutdown::default();
        assert!(!shutdown.is_requested());
        shutdown.request();
        assert_eq!(shutdown.stage(), Stage::Announced);
        shutdown.drain();
        assert_eq!(shutdown.stage(), Stage::Draining);
        shutdown.request();
        assert_eq!(shutdown.stage(), Stage::AtOnce);
        shutdown.drain();
        assert_eq!(shutdown.stage(), Stage::AtOnce);
    }

    #[test]
    fn interrupt_skips_the_grace_period_and_a_second_ends_at_once() {
        let shutdown = Shutdown::default();
        shutdown.request_without_pause();
        assert_eq!(shutdown.stage(), Stage::Draining);
        shutdown.request_without_pause();
        assert_eq!(shutdown.stage(), Stage::AtOnce);
    }
}
