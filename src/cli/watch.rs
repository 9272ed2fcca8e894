//! `lookdown watch`

use std::{
    net::SocketAddr,
    path::{Path, PathBuf},
    process::ExitCode,
    time::Duration,
};

use anyhow::{Context, bail};
use clap::{Args, builder::PossibleValuesParser};
use lookdown_detect::parameters::Profile;
use lookdown_http::Shutdown;
use lookdown_watch::{CameraEntry, Origin, Transport, WatchOptions, watch};
use strum::VariantNames;
use tokio::{runtime, time::sleep};

use super::{SettingsFile, serve, server_flags::ServerFlags};
use crate::{
    probe::{self, Probe},
    settings::Settings,
};

/// Threads for all cameras. Frames are not decoded here.
const RUNTIME_THREADS: usize = 2;
/// Interval of the checks that the server of this process is ready.
const READINESS_CHECK: Duration = Duration::from_millis(100);

/// Arguments of `lookdown watch`.
#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// A file of cameras (docs/watch.md), or one camera: the URL of a JPEG snapshot, an MJPEG stream
    /// or RTSP, a folder into which images are dropped, a video file, or `-` for images on standard
    /// input
    #[arg(value_name = "CAMERAS.toml|SOURCE")]
    source: String,
    #[command(flatten)]
    camera: CameraFlags,
    #[command(flatten)]
    server: ServerFlags,
    /// The address of the metrics of the cameras, such as 127.0.0.1:9102 [default: none]
    #[arg(long, value_name = "ADDRESS")]
    metrics_listen: Option<SocketAddr>,
    /// Also start the server in this process, with the settings of `lookdown serve`
    #[arg(long)]
    serve: bool,
    #[command(flatten)]
    settings_file: SettingsFile,
}

/// Settings of a single camera, as in a file of cameras.
#[derive(Debug, Args)]
#[group(id = "camera_flags", multiple = true)]
struct CameraFlags {
    /// The name under which the server keeps the results [default: the calibration]
    #[arg(long)]
    name: Option<String>,
    /// The ID of a calibration of the server
    #[arg(long, value_name = "ID")]
    calibration: Option<String>,
    /// The profile [default: that of the server]
    #[arg(long, value_name = "NAME", value_parser = PossibleValuesParser::new(Profile::VARIANTS))]
    profile: Option<String>,
    /// The interval between two frames, such as 500ms or 2s [default: 1s]
    #[arg(long, value_name = "DURATION")]
    every: Option<String>,
    /// Skip views without motion
    #[arg(long)]
    motion: bool,
    /// The user name of the camera
    #[arg(long, value_name = "NAME")]
    user: Option<String>,
    /// A file with the password of the camera
    #[arg(long, value_name = "FILE", requires = "user")]
    password_file: Option<PathBuf>,
    /// Start the source again after this time without a frame [default: 10s, at least 3 intervals]
    #[arg(long, value_name = "DURATION")]
    stall_after: Option<String>,
    /// Decode video in hardware: `auto`, or a method that `ffmpeg -hwaccels` lists
    #[arg(long, value_name = "METHOD")]
    hwaccel: Option<String>,
    /// Receive RTSP over UDP instead of TCP
    #[arg(long)]
    udp: bool,
    /// Decode key frames only
    #[arg(long)]
    keyframes_only: bool,
}

impl CameraFlags {
    fn entry(&self, source: &str) -> CameraEntry {
        CameraEntry {
            name: self.name.clone(),
            url: Some(source.to_owned()),
            user: self.user.clone(),
            password_file: self.password_file.clone(),
            every: self.every.clone(),
            stall_after: self.stall_after.clone(),
            calibration: self.calibration.clone(),
            profile: self.profile.clone(),
            motion: self.motion.then_some(true),
            hwaccel: self.hwaccel.clone(),
            transport: self.udp.then_some(Transport::Udp),
            keyframes_only: self.keyframes_only.then_some(true),
            ..CameraEntry::default()
        }
    }

    /// Returns true if there is a flag that belongs to a single camera.
    fn is_given(&self) -> bool {
        let Self {
            name,
            calibration,
            profile,
            every,
            motion,
            user,
            password_file,
            stall_after,
            hwaccel,
            udp,
            keyframes_only,
        } = self;
        let texts = [
            name,
            calibration,
            profile,
            every,
            user,
            stall_after,
            hwaccel,
        ];
        texts.iter().any(|text| text.is_some())
            || password_file.is_some()
            || *motion
            || *udp
            || *keyframes_only
    }
}

/// Watches cameras until a stop is requested, or until the frames of a single source end.
pub(super) fn run(arguments: &Arguments, commit: Option<&str>) -> anyhow::Result<ExitCode> {
    let settings = arguments.settings_file.load()?;
    let origin = origin(arguments, &settings)?;
    let runtime = runtime::Builder::new_multi_thread()
        .worker_threads(RUNTIME_THREADS)
        .enable_all()
        .build()
        .context("the operating system creates no thread")?;
    let outcome = runtime.block_on(async {
        let shutdown = Shutdown::on_signals().context("signals cannot be handled")?;
        let listen = arguments.metrics_listen;
        if arguments.serve {
            Box::pin(watch_and_serve(origin, listen, settings, commit, shutdown)).await
        } else {
            Ok(watch(origin, listen, shutdown.requested()).await?)
        }
    });
    // A read of standard input may never end.
    serve::end(runtime);
    outcome.map(|()| ExitCode::SUCCESS)
}

/// Serves and watches. The end of one ends the other.
async fn watch_and_serve(
    origin: Origin,
    metrics_listen: Option<SocketAddr>,
    settings: Settings,
    commit: Option<&str>,
    shutdown: Shutdown,
) -> anyhow::Result<()> {
    let serving = serve::serve(settings.clone(), commit, shutdown.clone());
    let watching = async {
        let ready = async {
            while probe::ask(&settings, Probe::Readiness).await.is_err() {
                sleep(READINESS_CHECK).await;
            }
        };
        tokio::select! {
            () = ready => {}
            () = shutdown.requested() => return Ok(()),
        }
        let outcome = watch(origin, metrics_listen, shutdown.requested()).await;
        // The end of a single source ends the server. A stop that was already requested is not
        // hastened.
        if !shutdown.is_requested() {
            shutdown.request_without_pause();
        }
        anyhow::Ok(outcome?)
    };
    let serving = async {
        let outcome = serving.await;
        if !shutdown.is_requested() {
            // The server has failed.
            shutdown.request();
        }
        outcome
    };
    let (first, second) = tokio::join!(serving, watching);
    first.and(second)
}

/// The cameras, and the server that receives their frames.
fn origin(arguments: &Arguments, settings: &Settings) -> anyhow::Result<Origin> {
    let mut server = arguments.server.entry();
    if server.url.is_none() && arguments.serve {
        server.url = Some(own_address(settings)?);
    }
    let path = Path::new(&arguments.source);
    if path.extension().is_some_and(|ending| ending == "toml") {
        if arguments.camera.is_given() {
            bail!(
                "flags of a single camera do not apply to {}: set them there, under [defaults] or \
                 [[cameras]]",
                path.display()
            );
        }
        return Ok(Origin::File(path.to_owned(), server));
    }
    let mut entry = arguments.camera.entry(&arguments.source);
    if entry.name.is_none() && entry.calibration.is_none() {
        bail!("--name: a name is missing: give a --name or a --calibration");
    }
    entry.name = entry.name.or_else(|| entry.calibration.clone());
    let camera = entry.check("")?;
    Ok(Origin::Fixed(WatchOptions::new(
        server.check()?,
        vec![camera],
    )?))
}

/// The URL of the server of this process.
fn own_address(settings: &Settings) -> anyhow::Result<String> {
    if settings.tls.is_some() {
        bail!(
            "--server: with TLS its name must be that of the certificate: give --server https://NAME:PORT"
        );
    }
    if settings.server.listen.port() == 0 {
        bail!(
            "server.listen: with port 0 the system chooses the port: set a fixed port for --serve"
        );
    }
    Ok(format!(
        "http://{}",
        probe::reachable(settings.server.listen)
    ))
}
