//! The threads that check something at an interval.
//!
//! The reload that SIGHUP requests: the files that the pollers check, at once.

use std::{
    io,
    num::NonZeroU64,
    sync::{
        Arc,
        mpsc::{RecvTimeoutError, SyncSender, sync_channel},
    },
    thread,
    time::{Duration, Instant},
};

use anyhow::Context;
use lookdown_detect::inference::ModelRepository;

use super::App;
use crate::{access::AccessKeys, calibration_store::Calibrations, tls::Tls};

/// Interval of the checks of the inference server, seconds.
const REMOTE_EVERY: NonZeroU64 = NonZeroU64::MIN;
/// Interval of the checks for reports that are too old, seconds.
const EXPIRY_EVERY: NonZeroU64 = NonZeroU64::MIN;
/// Interval of the checks for workers without progress, seconds.
const WATCHDOG_EVERY: NonZeroU64 = NonZeroU64::MIN;

impl App {
    /// The threads that look for changed models, calibrations, keys and certificates.
    pub(super) fn start_pollers(&self) -> anyhow::Result<Vec<Poller>> {
        let (models, calibrations) = (
            Arc::clone(&self.state.models),
            Arc::clone(&self.state.calibrations),
        );
        let model_poller =
            self.settings.model.poll_seconds.map(|every| {
                Poller::start("model-watcher", every, move || models.reload_changed())
            });
        let calibration_poller = self.settings.calibrations.poll_seconds.map(|every| {
            Poller::start("calibration-watcher", every, move || calibrations.refresh())
        });
        let keys = self.keys.clone().zip(self.settings.access.poll_seconds);
        let key_poller =
            keys.map(|(keys, every)| Poller::start("key-watcher", every, move || keys.refresh()));
        let tls = self.tls.clone().and_then(|tls| {
            let every = tls.poll_seconds()?;
            Some(Poller::start("tls-watcher", every, move || tls.refresh()))
        });
        let (workers, limit) = (Arc::clone(&self.state.workers), self.state.stall_limit());
        let watchdog = Poller::start("worker-watchdog", WATCHDOG_EVERY, move || {
            if let Some(stall) = workers.new_stall(Instant::now(), limit) {
                let seconds = stall.since.as_secs();
                tracing::error!(seconds, "no frame makes progress; in flight are {stall}");
            }
        });
        let results = Arc::clone(&self.state.results);
        let expiry = Poller::start("result-expiry", EXPIRY_EVERY, move || results.expire());
        let remote = self.state.models.remote.clone();
        let remote_poller = remote.map(|remote| {
            Poller::start("remote-watcher", REMOTE_EVERY, move || {
                remote.check_health();
            })
        });
        let pollers = model_poller
            .into_iter()
            .chain(remote_poller)
            .chain(calibration_poller)
            .chain(key_poller)
            .chain(tls)
            .chain([watchdog, expiry]);
        pollers
            .collect::<Result<_, _>>()
            .context("the operating system creates no thread to watch files")
    }

    /// The reloader of the files that the app uses.
    pub fn reloader(&self) -> Reloader {
        Reloader {
            keys: self.keys.clone(),
            tls: self.tls.clone(),
            calibrations: Arc::clone(&self.state.calibrations),
            models: Arc::clone(&self.state.models),
        }
    }
}

/// Reads again what may change while the server runs. Clones share it.
#[derive(Clone)]
pub struct Reloader {
    keys: Option<Arc<AccessKeys>>,
    tls: Option<Arc<Tls>>,
    calibrations: Arc<Calibrations>,
    models: Arc<ModelRepository>,
}

impl Reloader {
    /// Loads the files that have changed. A file that cannot be used is logged, and the previous
    /// version stays in use. Blocks.
    pub fn reload(&self) {
        if let Some(keys) = &self.keys {
            keys.refresh();
        }
        if let Some(tls) = &self.tls {
            tls.refresh();
        }
        self.calibrations.refresh();
        // The second check finds the files of models unchanged since the first, and loads them.
        self.models.reload_changed();
        self.models.reload_changed();
        tracing::info!(
            "SIGHUP: the files of keys, certificates, calibrations and models were checked for \
             changes"
        );
    }
}

/// A named thread that runs a task. Dropping it ends the thread after the current run, and does not
/// wait for that: a run may take as long as a store or a server does not answer.
pub(super) struct Poller {
    /// Dropping it ends the thread.
    _alive: SyncSender<()>,
}

impl Poller {
    /// Starts the thread, which runs `task` at this interval.
    ///
    /// # Errors
    /// If the operating system creates no thread.
    fn start(
        name: &str,
        seconds: NonZeroU64,
        task: impl Fn() + Send + 'static,
    ) -> io::Result<Self> {
        let (alive, ended) = sync_channel::<()>(0);
        let pause = Duration::from_secs(seconds.get());
        thread::Builder::new()
            .name(name.to_owned())
            .spawn(move || {
                while ended.recv_timeout(pause) == Err(RecvTimeoutError::Timeout) {
                    task();
                }
            })?;
        Ok(Self { _alive: alive })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dropping_a_poller_does_not_wait_for_a_stuck_run() {
        let (done, stuck) = sync_channel::<()>(0);
        let (start, started) = sync_channel(0);
        let poller = Poller::start("stuck", NonZeroU64::MIN, move || {
            // Both ends are there until the end of the test.
            let _ = start.send(());
            let _ = stuck.recv();
        });
        started.recv().unwrap();
        drop(poller.unwrap());
        drop(done);
    }
}
