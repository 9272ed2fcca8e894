//! The companion: follows the server, stores the sums, answers requests.

use std::{future::Future, path::PathBuf, sync::Arc, time::Duration};

use jiff::Timestamp;
use lookdown_common::{AbortOnDrop, ClientError, ConfigError, LogOnce, ServerClient};
use lookdown_http::{
    protect::{self, Access, Routes},
    server::bind,
};
use parking_lot::Mutex;
use tokio::{
    sync::watch,
    task::spawn_blocking,
    time::{Instant, sleep, timeout},
};

use crate::{
    calibrations::Calibrations,
    engine::{CountingOptions, Engine},
    follower::Follower,
    hand_back::hand_back,
    http::{Api, metrics_router, probes, router},
    metrics::Metrics,
    options::{CountEntry, CountOptions, load},
    snapshot::Snapshot,
    store::{Store, StoreError},
    webhooks::{Conditions, Deliveries},
};

/// Interval of the checks for changed settings.
const FILE_CHECK: Duration = Duration::from_secs(2);
/// Longest time for the last transaction.
const LAST_COMMIT: Duration = Duration::from_secs(10);

/// The origin of the settings.
#[derive(Debug, Clone)]
pub struct Origin {
    /// A file that is read again when it changes.
    pub file: Option<PathBuf>,
    /// Flags, which have precedence.
    pub flags: CountEntry,
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
    /// The metrics cannot be created.
    #[error("the metrics cannot be created: {0}")]
    Metrics(#[from] prometheus::Error),
    /// The address of the HTTP API cannot be used.
    #[error("{0}")]
    Address(String),
}

impl Origin {
    /// Reads and checks the settings without blocking the runtime.
    ///
    /// # Errors
    /// [`ConfigError`].
    pub async fn load(&self) -> Result<CountOptions, ConfigError> {
        let Self { file, flags } = self.clone();
        let loaded = spawn_blocking(move || load(file.as_deref(), &flags)).await;
        loaded.unwrap_or_else(|error| Err(ConfigError::problem("settings", &error)))
    }

    /// Waits until the settings differ, and returns them. Invalid settings are logged once.
    ///
    /// The store and the address stay in use while settings are invalid.
    pub async fn changed(&self, current: &CountOptions) -> CountOptions {
        let mut log = LogOnce::default();
        loop {
            sleep(FILE_CHECK).await;
            match self.load().await {
                Ok(options) if options != *current => return options,
                Ok(_) => drop(log.clear()),
                Err(problem) => {
                    if log.should_log(&problem.to_string()) {
                        tracing::warn!("{problem}; the last valid settings stay in use");
                    }
                }
            }
        }
    }
}

/// Counts with these settings until `stop` ends. `snapshots` receives the current counts.
///
/// # Errors
/// [`CountError`].
pub async fn count(
    options: &CountOptions,
    snapshots: watch::Sender<Snapshot>,
    stop: impl Future<Output = ()>,
) -> Result<(), CountError> {
    let metrics = Arc::new(Metrics::new()?);
    let client = ServerClient::new(&options.server)?;
    let listener = bind("http.listen", options.listen).await;
    let listener = listener.map_err(CountError::Address)?;
    let path = options.store.clone();
    let opened = spawn_blocking(move || {
        let store = Store::open(&path)?;
        let resumed = store.resumed()?;
        Ok::<_, StoreError>((store, resumed))
    });
    let (store, resumed) = opened
        .await
        .map_err(|error| CountError::Address(error.to_string()))??;
    let calibrations = Calibrations::resumed(resumed.calibrations);
    let counting = CountingOptions {
        longest_gap_ms: i64::try_from(options.longest_gap.as_millis()).unwrap_or(i64::MAX),
        max_cameras: options.max_cameras,
    };
    let mut engine = Engine::new(counting, resumed.last_event, resumed.totals);
    for state in resumed.scenes {
        engine.resume(state, |key| calibrations.definition(key));
    }
    let conditions = Conditions::resumed(
        options.webhooks.clone(),
        &resumed.held,
        engine.last_reports(),
        Timestamp::now().as_millisecond(),
    );
    let engine = Arc::new(Mutex::new(engine));
    let api = Api {
        engine: Arc::clone(&engine),
        store: store.clone(),
    };
    if let Ok(address) = listener.local_addr() {
        tracing::info!("counts at http://{address}/counts");
    }
    let access = match &options.api_key {
        Some(key) => Access::Key(key.clone()),
        None => Access::without_key(options.listen),
    };
    let routes = Routes {
        protected: router(api).merge(metrics_router(&engine, &metrics)),
        probes: probes(),
    };
    let open = metrics.connections.clone();
    let serving = tokio::spawn(async move {
        protect::serve(listener, routes, access, "http.api_key_file", &open).await;
    });
    let _serving = AbortOnDrop(serving.abort_handle());
    let handing_back = tokio::spawn(hand_back(client.clone(), snapshots.subscribe()));
    let _handing_back = AbortOnDrop(handing_back.abort_handle());
    let (stop_sender, stop_receiver) = watch::channel(false);
    let mut follower = Follower {
        deliveries: Deliveries::start(&options.webhooks, resumed.messages, &store, &metrics)?,
        conditions,
        client,
        engine,
        calibrations,
        store,
        metrics,
        snapshots,
        commit_every: options.commit_every,
        retention: options.retention,
        messages: Vec::new(),
        next_commit: Instant::now() + options.commit_every,
        next_expiry: Instant::now(),
        stop: stop_receiver,
    };
    if follower.engine.lock().last_event() > 0 {
        let last_ms = follower.engine.lock().last_event() / 1000;
        let last = i64::try_from(last_ms).ok();
        let last = last.and_then(|last_ms| Timestamp::from_millisecond(last_ms).ok());
        if let Some(last) = last {
            tracing::info!("continuing after the report of {last}");
        }
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
