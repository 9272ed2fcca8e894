//! The thread that talks to a bucket: callers wait for it without a runtime of their own, and none
//! of the runtime that serves requests is blocked.

use std::{io, sync::mpsc::sync_channel};

use tokio::runtime::{Builder, Runtime};

/// A runtime of one named thread.
#[derive(Debug)]
pub(super) struct Background {
    /// There until the end.
    runtime: Option<Runtime>,
}

impl Background {
    /// Starts the thread.
    ///
    /// # Errors
    /// Returns an error if the operating system gives no thread.
    pub(super) fn start(name: &str) -> io::Result<Self> {
        let runtime = Builder::new_multi_thread()
            .worker_threads(1)
            .thread_name(name)
            .enable_all()
            .build()?;
        let runtime = Some(runtime);
        Ok(Self { runtime })
    }

    /// Does `work` and waits for its outcome; `None` when it panicked. Blocks.
    pub(super) fn wait<T: Send + 'static>(
        &self,
        work: impl Future<Output = T> + Send + 'static,
    ) -> Option<T> {
        let (done, outcome) = sync_channel(1);
        self.runtime.as_ref()?.spawn(async move {
            // The caller waits until it comes.
            let _ = done.send(work.await);
        });
        outcome.recv().ok()
    }
}

impl Drop for Background {
    fn drop(&mut self) {
        // An ordinary drop waits for the thread, and panics where that is not allowed.
        if let Some(runtime) = self.runtime.take() {
            runtime.shutdown_background();
        }
    }
}
