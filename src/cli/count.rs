//! `lookdown count`

mod recording;

use std::{path::PathBuf, process::ExitCode};

use anyhow::{Context, bail};
use clap::Args;
use lookdown_common::{ConfigError, Reload, ServerClient, ServerEntry, ServerOptions};
use lookdown_count::{CountEntry, CountOptions, Snapshot, Started, count};
use lookdown_http::Shutdown;
use tokio::sync::watch;

use super::{
    SettingsFile,
    async_runtime::{THREADS, run_async},
    detect::stream::is_video,
    server_flags::{ServerFlags, SettingsSource, given},
};
use crate::{
    mqtt::{CountsOptions, CountsPublisher},
    settings::Settings,
};

/// Arguments of `lookdown count`.
#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// A settings file (docs/count.md); or recordings of one camera in their order, such as
    /// clip.mp4, which are counted without a server [default: none]
    #[arg(value_name = "SETTINGS.toml|CLIP")]
    files: Vec<PathBuf>,
    #[command(flatten)]
    recording: recording::RecordingFlags,
    #[command(flatten)]
    server: ServerFlags,
    /// The address of the counts (`counts.listen`) [default: 127.0.0.1:8090]
    #[arg(long, value_name = "ADDRESS")]
    listen: Option<String>,
    /// The file of the counts (`counts.path`) [default: counts.sqlite]
    #[arg(long, value_name = "FILE")]
    store: Option<String>,
    #[command(flatten)]
    settings_file: SettingsFile,
}

/// The settings of the counts.
#[derive(Clone, PartialEq)]
pub(super) struct Counting {
    pub(super) options: CountOptions,
    /// The broker.
    mqtt: Option<CountsOptions>,
}

/// Counts until a stop is requested. Changed settings apply at once.
pub(super) fn run(arguments: &Arguments) -> anyhow::Result<ExitCode> {
    if arguments.files.iter().any(|file| is_video(file)) {
        return recording::run(
            &arguments.files,
            &arguments.recording,
            arguments.store.as_deref(),
            &arguments.settings_file,
        );
    }
    if arguments.recording.is_given() {
        bail!("flags of a recording need one: give a video such as clip.mp4");
    }
    let file = match arguments.files.as_slice() {
        [] => None,
        [file] => Some(file.to_string_lossy()),
        [_, other, ..] => bail!(
            "{}: it is not a recording: give one settings file, or recordings such as clip.mp4",
            other.display()
        ),
    };
    let own = given(&[
        ("counts.listen", arguments.listen.as_deref()),
        ("counts.path", arguments.store.as_deref()),
    ]);
    let flags = [arguments.server.settings(), own].concat();
    let settings = arguments.settings_file.source(file.as_deref(), &flags)?;
    settings.load()?;
    run_async(THREADS, async {
        let shutdown = Shutdown::on_signals().context("signals cannot be handled")?;
        let counting = counting(&settings, None);
        let counts = run_counts(&counting, |_| {}, async || shutdown.requested().await);
        Box::pin(counts).await
    })
}

/// Returns the settings of the counts. Counts of `server`, which is in this process, have no
/// address of their own.
pub(super) fn counting(
    settings: &SettingsSource,
    server: Option<ServerOptions>,
) -> Reload<Counting> {
    let settings = settings.clone();
    Reload::new(move || {
        let settings = settings.again()?;
        let mqtt = publishing(&settings);
        let mut options = CountEntry {
            server: match &server {
                Some(_) => ServerEntry::default(),
                None => settings.upstream,
            },
            webhooks: settings.lists.webhooks,
            hosts: settings.access.hosts.clone(),
            ..settings.counts.entry()
        }
        .check()?;
        if let Some(server) = &server {
            options.server = server.clone();
            options.entry.listen = None;
        }
        Ok::<_, ConfigError>(Counting { options, mqtt })
    })
}

/// The broker of the settings. Topics of unknown cameras are withdrawn after the time for which the
/// counts of a silent camera are known.
fn publishing(settings: &Settings) -> Option<CountsOptions> {
    let mqtt = settings.mqtt.clone()?;
    Some(CountsOptions {
        broker: mqtt.broker,
        authorities: mqtt.authorities,
        topic_prefix: mqtt.topic_prefix,
        discovery_prefix: mqtt.discovery_prefix,
        unknown_for: settings.counts.longest_gap,
        image_every: mqtt.image_every,
    })
}

/// Counts until `stopped` ends, and again after each change of the settings. `started` receives the
/// routes each time.
pub(super) async fn run_counts(
    settings: &Reload<Counting>,
    started: impl Fn(Started),
    stopped: impl AsyncFn(),
) -> anyhow::Result<()> {
    let mut current = settings.load().await?;
    loop {
        let mut changed = None;
        let stop = async {
            changed = tokio::select! {
                counting = settings.changed(&current) => Some(counting),
                () = stopped() => None,
            };
        };
        count_with(&current, &started, stop).await?;
        match changed {
            Some(counting) => current = counting,
            None => return Ok(()),
        }
    }
}

/// Counts with these settings until `stop` ends.
async fn count_with(
    counting: &Counting,
    started: impl Fn(Started),
    stop: impl Future<Output = ()>,
) -> anyhow::Result<()> {
    let (snapshots, latest_snapshot) = watch::channel(Snapshot::default());
    let publisher = match counting.mqtt.clone() {
        Some(options) => {
            let server = ServerClient::new(&counting.options.server)?;
            Some(CountsPublisher::new(options, latest_snapshot, server)?)
        }
        None => None,
    };
    let publishing = async {
        if let Some(publisher) = publisher {
            publisher.run().await;
        }
    };
    // The end of the counts ends the publisher.
    let (counted, ()) = tokio::join!(
        count(&counting.options, snapshots, started, stop),
        publishing
    );
    Ok(counted?)
}
