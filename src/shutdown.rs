//! Being told to stop: once for an orderly end, twice for an end at once.

use std::io;

use tokio::signal::unix::{SignalKind, signal};
use tokio_util::sync::CancellationToken;

/// Carries the request to stop to whoever must know. Clones share it.
#[derive(Debug, Clone, Default)]
pub struct Shutdown {
    orderly: CancellationToken,
    at_once: CancellationToken,
}

impl Shutdown {
    /// A shutdown that SIGTERM and SIGINT ask for; from here on they no longer end the process by
    /// themselves. Needs a tokio runtime.
    ///
    /// # Errors
    /// When the operating system refuses a handler.
    pub fn on_signals() -> io::Result<Self> {
        let shutdown = Self::default();
        let mut terminate = signal(SignalKind::terminate())?;
        let mut interrupt = signal(SignalKind::interrupt())?;
        let asked = shutdown.clone();
        tokio::spawn(async move {
            while !asked.at_once.is_cancelled() {
                tokio::select! {
                    _ = terminate.recv() => {}
                    _ = interrupt.recv() => {}
                }
                asked.request();
            }
        });
        Ok(shutdown)
    }

    /// Asks for an orderly end, and when that was asked for already, for an end at once.
    pub fn request(&self) {
        if self.orderly.is_cancelled() {
            self.at_once.cancel();
        }
        self.orderly.cancel();
    }

    /// Waits until an end was asked for.
    pub async fn requested(&self) {
        self.orderly.cancelled().await;
    }

    /// Waits until an end at once was asked for.
    pub async fn requested_at_once(&self) {
        self.at_once.cancelled().await;
    }
}
