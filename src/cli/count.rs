//! `lookdown count`

use std::{net::SocketAddr, path::PathBuf, process::ExitCode, time::Duration};

use anyhow::Context;
use clap::Args;
use lookdown_count::{
    CountEntry, CountOptions, HttpEntry, MqttEntry, Origin, Snapshot, StoreEntry, count,
};
use lookdown_http::Shutdown;
use tokio::{runtime, sync::watch};

use super::{SettingsFile, serve, server_flags::ServerFlags};
use crate::mqtt::{Broker, CountsOptions, CountsPublisher};

/// Threads for all cameras.
const RUNTIME_THREADS: usize = 2;

/// Arguments of `lookdown count`.
#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// A file of settings (docs/count.md) [default: none]
    #[arg(value_name = "COUNT.toml")]
    file: Option<PathBuf>,
    #[command(flatten)]
    server: ServerFlags,
    /// The address of the counts [default: 127.0.0.1:8090]
    #[arg(long, value_name = "ADDRESS")]
    listen: Option<SocketAddr>,
    /// The file of the counts [default: counts.sqlite]
    #[arg(long, value_name = "FILE")]
    store: Option<PathBuf>,
    #[command(flatten)]
    settings_file: SettingsFile,
}

impl Arguments {
    fn origin(&self) -> Origin {
        let flags = CountEntry {
            server: self.server.entry(),
            http: HttpEntry {
                listen: self.listen,
                ..HttpEntry::default()
            },
            store: StoreEntry {
                path: self.store.clone(),
                ..StoreEntry::default()
            },
            ..CountEntry::default()
        };
        Origin {
            file: self.file.clone(),
            flags,
        }
    }
}

/// Counts until a stop is requested. Changed settings apply at once.
pub(super) fn run(arguments: &Arguments) -> anyhow::Result<ExitCode> {
    arguments.settings_file.load()?;
    let runtime = runtime::Builder::new_multi_thread()
        .worker_threads(RUNTIME_THREADS)
        .enable_all()
        .build()
        .context("the operating system creates no thread")?;
    let origin = arguments.origin();
    let outcome = runtime.block_on(async {
        let shutdown = Shutdown::on_signals().context("signals cannot be handled")?;
        let mut options = origin.load().await?;
        loop {
            match count_until_changed(&origin, &options, &shutdown).await? {
                Some(changed) => options = changed,
                None => return anyhow::Ok(()),
            }
        }
    });
    serve::end(runtime);
    outcome.map(|()| ExitCode::SUCCESS)
}

/// Counts with these settings. Returns the changed settings, or `None` when a stop is requested.
async fn count_until_changed(
    origin: &Origin,
    options: &CountOptions,
    shutdown: &Shutdown,
) -> anyhow::Result<Option<CountOptions>> {
    let (snapshots, latest_snapshot) = watch::channel(Snapshot::default());
    let publisher = match &options.mqtt {
        Some(entry) => {
            let publishing = publishing_options(entry, options.longest_gap)?;
            Some(CountsPublisher::new(publishing, latest_snapshot)?)
        }
        None => None,
    };
    let mut changed = None;
    let stop = async {
        changed = tokio::select! {
            options = origin.changed(options) => Some(options),
            () = shutdown.requested() => None,
        };
    };
    let publishing = async {
        if let Some(publisher) = publisher {
            publisher.run().await;
        }
    };
    // The end of the counts ends the publisher.
    let (counted, ()) = tokio::join!(count(options, snapshots, stop), publishing);
    counted?;
    Ok(changed)
}

/// The broker of the settings, with its password. Topics of unknown cameras are withdrawn after the
/// time for which the counts of a silent camera are known.
fn publishing_options(entry: &MqttEntry, unknown_for: Duration) -> anyhow::Result<CountsOptions> {
    let broker: Broker = entry.url_with_password()?.parse().context("mqtt.url")?;
    let discovery = &entry.discovery_prefix;
    Ok(CountsOptions {
        broker,
        authorities: entry.authorities.clone(),
        topic_prefix: entry.topic_prefix.clone(),
        discovery_prefix: (!discovery.is_empty()).then(|| discovery.clone()),
        unknown_for,
    })
}
