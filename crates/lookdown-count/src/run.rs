//! The companion: follows the server, stores the sums, answers requests.

use std::{future::Future, sync::Arc, time::Duration};

use axum::Router;
use jiff::Timestamp;
use lookdown_common::{ClientError, ConfigError, OwnCameras, ServerClient};
use lookdown_http::{
    protect::{self, Access, Routes},
    server::bind,
};
use parking_lot::Mutex;
use secrecy::SecretString;
use tokio::{
    net::TcpListener,
    sync::watch,
    task::{JoinError, spawn_blocking},
    time::{Instant, timeout},
};
use tokio_util::task::AbortOnDropHandle;

use crate::{
    bars::read_bars,
    calibrations::Calibrations,
    counter::{Counter, CountingOptions},
    follower::Follower,
    http::{Api, operation_router, probes, router},
    metrics::Metrics,
    now::time_of,
    options::CountOptions,
    snapshot::Snapshot,
    store::{Store, StoreError},
    webhooks::{Conditions, Deliveries},
};

/// Longest time for the last transaction.
const LAST_COMMIT: Duration = Duration::from_secs(10);

/// Returns the number of persons at a camera; `None` while it is unknown.
type Persons = Box<dyn Fn(&str) -> Option<u64> + Send + Sync>;
/// Returns the sentence about a camera that is not counted, or whose counts may be too low.
type CountWarning = Box<dyn Fn(&str) -> Option<String> + Send + Sync>;

/// The running counts, for a server that answers with them.
pub struct Started {
    /// The routes below `/counts` and `/sites`, without access control.
    pub routes: Router,
    /// Returns all metrics in the text format of Prometheus.
    pub metrics: Box<dyn Fn() -> Vec<u8> + Send + Sync>,
    /// Returns the number of persons at a camera now; `None` while it is unknown.
    pub persons: Persons,
    /// Returns the reason why a camera is not counted now, or why its counts may be too low.
    pub warning: CountWarning,
}

/// The reason why nothing is counted.
#[derive(Debug, thiserror::Error)]
pub enum CountError {
    /// A setting that cannot be used.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// No HTTP client.
    #[error(transparent)]
    Client(#[from] ClientError),
    /// The store cannot be used.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// The task that opens the store panicked.
    #[error("the store cannot be opened because of an internal error: {0}")]
    StoreTask(#[source] JoinError),
    /// The metrics cannot be created.
    #[error("the metrics cannot be created: {0}")]
    Metrics(#[from] prometheus::Error),
    /// The address of the HTTP API cannot be used.
    #[error("{0}")]
    Address(String),
}

/// Counts with these settings until `stop` ends. `snapshots` receives the current counts, and
/// `started` the routes.
///
/// # Errors
/// [`CountError`].
pub async fn count(
    options: &CountOptions,
    snapshots: watch::Sender<Snapshot>,
    started: impl FnOnce(Started),
    stop: impl Future<Output = ()>,
) -> Result<(), CountError> {
    let metrics = Arc::new(Metrics::new()?);
    let client = ServerClient::new(&options.server)?;
    let listener = match options.entry.listen {
        Some(address) => {
            let listener = bind("counts.listen", address).await;
            Some(listener.map_err(CountError::Address)?)
        }
        None => None,
    };
    let path = options.entry.store.clone();
    let opened = spawn_blocking(move || {
        let store = Store::open(&path)?;
        let resumed = store.resumed()?;
        Ok::<_, StoreError>((store, resumed))
    });
    let (store, resumed) = opened.await.map_err(CountError::StoreTask)??;
    let calibrations = Calibrations::resumed(resumed.calibrations);
    let mut counter = Counter::new(limits(options), resumed.last_event, resumed.totals);
    for state in resumed.scenes {
        counter.resume(state, |key| calibrations.definition(key));
    }
    for problem in &options.webhook_problems {
        tracing::error!("{problem}; this webhook gets no messages");
    }
    let conditions = Conditions::resumed(
        options.webhooks.clone(),
        &resumed.held,
        counter.last_reports(),
        Timestamp::now().as_millisecond(),
    );
    let counter = Arc::new(Mutex::new(counter));
    let api = Api {
        counter: Arc::clone(&counter),
        store: store.clone(),
    };
    let counts = router(api);
    let own_listener =
        |listener| serve_alone(listener, options, counts.clone(), &counter, &metrics);
    let _serving = listener.map(own_listener);
    let (shown, shown_counter) = (Arc::clone(&metrics), Arc::clone(&counter));
    let warned = Arc::clone(&counter);
    let latest = snapshots.subscribe();
    started(Started {
        persons: Box::new(move |camera| latest.borrow().persons(camera)),
        warning: Box::new(move |camera| warned.lock().warning(camera)),
        routes: counts,
        metrics: Box::new(move || {
            shown.text(&shown_counter.lock(), Timestamp::now().as_millisecond())
        }),
    });
    let reading_bars = tokio::spawn(read_bars(client.clone(), Arc::clone(&counter)));
    let _reading_bars = AbortOnDropHandle::new(reading_bars);
    let (stop_sender, stop_receiver) = watch::channel(false);
    let mut follower = Follower {
        deliveries: Deliveries::start(
            &options.webhooks,
            resumed.messages,
            &client,
            &store,
            &metrics,
        )?,
        conditions,
        client,
        counter,
        calibrations,
        store,
        metrics,
        snapshots,
        commit_every: options.entry.commit_every,
        retention: options.entry.retention,
        messages: Vec::new(),
        next_commit: Instant::now() + options.entry.commit_every,
        next_expiry: Instant::now(),
        stop: stop_receiver,
    };
    if follower.counter.lock().last_event > 0 {
        let last_ms = follower.counter.lock().last_event / 1000;
        let last = time_of(i64::try_from(last_ms).unwrap_or(i64::MAX));
        tracing::info!("continuing after the report of {last}");
    }
    let mut following = tokio::spawn(async move { follower.run().await });
    tokio::select! {
        () = stop => {}
        // It ends only by a panic, which the panic hook logs.
        _ = &mut following => return Ok(()),
    }
    let _ = stop_sender.send(true);
    if timeout(LAST_COMMIT, &mut following).await.is_err() {
        tracing::error!("the last sums are not stored: the server sends their reports again");
        following.abort();
    }
    Ok(())
}

fn limits(options: &CountOptions) -> CountingOptions {
    let milliseconds = |time: Duration| i64::try_from(time.as_millis()).unwrap_or(i64::MAX);
    let in_process = options.server.in_process.as_ref();
    CountingOptions {
        longest_gap_ms: milliseconds(options.entry.longest_gap),
        max_cameras: options.entry.max_cameras,
        floor_alert_after_ms: options.entry.floor_alert_after.map(milliseconds),
        own: in_process.map_or_else(OwnCameras::default, |server| server.own_cameras.clone()),
    }
}

/// Serves the routes on an address of their own, with the metrics and probes.
fn serve_alone(
    listener: TcpListener,
    options: &CountOptions,
    counts: Router,
    counter: &Arc<Mutex<Counter>>,
    metrics: &Arc<Metrics>,
) -> AbortOnDropHandle<()> {
    let address = listener.local_addr().ok();
    if let Some(address) = address {
        tracing::info!("counts at http://{address}/counts");
    }
    let access = match (&options.api_key, address) {
        (Some(key), _) => Access::Key(SecretString::clone(key)),
        (None, _) if options.entry.open => Access::Everyone(options.entry.hosts.clone().into()),
        (None, Some(address)) => Access::without_key(address),
        (None, None) => Access::OwnMachine,
    };
    let routes = Routes {
        protected: counts.merge(operation_router(counter, metrics)),
        probes: probes(),
    };
    let open = metrics.connections.clone();
    let serving = tokio::spawn(async move {
        protect::serve(listener, routes, access, "counts.api_key_file", &open).await;
    });
    AbortOnDropHandle::new(serving)
}
