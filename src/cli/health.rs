//! `lookdown health`

use std::{
    io::{self, Write},
    process::ExitCode,
};

use anyhow::Context;
use clap::Args;

use super::{SettingsFile, async_runtime::for_this_thread, progress::UNWRITABLE};
use crate::probe::{self, Probe};

/// Arguments of `lookdown health`.
#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// Check liveness (/livez) instead of readiness (/readyz)
    #[arg(long)]
    live: bool,
    #[command(flatten)]
    settings_file: SettingsFile,
}

/// Checks the server that runs with these settings.
pub(super) fn run(arguments: &Arguments) -> anyhow::Result<ExitCode> {
    let settings = arguments.settings_file.load()?;
    let probe = if arguments.live {
        Probe::Liveness
    } else {
        Probe::Readiness
    };
    let runtime = for_this_thread()?;
    let url = runtime.block_on(probe::ask(&settings, probe))?;
    writeln!(io::stdout(), "{url} answered yes").context(UNWRITABLE)?;
    Ok(ExitCode::SUCCESS)
}
