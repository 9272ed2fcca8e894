//! `lookdown serve`

use std::process::ExitCode;

use anyhow::Context;
use tokio::{net::TcpListener, runtime, task::spawn_blocking};

use super::SettingsFile;
use crate::{
    app::{App, assemble},
    settings::Settings,
    shutdown::Shutdown,
};

/// Threads for sockets and JSON; frames have threads of their own.
const RUNTIME_THREADS: usize = 2;

/// Runs the server until it is told to stop.
pub(super) fn run(settings_file: &SettingsFile) -> anyhow::Result<ExitCode> {
    let settings = settings_file.load()?;
    let runtime = runtime::Builder::new_multi_thread()
        .worker_threads(RUNTIME_THREADS)
        .enable_all()
        .build()
        .context("the operating system gives no thread")?;
    let outcome = runtime.block_on(serve(settings));
    // Whatever still runs was given up: nobody waits for it.
    runtime.shutdown_background();
    outcome.map(|()| ExitCode::SUCCESS)
}

async fn serve(settings: Settings) -> anyhow::Result<()> {
    let shutdown = Shutdown::on_signals().context("signals cannot be handled")?;
    let address = settings.server.listen;
    let listener = TcpListener::bind(address).await.with_context(|| {
        format!("server.listen: cannot listen on {address}: set LOOKDOWN__SERVER__LISTEN to a free address")
    })?;
    let app = spawn_blocking(move || App::start(assemble(&settings)?, settings)).await??;
    app.serve(listener, shutdown).await
}
