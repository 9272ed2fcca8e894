//! `lookdown watch`

use std::{net::SocketAddr, path::Path, process::ExitCode, sync::Arc};

use anyhow::{Context, bail};
use clap::Args;
use lookdown_common::{ConfigError, LogOnce, Reload, ServerEntry, ServerOptions};
use lookdown_http::{Shutdown, server::bind};
use lookdown_watch::{
    CameraEntry, Metrics, Origin, WatchEntry, WatchOptions, serve_metrics, watch,
};
use parking_lot::Mutex;

use super::{
    SettingsFile,
    async_runtime::{THREADS, run_async},
    server_flags::{CameraFlags, ServerFlags, SettingsSource, is_settings_file},
};
use crate::{cameras::Cameras, settings::Settings};
use tokio_util::task::AbortOnDropHandle;

/// Arguments of `lookdown watch`.
#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// A settings file with cameras (docs/watch.md), or one camera: the URL of a JPEG snapshot, an
    /// MJPEG stream or RTSP, a folder into which images are dropped, a video file, or `-` for
    /// images on standard input
    #[arg(value_name = "SETTINGS.toml|SOURCE")]
    source: Option<String>,
    #[command(flatten)]
    camera: CameraFlags,
    #[command(flatten)]
    server: ServerFlags,
    /// The address of the metrics of the cameras, such as 127.0.0.1:9102 [default: none]
    #[arg(long, value_name = "ADDRESS")]
    metrics_listen: Option<SocketAddr>,
    #[command(flatten)]
    settings_file: SettingsFile,
}

/// Watches cameras until a stop is requested, or until the frames of a single source end.
pub(super) fn run(arguments: &Arguments) -> anyhow::Result<ExitCode> {
    let (file, source) = separate(arguments.source.as_deref())?;
    let settings = arguments
        .settings_file
        .source(file, &arguments.server.settings())?;
    let loaded = settings.load()?;
    arguments.camera.check_source(source)?;
    let origin = match source {
        Some(source) => {
            let entry = arguments.camera.entry(source, None);
            if entry.name.is_none() {
                bail!("--name: a name is missing: give a --name or a --calibration");
            }
            Origin::Fixed(WatchOptions::new(
                loaded.upstream.check()?,
                vec![entry.check("")?],
            )?)
        }
        None if loaded.lists.cameras.is_empty() => bail!(
            "cameras: there is no camera: give the URL of one, or add a [[cameras]] table with a \
             url to the settings file"
        ),
        None => Origin::Reload(cameras(&settings, None, None)),
    };
    run_async(THREADS, async {
        let shutdown = Shutdown::on_signals().context("signals cannot be handled")?;
        let metrics = Arc::new(Metrics::new()?);
        let _serving = match arguments.metrics_listen {
            Some(address) => Some(listen(address, &metrics).await?),
            None => None,
        };
        Ok(watch(origin, metrics, shutdown.requested()).await?)
    })
}

/// Separates a settings file from a source.
///
/// # Errors
/// A file of settings in another format.
pub(super) fn separate(argument: Option<&str>) -> anyhow::Result<(Option<&str>, Option<&str>)> {
    match argument {
        Some(file) if is_settings_file(file) => Ok((Some(file), None)),
        Some(file) if is_of_another_format(file) => bail!(
            "{file}: it is not a source of frames: give a settings file that ends with .toml \
             (docs/watch.md), or a source"
        ),
        source => Ok((None, source)),
    }
}

/// Returns true for the name of a file of a format in which other programs have settings.
fn is_of_another_format(argument: &str) -> bool {
    let ending = Path::new(argument).extension();
    !argument.contains("://")
        && ending.is_some_and(|ending| ["json", "yaml", "yml"].iter().any(|other| ending == *other))
}

/// Serves the metrics until the value is dropped.
async fn listen(
    address: SocketAddr,
    metrics: &Arc<Metrics>,
) -> anyhow::Result<AbortOnDropHandle<()>> {
    let listener = bind("--metrics-listen", address).await;
    let listener = listener.map_err(anyhow::Error::msg)?;
    if let Ok(address) = listener.local_addr() {
        tracing::info!("metrics at http://{address}/metrics");
    }
    let serving = tokio::spawn(serve_metrics(listener, Arc::clone(metrics)));
    Ok(AbortOnDropHandle::new(serving))
}

/// Returns the cameras of the settings and of the command line. In `lookdown run`, the stored
/// cameras are added, and its own server replaces that of the settings.
pub(super) fn cameras(
    settings: &SettingsSource,
    camera: Option<CameraEntry>,
    run: Option<(Arc<Cameras>, ServerOptions)>,
) -> Reload<WatchOptions> {
    let settings = settings.clone();
    let is_run = run.is_some();
    let read = move || {
        let mut entry = entry(settings.again()?, camera.clone());
        if is_run {
            entry.server = ServerEntry::default();
        }
        let defaults = entry.defaults.clone();
        Ok::<_, ConfigError>((entry.check()?, defaults))
    };
    let last = Mutex::new((None, LogOnce::default()));
    Reload::new(move || {
        let Some((stored, server)) = &run else {
            return Ok(read()?.0);
        };
        // A pause in the page applies while the settings file cannot be used.
        let (last, log) = &mut *last.lock();
        let (mut options, defaults) = match (read(), last.take()) {
            (Ok(settings), _) => {
                log.clear();
                settings
            }
            (Err(problem), Some(settings)) => {
                if log.should_log(&problem.to_string()) {
                    tracing::warn!("{problem}; the last valid settings stay in use");
                }
                settings
            }
            (Err(problem), None) => return Err(problem),
        };
        *last = Some((options.clone(), defaults.clone()));
        options.server = server.clone();
        stored.add_to(&mut options.cameras, &defaults)?;
        Ok(options)
    })
}

fn entry(settings: Settings, camera: Option<CameraEntry>) -> WatchEntry {
    let mut cameras = settings.lists.cameras;
    cameras.extend(camera);
    WatchEntry {
        server: settings.upstream,
        defaults: settings.lists.camera_defaults,
        cameras,
    }
}
