//! Being told to stop: announced, then drained; a second time, at once.

use std::io;

use tokio::{
    signal::unix::{SignalKind, signal},
    sync::watch,
};

/// How far the end has come.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Stage {
    /// Nobody asked for it.
    Running,
    /// It is announced, and everything is still served.
    Announced,
    /// What is in flight is finished, and nothing new begun.
    Draining,
    /// Nothing is finished any more.
    AtOnce,
}

/// Carries the request to stop to whoever must know. Clones share it.
#[derive(Debug, Clone)]
pub struct Shutdown(watch::Sender<Stage>);

impl Default for Shutdown {
    fn default() -> Self {
        Self(watch::Sender::new(Stage::Running))
    }
}

impl Shutdown {
    /// A shutdown that SIGTERM and SIGINT ask for, the latter without a pause; from here on they no
    /// longer end the process by themselves. Needs a tokio runtime.
    ///
    /// # Errors
    /// When the operating system refuses a handler.
    pub fn on_signals() -> io::Result<Self> {
        let shutdown = Self::default();
        let mut terminate = signal(SignalKind::terminate())?;
        let mut interrupt = signal(SignalKind::interrupt())?;
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

    /// Asks for an orderly end, and when one was asked for already, for an end at once.
    pub fn request(&self) {
        self.ask_for(Stage::Announced);
    }

    /// The same, with nobody to whom the end must be announced first.
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

    /// The end was announced long enough.
    pub fn drain(&self) {
        self.0.send_modify(|now| *now = (*now).max(Stage::Draining));
    }

    fn stage(&self) -> Stage {
        *self.0.borrow()
    }

    /// Whether an end was asked for.
    #[must_use]
    pub fn is_requested(&self) -> bool {
        self.stage() >= Stage::Announced
    }

    /// Waits until an end was asked for.
    pub async fn requested(&self) {
        self.reached(Stage::Announced).await;
    }

    /// Waits until nothing new is to be begun.
    pub async fn draining(&self) {
        self.reached(Stage::Draining).await;
    }

    /// Waits until an end at once was asked for.
    pub async fn requested_at_once(&self) {
        self.reached(Stage::AtOnce).await;
    }

    async fn reached(&self, stage: Stage) {
        // The sender is `self`, so the channel cannot close meanwhile.
        let _ = self.0.subscribe().wait_for(|now| *now >= stage).await;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_end_is_announced_then_drained_and_at_the_second_request_at_once() {
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
    fn whoever_waits_in_person_gets_no_pause_and_the_second_time_no_patience() {
        let shutdown = Shutdown::default();
        shutdown.request_without_pause();
        assert_eq!(shutdown.stage(), Stage::Draining);
        shutdown.request_without_pause();
        assert_eq!(shutdown.stage(), Stage::AtOnce);
    }
}
