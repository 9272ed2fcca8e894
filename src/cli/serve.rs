//! `lookdown serve`

use std::{
    io::{self, Write},
    num::NonZeroUsize,
    process::ExitCode,
    thread::available_parallelism,
    time::Duration,
};

use anyhow::Context;
use clap::Args;
use lookdown_http::Shutdown;
use tokio::{
    signal::unix::{Signal, SignalKind, signal},
    spawn,
    task::spawn_blocking,
    time::timeout,
};

use super::{SettingsFile, async_runtime::run_async, progress::UNWRITABLE, server_flags::given};
use crate::{
    app::{App, Reloader, Sockets, assemble},
    settings::Settings,
};

/// Most threads for sockets and JSON. Frames have separate threads.
const MAX_RUNTIME_THREADS: usize = 2;
/// Longest time that the end of the process waits for the last spans. They are not sent while all
/// threads for blocking work wait, as for a file system that hangs.
const LAST_SPANS: Duration = Duration::from_secs(4);

/// Arguments of `lookdown serve`.
#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// Check that the server could start (settings, library, models, calibrations, keys and
    /// addresses), print the clients that would have access, and end
    #[arg(long)]
    check: bool,
    /// IP address and port to listen on, such as 0.0.0.0:8080 (`server.listen`)
    #[arg(long, value_name = "ADDRESS:PORT")]
    listen: Option<String>,
    /// Port to listen on, at the address of `server.listen`
    #[arg(long, conflicts_with = "listen")]
    port: Option<u16>,
    #[command(flatten)]
    settings_file: SettingsFile,
}

/// Runs the server until a stop is requested, or checks that it could run.
pub(super) fn run(arguments: &Arguments, commit: Option<&str>) -> anyhow::Result<ExitCode> {
    let flags = given(&[("server.listen", arguments.listen.as_deref())]);
    let mut settings = arguments.settings_file.load_with(&flags)?;
    if let Some(port) = arguments.port {
        settings.server.listen.set_port(port);
    }
    run_async(runtime_threads(), async {
        if arguments.check {
            return check(settings).await;
        }
        let shutdown = Shutdown::on_signals().context("signals cannot be handled")?;
        serve(settings, commit, shutdown).await
    })
}

/// One thread per two cores: an idle second thread is woken for each request, in case more arrive.
fn runtime_threads() -> usize {
    let cores = available_parallelism().map_or(1, NonZeroUsize::get);
    (cores / 2).clamp(1, MAX_RUNTIME_THREADS)
}

/// Runs the server with these settings until a stop is requested.
async fn serve(settings: Settings, commit: Option<&str>, shutdown: Shutdown) -> anyhow::Result<()> {
    let (app, sockets) = open(settings, commit).await?;
    serve_app(app, sockets, shutdown).await
}

/// Binds the addresses and starts the workers. No model is loaded yet.
pub(super) async fn open(
    settings: Settings,
    commit: Option<&str>,
) -> anyhow::Result<(App, Sockets)> {
    // From now on SIGHUP does not end the process.
    let hangups = signal(SignalKind::hangup()).context("signals cannot be handled")?;
    let sockets = Sockets::bind(&settings.server).await?;
    let app = start(settings).await?;
    app.metrics().set_build(commit);
    spawn(reload_on(hangups, app.reloader()));
    Ok((app, sockets))
}

/// Serves until a stop is requested.
pub(super) async fn serve_app(
    app: App,
    sockets: Sockets,
    shutdown: Shutdown,
) -> anyhow::Result<()> {
    let (tracer, at_once) = (app.tracer(), shutdown.clone());
    let outcome = app.serve(sockets, shutdown).await;
    let last_spans = in_time(LAST_SPANS, move || tracer.shut_down());
    tokio::select! {
        biased;
        () = at_once.requested_at_once() => {}
        () = last_spans => {}
    }
    outcome
}

/// Runs blocking work, and waits for its end or for the limit.
async fn in_time(limit: Duration, work: impl FnOnce() + Send + 'static) {
    // A panic was already logged.
    let _ = timeout(limit, spawn_blocking(work)).await;
}

/// Reloads files on each signal. Signals that arrive during a reload cause one more.
async fn reload_on(mut signals: Signal, reloader: Reloader) {
    while signals.recv().await.is_some() {
        let reloader = reloader.clone();
        // A panic was already logged.
        let _ = spawn_blocking(move || reloader.reload()).await;
    }
}

/// Checks that a server could start, and prints its description.
pub(super) async fn check(settings: Settings) -> anyhow::Result<()> {
    // Binds the addresses without accepting connections, and releases them at once.
    drop(Sockets::bind(&settings.server).await?);
    let app = start(settings).await?;
    let report = spawn_blocking(move || app.check()).await??;
    writeln!(io::stdout(), "{report}").context(UNWRITABLE)
}

async fn start(settings: Settings) -> anyhow::Result<App> {
    spawn_blocking(move || App::start(assemble(&settings)?, settings)).await?
}

#[cfg(test)]
mod tests {
    use std::{sync::mpsc::sync_channel, time::Instant};

    use tokio::runtime;

    use super::{super::async_runtime::end, *};

    #[test]
    fn stuck_tasks_on_all_threads_do_not_stop_the_end() {
        let mut builder = runtime::Builder::new_multi_thread();
        let runtime = builder.max_blocking_threads(1).enable_time().build();
        let runtime = runtime.unwrap();
        let (done, stuck) = sync_channel::<()>(0);
        runtime.spawn_blocking(move || stuck.recv());
        let began = Instant::now();
        runtime.block_on(async {
            let last = in_time(Duration::from_millis(100), || {});
            let _ = timeout(Duration::from_secs(3), last).await;
        });
        end(runtime);
        assert!(began.elapsed() < Duration::from_secs(3));
        drop(done);
    }
}
