//! The cameras of a process: each is a task of its own, started and stopped as the settings change.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::{collections::HashMap, future::Future, sync::Arc, task::Poll, time::Duration};

use tokio::{task::JoinHandle, time::timeout};
use tracing::Instrument as _;

use crate::{
    Camera, Metrics, WatchOptions, metrics::CameraMetrics, sender, server::Server, slot::Slot,
    source,
};
use lookdown_common::{ClientError, ConfigError, HttpClient, LogOnce, Reload};

/// Longest time that the end waits for the reports of frames that were sent.
const LAST_REPORTS: Duration = Duration::from_secs(5);

/// The origin of the settings.
#[derive(Clone)]
pub enum Origin {
    /// Settings that are read again when they change.
    Reload(Reload<WatchOptions>),
    /// Settings that do not change.
    Fixed(WatchOptions),
}

/// The reason why cameras are not watched.
#[derive(Debug, thiserror::Error)]
pub enum WatchError {
    /// A setting that cannot be used.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// No HTTP client.
    #[error(transparent)]
    Client(#[from] ClientError),
    /// The metrics cannot be created.
    #[error("the metrics cannot be created: {0}")]
    Metrics(#[from] prometheus::Error),
    /// No frame of a finite source was processed.
    #[error("{0}: no frame was processed: the log has the reason")]
    NoFrame(String),
}

/// Watches cameras until `stop` ends, or until the sources of fixed settings end.
///
/// # Errors
/// [`WatchError`].
pub async fn watch(
    origin: Origin,
    metrics: Arc<Metrics>,
    stop: impl Future<Output = ()>,
) -> Result<(), WatchError> {
    let options = match &origin {
        Origin::Reload(settings) => settings.load().await?,
        Origin::Fixed(options) => options.clone(),
    };
    let mut watcher = Watcher::new(options, metrics)?;
    let outcome = tokio::select! {
        () = stop => Ok(()),
        outcome = watcher.run(&origin) => outcome,
    };
    watcher.end().await;
    outcome
}

/// The running cameras.
struct Watcher {
    options: WatchOptions,
    server: Arc<Server>,
    client: HttpClient,
    metrics: Arc<Metrics>,
    running: HashMap<String, Running>,
}

/// A running camera.
struct Running {
    /// Fills the slot. Closes it when its source ends.
    source: JoinHandle<()>,
    /// Empties the slot.
    sender: JoinHandle<()>,
    slot: Arc<Slot<crate::Frame>>,
    metrics: Arc<CameraMetrics>,
}

impl Watcher {
    fn new(options: WatchOptions, metrics: Arc<Metrics>) -> Result<Self, WatchError> {
        let server = Arc::new(Server::new(&options.server)?);
        let mut watcher = Self {
            server,
            client: HttpClient::new(None)?,
            metrics,
            running: HashMap::new(),
            options,
        };
        for camera in watcher.options.cameras.clone() {
            watcher.start(camera);
        }
        Ok(watcher)
    }

    fn start(&mut self, camera: Camera) {
        let metrics = self.metrics.add(&camera.name, camera.location.to_string());
        let slot = Arc::new(Slot::default());
        let span = tracing::info_span!("camera", camera = camera.name);
        let follow = camera.parameter("follow");
        span.in_scope(|| tracing::info!(follow, "watching {}", camera.location));
        let count = self.options.cameras.len();
        let most_pixel_bytes = self.server.most_pixel_bytes(&camera.name, count);
        let (name, camera) = (camera.name.clone(), Arc::new(camera));
        let source = tokio::spawn({
            let (camera, client) = (Arc::clone(&camera), self.client.clone());
            let (slot, metrics) = (Arc::clone(&slot), Arc::clone(&metrics));
            async move {
                let run =
                    || source::supervise(&camera, &client, (&slot, most_pixel_bytes), &metrics);
                run_again(camera.location.is_finite(), run).await;
                slot.close();
            }
            .instrument(span.clone())
        });
        let sender = tokio::spawn({
            let (server, slot) = (Arc::clone(&self.server), Arc::clone(&slot));
            let metrics = Arc::clone(&metrics);
            async move {
                run_again(false, || sender::run(&camera, &server, &slot, &metrics)).await;
            }
            .instrument(span)
        });
        let running = Running {
            source,
            sender,
            slot,
            metrics,
        };
        self.running.insert(name, running);
    }

    /// Stops a camera at once.
    fn stop(&mut self, name: &str) {
        if let Some(running) = self.running.remove(name) {
            running.source.abort();
            running.sender.abort();
            self.metrics.remove(name);
            tracing::info!(camera = name, "no longer watching");
        }
    }

    async fn run(&mut self, origin: &Origin) -> Result<(), WatchError> {
        let Origin::Reload(settings) = origin else {
            return self.finish().await;
        };
        let mut log = LogOnce::default();
        loop {
            let options = settings.changed(&self.options).await;
            match self.change(options) {
                Ok(()) => drop(log.clear()),
                Err(problem) if log.should_log(&problem.to_string()) => {
                    tracing::warn!("{problem}; the last valid settings stay in use");
                }
                Err(_) => {}
            }
        }
    }

    /// Waits for the end of all sources.
    async fn finish(&mut self) -> Result<(), WatchError> {
        for (name, running) in &mut self.running {
            let _ = (&mut running.sender).await;
            if running.metrics.sent.get() == 0 {
                return Err(WatchError::NoFrame(name.clone()));
            }
        }
        Ok(())
    }

    /// Applies new settings. Cameras that are unchanged keep running.
    fn change(&mut self, options: WatchOptions) -> Result<(), ClientError> {
        let is_same_server = options.server == self.options.server;
        if !is_same_server {
            self.server = Arc::new(Server::new(&options.server)?);
        }
        let before = std::mem::replace(&mut self.options, options);
        let kept = |camera: &Camera, others: &[Camera]| is_same_server && others.contains(camera);
        for camera in &before.cameras {
            if !kept(camera, &self.options.cameras) {
                self.stop(&camera.name);
            }
        }
        for camera in self.options.cameras.clone() {
            if !kept(&camera, &before.cameras) {
                self.start(camera);
            }
        }
        Ok(())
    }

    /// Stops all sources, and waits for the reports of the frames that were sent.
    async fn end(&mut self) {
        for running in self.running.values() {
            running.source.abort();
            running.slot.clear();
            running.slot.close();
        }
        let reports = async {
            for running in self.running.values_mut() {
                if !running.sender.is_finished() {
                    let _ = (&mut running.sender).await;
                }
            }
        };
        if timeout(LAST_REPORTS, reports).await.is_err() {
            tracing::warn!("stopped before the last reports arrived");
        }
        for running in self.running.values() {
            running.sender.abort();
        }
    }
}

/// Runs a task of a camera again a second after a panic, which the panic hook logs. One with an end
/// is not begun again.
async fn run_again<F: Future<Output = ()>>(is_finite: bool, task: impl Fn() -> F) {
    loop {
        let mut run = std::pin::pin!(task());
        let has_ended = std::future::poll_fn(|context| {
            let poll = catch_unwind(AssertUnwindSafe(|| run.as_mut().poll(context)));
            poll.map_or(Poll::Ready(is_finite), |poll| poll.map(|()| true))
        });
        if has_ended.await {
            return;
        }
        tokio::time::sleep(Duration::from_secs(1)).await;
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicU32, Ordering};

    use super::*;

    #[tokio::test(start_paused = true)]
    async fn a_task_that_panics_runs_again() {
        let runs = AtomicU32::new(0);
        let task = || async {
            tokio::task::yield_now().await;
            assert!(runs.fetch_add(1, Ordering::Relaxed) > 0, "a fault");
        };
        run_again(true, task).await;
        assert_eq!(runs.load(Ordering::Relaxed), 1);
        runs.store(0, Ordering::Relaxed);
        run_again(false, task).await;
        assert_eq!(runs.load(Ordering::Relaxed), 2);
    }
}
