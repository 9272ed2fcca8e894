//! `lookdown run`

use std::{
    fs,
    io::{self, Write},
    process::ExitCode,
    sync::Arc,
};

use anyhow::{Context, bail};
use clap::Args;
use lookdown_common::{Secret, ServerOptions};
use lookdown_count::Started;
use lookdown_http::Shutdown;
use lookdown_watch::{CameraEntry, Metrics, Origin, watch as watch_cameras};
use tokio::sync::watch;

use super::{
    SettingsFile,
    async_runtime::{THREADS, run_async},
    count::{counting, run_counts},
    progress::UNWRITABLE,
    serve,
    server_flags::{CameraFlags, SettingsSource, given},
    watch::{cameras, separate},
};
use crate::{
    access::{KeyDigest, KeyList, new_key},
    api::{Companions, Readiness},
    cameras::Cameras,
    probe,
    settings::{CAMERA_VARIABLE, Settings, environment},
};

/// The name of the key with which cameras and counts use the server of this process.
const OWN_KEY: &str = "lookdown-run";
/// The name of a camera of the command line without a name.
const CAMERA: &str = "camera";

/// Arguments of `lookdown run`.
#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// A settings file (docs/configuration.md), or a camera: the URL of RTSP, an MJPEG stream or a
    /// JPEG snapshot, a folder into which images are dropped, a video file, or `-` for images on
    /// standard input. The variable `LOOKDOWN_CAMERA` may hold a camera instead
    #[arg(value_name = "SETTINGS.toml|SOURCE")]
    source: Option<String>,
    #[command(flatten)]
    camera: CameraFlags,
    /// IP address and port to listen on, such as 0.0.0.0:8080 (`server.listen`)
    #[arg(long, value_name = "ADDRESS:PORT")]
    listen: Option<String>,
    /// Port to listen on, at the address of `server.listen`
    #[arg(long, conflicts_with = "listen")]
    port: Option<u16>,
    /// Check that all of it could start (settings, cameras, library, models, calibrations, keys and
    /// addresses), print the clients that would have access, and end
    #[arg(long)]
    check: bool,
    /// The file of the counts (`counts.path`) [default: counts.sqlite]
    #[arg(long, value_name = "FILE")]
    store: Option<String>,
    #[command(flatten)]
    settings_file: SettingsFile,
}

/// Serves, watches and counts until a stop is requested.
pub(super) fn run(arguments: &Arguments, commit: Option<&str>) -> anyhow::Result<ExitCode> {
    let (file, source) = separate(arguments.source.as_deref())?;
    let in_variable = environment()
        .find(|(name, source)| name == CAMERA_VARIABLE && !source.is_empty())
        .map(|(_, source)| source);
    let source = source.or(in_variable.as_deref());
    let flags = given(&[
        ("server.listen", arguments.listen.as_deref()),
        ("counts.path", arguments.store.as_deref()),
    ]);
    let source_of_settings = arguments.settings_file.source(file, &flags)?;
    arguments.camera.check_source(source)?;
    let camera = source.map(|source| arguments.camera.entry(source, Some(CAMERA)));
    let mut settings = source_of_settings.load()?;
    if let Some(port) = arguments.port {
        settings.server.listen.set_port(port);
    }
    check(&settings)?;
    create_calibrations(&settings);
    // The metrics of the counts have the same names.
    settings.results.camera_metrics = true;
    settings.calibrations.zone_metrics = true;
    if arguments.check {
        return run_async(THREADS, async {
            let watched = cameras(&source_of_settings, camera, None).load().await?;
            let counting = counting(&source_of_settings, None).load().await?;
            if let Some(problem) = counting.options.webhook_problems.first() {
                bail!("{problem}");
            }
            serve::check(settings).await?;
            let count = watched.cameras.len();
            writeln!(io::stdout(), "cameras of the settings: {count}").context(UNWRITABLE)
        });
    }
    let key = own_key(&mut settings)?;
    run_async(THREADS, async {
        let shutdown = Shutdown::on_signals().context("signals cannot be handled")?;
        let parts = Parts {
            settings: source_of_settings,
            camera,
            key,
            shutdown,
        };
        Box::pin(parts.run(settings, commit)).await
    })
}

/// Refuses settings of several processes.
fn check(settings: &Settings) -> anyhow::Result<()> {
    if settings.results.redis.is_some() {
        bail!(
            "results.url: `lookdown run` is one process with its own result store: remove \
             results.url, or start `lookdown serve` on each server with one `lookdown count`"
        );
    }
    if settings.counts.url.is_some() {
        bail!(
            "counts.url: `lookdown run` counts in its own process: remove counts.url, or start \
             `lookdown serve`"
        );
    }
    Ok(())
}

/// Creates the folder of calibrations in an existing folder, such as a new volume: the page saves
/// calibrations there. If it cannot be created, the start names the setting.
fn create_calibrations(settings: &Settings) {
    let folder = &settings.calibrations.path;
    if folder.is_absolute() && settings.calibrations.writable {
        let _ = fs::create_dir(folder);
    }
}

/// Adds a key of this process to those of the settings, if requests need keys. It is in memory
/// only.
fn own_key(settings: &mut Settings) -> anyhow::Result<Option<Secret>> {
    if !settings.access.needs_keys() {
        return Ok(None);
    }
    let key = new_key().context("the operating system gives no random numbers")?;
    let digest = KeyDigest::new(key.as_bytes()).hexadecimal();
    let own: KeyList = format!("{OWN_KEY}:detect+read:{digest}:1").parse()?;
    settings.access.keys = own.with(std::mem::take(&mut settings.access.keys));
    Ok(Some(key.into()))
}

/// The cameras and the counts beside the server.
struct Parts {
    settings: SettingsSource,
    /// The camera of the command line.
    camera: Option<CameraEntry>,
    key: Option<Secret>,
    shutdown: Shutdown,
}

impl Parts {
    /// Serves, watches and counts. The end of one ends the others: first the cameras, then the
    /// counts, then the server.
    async fn run(self, settings: Settings, commit: Option<&str>) -> anyhow::Result<()> {
        let url = format!("http://{}", probe::reachable(settings.server.listen));
        let state = settings.state.path.clone();
        let (mut app, sockets) = serve::open(settings, commit).await?;
        let (companions, readiness) = (app.companions(), app.readiness());
        let metrics = Arc::new(Metrics::new()?);
        let stored = Arc::new(Cameras::new(
            state,
            companions.own_cameras(),
            Arc::clone(&metrics),
        ));
        app.set_cameras(&stored);
        companions.expect_counts(lookdown_count::openapi_document);
        let server = ServerOptions {
            url: url.parse()?,
            api_key: self.key.clone(),
            authorities: None,
            in_process: Some(app.in_process()),
        };
        let stop_of_server = Shutdown::default();
        let ready = readiness.clone();
        let (watched, after_watching) = watch::channel(false);
        let (counted, after_counting) = watch::channel(false);
        let serving = self.ends_all(serve::serve_app(app, sockets, stop_of_server.clone()));
        let watching = async {
            let shown = Arc::clone(&metrics);
            companions.set_metrics("cameras", move || shown.text());
            let run = (Arc::clone(&stored), server.clone());
            let watching = self.watch_when_ready(run, metrics, readiness);
            let outcome = self.ends_all(watching).await;
            let _ = watched.send(true);
            outcome
        };
        let counting = async {
            let counting = self.count(&server, &companions, after_watching);
            let outcome = self.ends_all(Box::pin(counting)).await;
            let _ = counted.send(true);
            outcome
        };
        let stopping = async {
            pass_on_stop(&self.shutdown, &ready, after_counting, &stop_of_server).await;
            std::future::pending().await
        };
        let parts = async { tokio::join!(serving, watching, counting) };
        tokio::select! {
            (first, second, third) = parts => first.and(second).and(third),
            outcome = stopping => outcome,
        }
    }

    /// Watches the cameras once the server accepts frames.
    async fn watch_when_ready(
        &self,
        run: (Arc<Cameras>, ServerOptions),
        metrics: Arc<Metrics>,
        readiness: Readiness,
    ) -> anyhow::Result<()> {
        tokio::select! {
            () = readiness.ready() => {}
            () = self.shutdown.requested() => return Ok(()),
        }
        let cameras = cameras(&self.settings, self.camera.clone(), Some(run));
        let stop = self.shutdown.requested();
        Ok(watch_cameras(Origin::Reload(cameras), metrics, stop).await?)
    }

    /// Counts until the cameras are no longer watched.
    async fn count(
        &self,
        server: &ServerOptions,
        companions: &Companions,
        after_watching: watch::Receiver<bool>,
    ) -> anyhow::Result<()> {
        let settings = counting(&self.settings, Some(server.clone()));
        let started = |started: Started| {
            companions.set_counts(started.routes, started.warning);
            companions.followed().set(started.persons);
            companions.set_metrics("counts", started.metrics);
        };
        let counts = run_counts(&settings, started, async || {
            over(after_watching.clone()).await;
        });
        Box::pin(counts).await
    }

    /// Requests the end of all parts at the end of this one.
    async fn ends_all(&self, part: impl Future<Output = anyhow::Result<()>>) -> anyhow::Result<()> {
        let outcome = part.await;
        if !self.shutdown.is_requested() {
            self.shutdown.request_without_pause();
        }
        outcome
    }
}

/// Ends the readiness with the request to stop, and passes the request on to the server when the
/// counts are stored.
async fn pass_on_stop(
    shutdown: &Shutdown,
    readiness: &Readiness,
    after_counting: watch::Receiver<bool>,
    server: &Shutdown,
) {
    shutdown.requested().await;
    readiness.stopping();
    tokio::select! {
        () = over(after_counting) => shutdown.pass_on(server),
        () = shutdown.requested_at_once() => {}
    }
    shutdown.requested_at_once().await;
    shutdown.pass_on(server);
}

/// Waits until a part is over.
async fn over(mut part: watch::Receiver<bool>) {
    // A sender that is gone means the same.
    let _ = part.wait_for(|is_over| *is_over).await;
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;
    use crate::api::Phase;

    #[tokio::test(start_paused = true)]
    async fn a_stop_ends_the_readiness_before_the_counts_end() {
        let [shutdown, server] = [(); 2].map(|()| Shutdown::default());
        let readiness = Readiness::default();
        readiness.warmed_up();
        let (counted, after_counting) = watch::channel(false);
        let checks = async {
            shutdown.request();
            tokio::time::sleep(Duration::from_secs(1)).await;
            assert_eq!(readiness.phase(), Phase::Stopping);
            assert!(!server.is_requested());
            counted.send(true).unwrap();
            server.requested().await;
        };
        tokio::select! {
            () = pass_on_stop(&shutdown, &readiness, after_counting, &server) => {}
            () = checks => {}
        }
        assert!(server.is_requested());
    }
}
