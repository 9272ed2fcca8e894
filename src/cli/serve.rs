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
use tokio::{runtime, task::spawn_blocking};

use super::SettingsFile;
use crate::{
    app::{App, Sockets, assemble},
    settings::Settings,
    shutdown::Shutdown,
};

/// Most threads for sockets and JSON. Frames have separate threads.
const MAX_RUNTIME_THREADS: usize = 2;
/// Longest time that the shutdown waits for a model that is being loaded.
const LONGEST_LOAD: Duration = Duration::from_secs(10);

/// Arguments of `lookdown serve`.
#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// Check that the server could start (settings, library, models, calibrations, keys and
    /// addresses), print the clients that would have access, and end
    #[arg(long)]
    check: bool,
    #[command(flatten)]
    settings_file: SettingsFile,
}

/// Runs the server until a stop is requested, or checks that it could run.
pub(super) fn run(arguments: &Arguments, commit: Option<&str>) -> anyhow::Result<ExitCode> {
    let settings = arguments.settings_file.load()?;
    let runtime = runtime::Builder::new_multi_thread()
        .worker_threads(runtime_threads())
        .enable_all()
        .build()
        .context("the operating system creates no thread")?;
    let outcome = if arguments.check {
        runtime.block_on(check(settings))
    } else {
        runtime.block_on(serve(settings, commit))
    };
    // Remaining tasks were aborted. But ONNX Runtime crashes the process if it ends while a model
    // is being loaded.
    runtime.shutdown_timeout(LONGEST_LOAD);
    outcome.map(|()| ExitCode::SUCCESS)
}

/// One thread per two cores: an idle second thread is woken for each request, in case more arrive.
fn runtime_threads() -> usize {
    let cores = available_parallelism().map_or(1, NonZeroUsize::get);
    (cores / 2).clamp(1, MAX_RUNTIME_THREADS)
}

async fn serve(settings: Settings, commit: Option<&str>) -> anyhow::Result<()> {
    let shutdown = Shutdown::on_signals().context("signals cannot be handled")?;
    let sockets = Sockets::bind(&settings.server).await?;
    let app = start(settings).await?;
    app.metrics().show_build(commit);
    let (tracer, at_once) = (app.tracer(), shutdown.clone());
    let outcome = app.serve(sockets, shutdown).await;
    let last_spans = spawn_blocking(move || tracer.shut_down());
    tokio::select! {
        biased;
        () = at_once.requested_at_once() => {}
        _ = last_spans => {}
    }
    outcome
}

async fn check(settings: Settings) -> anyhow::Result<()> {
    // Binds the addresses without accepting connections, and releases them at once.
    drop(Sockets::bind(&settings.server).await?);
    let app = start(settings).await?;
    let report = spawn_blocking(move || app.check()).await??;
    writeln!(io::stdout(), "{report}").context("standard output cannot be written")
}

async fn start(settings: Settings) -> anyhow::Result<App> {
    spawn_blocking(move || App::start(assemble(&settings)?, settings)).await?
}
