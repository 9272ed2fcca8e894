//! The life of the server, from the sockets to the last answer.
//!
//! The sockets that the settings describe.
//!
//! The report of `lookdown serve --check`.
//!
//! Notifications to systemd: ready, stopping, and the watchdog of the service.
//!
//! systemd names its socket in `NOTIFY_SOCKET`, and the interval of the watchdog in
//! `WATCHDOG_USEC`. Without these variables nothing is sent.

use std::{
    fmt::Write as _,
    future::pending,
    net::SocketAddr,
    sync::Arc,
    thread,
    time::{Duration, Instant},
};

use anyhow::{Context, bail};
use lookdown_detect::parameters::Priority;
use lookdown_http::{
    Shutdown,
    server::{self, Plain},
};
use rustix::process::{Resource, getrlimit};
use sd_notify::NotifyState;
use tokio::{
    join,
    net::TcpListener,
    spawn,
    task::spawn_blocking,
    time::{MissedTickBehavior, interval, sleep, timeout},
};

use super::{App, CALIBRATIONS_CHECK};
use crate::{
    access::Scope,
    api::{self, Phase, Readiness},
    settings::{ServerSettings, Settings, variable_of},
};

/// Longest time, 3 seconds, that the shutdown waits for the MQTT broker.
const MQTT_SHUTDOWN_TIMEOUT: Duration = Duration::from_secs(3);
/// Longest time that the shutdown waits for a model that is being loaded.
const LONGEST_LOAD: Duration = Duration::from_secs(10);
/// Files that a server opens beside its connections: listeners, models, calibrations, stores.
const OTHER_FILES: u64 = 64;
/// Interval of the checks during that wait.
const LOAD_CHECK: Duration = Duration::from_millis(20);
/// Pause before a model is loaded again after a transient failure.
const BEFORE_ANOTHER_LOAD: Duration = Duration::from_secs(1);

impl App {
    /// Serves until `shutdown` is requested. Then readiness ends, and requests are served for the
    /// grace period. After that, no more connections are accepted, and requests in flight are
    /// answered within the drain timeout. A second request to stop ends all at once.
    ///
    /// # Errors
    /// If a model cannot be loaded or a socket fails.
    pub async fn serve(mut self, sockets: Sockets, shutdown: Shutdown) -> anyhow::Result<()> {
        let address = sockets.main.local_addr()?;
        let scheme = if self.tls.is_some() { "https" } else { "http" };
        log_start(&self.settings, scheme, address);
        log_exposure(&self.settings, self.keys.is_some(), address);
        log_open_files(&self.settings);
        let _pollers = self.start_pollers()?;
        let publishing = self
            .publisher
            .take()
            .map(|publisher| spawn(publisher.run()));
        let router = api::router(self.state.clone());
        let limits = &self.settings.connections;
        let tls = self.tls.as_ref();
        let connections = server::serve(
            sockets.main,
            tls,
            router,
            limits,
            &self.state.metrics.connections,
            &shutdown,
        );
        // Waits for both: the process must not exit while a model is being loaded.
        let finished = async {
            let connections = async {
                connections.await;
                Ok(())
            };
            tokio::try_join!(self.load_models(scheme, address, &shutdown), connections)?;
            let workers = Arc::clone(&self.state.workers);
            spawn_blocking(move || workers.shut_down()).await?;
            if let Some(publishing) = publishing {
                // The results have ended. If the broker takes too long, it publishes the will.
                let _ = timeout(MQTT_SHUTDOWN_TIMEOUT, publishing).await;
            }
            self.state.results.flush().await;
            tracing::info!("stopped");
            anyhow::Ok(())
        };
        let operation = async {
            if let Some(listener) = sockets.metrics {
                self.serve_operation(listener).await;
            }
        };
        let limit = self.state.stall_limit();
        let is_stuck = || self.state.workers.stall(Instant::now(), limit).is_some();
        let alongside = async {
            // In memory of its own: the future of the server has a limit.
            let notifications = Box::pin(notify(&self.state.readiness, &shutdown, is_stuck));
            join!(operation, notifications);
            pending::<()>().await;
        };
        let outcome = tokio::select! {
            biased;
            () = shutdown.requested_at_once() => {
                tracing::warn!("stopped at once");
                Ok(())
            }
            outcome = finished => outcome,
            () = alongside => Ok(()),
            () = self.wind_up(&shutdown) => {
                tracing::warn!("stopped before all requests had ended");
                Ok(())
            }
        };
        self.end_of_load().await;
        outcome
    }

    /// Waits until no model is being loaded, within limits: ONNX Runtime crashes the process if it
    /// ends during a load.
    async fn end_of_load(&self) {
        let ended = async {
            while self.state.models.is_loading() {
                sleep(LOAD_CHECK).await;
            }
        };
        let _ = timeout(LONGEST_LOAD, ended).await;
    }

    /// Serves metrics and probes on their own port until the process ends.
    async fn serve_operation(&self, listener: TcpListener) {
        let router = api::operation_router(self.state.clone());
        let limits = &self.settings.connections;
        server::serve::<Plain, _, _>(
            listener,
            None,
            router,
            limits,
            &self.state.metrics.connections,
            &Shutdown::default(),
        )
        .await;
    }

    /// Waits for the request to stop, announces it for the grace period, and ends when the drain
    /// timeout is over.
    async fn wind_up(&self, shutdown: &Shutdown) {
        let grace = self.settings.shutdown.grace;
        let drain_timeout = self.settings.drain_timeout();
        shutdown.requested().await;
        self.state.readiness.stopping();
        tracing::info!("stopping");
        tokio::select! {
            () = sleep(grace) => {}
            () = shutdown.draining() => {}
        }
        tracing::info!("draining: requests in flight are finished");
        // Streams of results would never end by themselves.
        self.state.results.listeners().end();
        shutdown.drain();
        sleep(drain_timeout).await;
    }

    /// Loads a model when its server is available and has capacity, and no other model is being
    /// loaded.
    async fn load(&self, name: String, shutdown: &Shutdown) -> anyhow::Result<()> {
        loop {
            let loaded = if self.state.models.is_remote_available() {
                let (models, name) = (Arc::clone(&self.state.models), name.clone());
                Some(spawn_blocking(move || models.load(&name)).await?)
            } else {
                None
            };
            match loaded {
                Some(Ok(_)) => return Ok(()),
                None => {}
                Some(Err(error)) if error.is_passing() => {}
                Some(Err(error)) => return Err(error.into()),
            }
            tokio::select! {
                () = sleep(BEFORE_ANOTHER_LOAD) => {}
                () = shutdown.requested() => return Ok(()),
            }
        }
    }

    /// Loads the models until a stop is requested. The server is ready when all are loaded and the
    /// calibrations were read.
    async fn load_models(
        &self,
        scheme: &str,
        address: SocketAddr,
        shutdown: &Shutdown,
    ) -> anyhow::Result<()> {
        for name in self.to_load.clone() {
            if shutdown.is_requested() {
                break;
            }
            self.load(name, shutdown).await?;
        }
        while !self.state.calibrations.is_read() && !shutdown.is_requested() {
            sleep(CALIBRATIONS_CHECK).await;
        }
        // Each profile needs its model: a server with some of them would refuse the others' frames.
        if self.state.readiness.phase() == Phase::WarmingUp && !shutdown.is_requested() {
            self.state.readiness.warmed_up();
            let port = address.port();
            tracing::info!(
                "ready: the page is {scheme}://localhost:{port}, try curl -F img=@samples/office.jpg \
                 {scheme}://localhost:{port}/detect"
            );
        }
        Ok(())
    }

    /// Loads every model that is served, and describes the server that could start: a line on
    /// models and calibrations, and lines on the clients that have access. Blocks.
    ///
    /// # Errors
    /// Returns an error if a model cannot be loaded, or if the calibration store cannot be read.
    pub fn check(&self) -> anyhow::Result<String> {
        for name in &self.to_load {
            self.state.models.load(name)?;
        }
        while !self.state.calibrations.is_read() {
            thread::sleep(CALIBRATIONS_CHECK);
        }
        let health = self.state.calibrations.health();
        if let Some(problem) = health.store_problem {
            bail!("calibrations.path: {problem}");
        }
        Ok(format!(
            "ready to serve on {}: the models {} and {} calibrations can be used\n{}",
            self.settings.server.listen,
            self.to_load.join(", "),
            health.serving,
            self.access_report(),
        ))
    }

    fn access_report(&self) -> String {
        let address = self.settings.server.listen;
        let mut report = match &self.keys {
            None if !self.settings.access.open => format!(
                "access: open, without API keys: every client on this machine may send frames, read \
                 and change everything at {address}"
            ),
            None => format!(
                "access: open (access.open), without API keys: every client that reaches {address} \
                 may send frames and read calibrations and reports; changes are refused; set \
                 access.keys_file to need keys"
            ),
            Some(keys) => {
                let keys = keys.known();
                let mut report =
                    format!("access: {address} needs an API key; {} known", keys.len());
                for problem in &keys.problems {
                    let _ = write!(report, "\n  access.keys_file: {problem}; not a key");
                }
                for holder in keys.holders() {
                    let scopes = holder.scopes.joined(", ");
                    let _ = write!(report, "\n  {}: {scopes}", holder.name);
                    if holder.scopes.allow(Scope::Detect) {
                        let highest = Priority::from_level(holder.highest_priority.get());
                        let _ = write!(report, "; priorities {} to 9", highest.highest_level());
                    }
                }
                report
            }
        };
        let public = match self.settings.server.metrics_listen {
            Some(address) => {
                format!("\nwithout a key: health checks and the API page, and metrics at {address}")
            }
            None => "\nwithout a key: health checks, metrics and the API page".to_owned(),
        };
        report.push_str(&public);
        report
    }
}

/// Warns if the process may not open a file for each connection.
fn log_open_files(settings: &Settings) {
    let connections = settings.connections.max_connections.get() as u64;
    let limit = getrlimit(Resource::Nofile).current;
    if let Some(limit) = limit.filter(|limit| *limit < connections + OTHER_FILES) {
        tracing::warn!(
            "server.max_connections is {connections}, but the process may open {limit} files: raise \
             that limit (ulimit -n, LimitNOFILE=), or lower server.max_connections"
        );
    }
}

/// Logs which clients an address without keys has.
fn log_exposure(settings: &Settings, has_keys: bool, address: SocketAddr) {
    match (has_keys, settings.access.open) {
        (true, _) => {}
        (false, true) => tracing::warn!(
            "access.open is true and no API keys are set: every client that reaches {address} may \
             send frames and read calibrations and reports; set access.keys_file to require keys"
        ),
        (false, false) => tracing::info!(
            "no API keys are set: every client of this machine may do everything, and so may the \
             clients of a tunnel or of a proxy that adds no header to their requests; set \
             access.keys_file to require keys"
        ),
    }
}

/// Logs the configuration and the address.
fn log_start(settings: &Settings, scheme: &str, address: SocketAddr) {
    tracing::info!(
        version = env!("CARGO_PKG_VERSION"),
        device = %settings.inference.device,
        sessions = settings.threads.sessions,
        threads_per_session = settings.threads.per_session,
        remap_threads = settings.threads.remapping,
        calibrations = %settings.calibrations.path.display(),
        "listening on {scheme}://{address}, API page at {scheme}://{address}/docs"
    );
}

/// The sockets of the service.
#[derive(Debug)]
pub struct Sockets {
    /// All endpoints, or all except metrics.
    pub main: TcpListener,
    /// Metrics and probes only, if the settings ask for a separate port.
    pub metrics: Option<TcpListener>,
}

impl Sockets {
    /// Binds the addresses of the settings.
    ///
    /// # Errors
    /// One sentence that names the setting, for an address that is in use or not one of this
    /// machine.
    pub async fn bind(settings: &ServerSettings) -> anyhow::Result<Self> {
        let main = bind("server.listen", settings.listen).await?;
        let metrics = match settings.metrics_listen {
            Some(address) => Some(bind("server.metrics_listen", address).await?),
            None => None,
        };
        Ok(Self { main, metrics })
    }
}

async fn bind(key: &str, address: SocketAddr) -> anyhow::Result<TcpListener> {
    TcpListener::bind(address).await.with_context(|| {
        let variable = variable_of(key);
        format!("{key}: cannot listen on {address}: set {variable} or --listen to a free address")
    })
}

/// Notifies systemd when the server is ready and when a stop is requested. Confirms the watchdog at
/// half of its interval while `is_stuck` returns false. A blocked runtime confirms nothing. In both
/// cases systemd restarts the server.
pub(super) async fn notify(
    readiness: &Readiness,
    shutdown: &Shutdown,
    is_stuck: impl Fn() -> bool,
) {
    let phases = async {
        readiness.ready().await;
        if readiness.phase() == Phase::Ready {
            send(NotifyState::Ready).await;
        }
        shutdown.requested().await;
        send(NotifyState::Stopping).await;
    };
    let watchdog = async {
        let timeout = sd_notify::watchdog_enabled();
        if let Some(timeout) = timeout.filter(|timeout| !timeout.is_zero()) {
            let confirm = async || send(NotifyState::Watchdog).await;
            confirm_every(timeout / 2, is_stuck, confirm).await;
        }
    };
    join!(phases, watchdog);
}

/// Confirms at this interval, except while `is_stuck` returns true.
async fn confirm_every(every: Duration, is_stuck: impl Fn() -> bool, confirm: impl AsyncFn()) -> ! {
    let mut ticks = interval(every);
    ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
    loop {
        ticks.tick().await;
        if !is_stuck() {
            confirm().await;
        }
    }
}

/// Sends a message. A failure is logged: systemd then acts on the missing message.
async fn send(state: NotifyState<'static>) {
    let sent = spawn_blocking(move || sd_notify::notify(&[state])).await;
    if let Ok(Err(error)) = sent {
        tracing::warn!(%error, "systemd cannot be notified");
    }
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;

    use tokio::time::timeout;

    use super::*;

    #[tokio::test(start_paused = true)]
    async fn watchdog_is_confirmed_only_while_work_progresses() {
        let (stuck, confirmed) = (Cell::new(false), Cell::new(0));
        let for_three_ticks = async || {
            let confirm = async || confirmed.set(confirmed.get() + 1);
            let confirming = confirm_every(Duration::from_secs(5), || stuck.get(), confirm);
            let _ = timeout(Duration::from_secs(14), confirming).await;
        };
        for_three_ticks().await;
        assert_eq!(confirmed.get(), 3);
        stuck.set(true);
        for_three_ticks().await;
        assert_eq!(confirmed.get(), 3);
    }
}
