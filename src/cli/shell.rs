//! `lookdown completions` and `lookdown manual`: the command line for shells and as manual pages.

use std::{
    fs,
    io::{self, Write},
    path::PathBuf,
    process::ExitCode,
};

use anyhow::Context;
use clap::{Args, Command};
use clap_complete::Shell;

use crate::cli::output::UNWRITABLE;

/// Arguments of `lookdown completions`.
#[derive(Debug, Args)]
pub(super) struct CompletionArguments {
    /// The shell
    shell: Shell,
}

/// Arguments of `lookdown manual`.
#[derive(Debug, Args)]
pub(super) struct ManualArguments {
    /// Output folder of the pages; created if it is missing
    folder: PathBuf,
}

/// Prints the completions of `command` for a shell.
pub(super) fn print_completions(
    arguments: &CompletionArguments,
    mut command: Command,
) -> anyhow::Result<ExitCode> {
    let mut script = Vec::new();
    clap_complete::generate(arguments.shell, &mut command, "lookdown", &mut script);
    io::stdout().write_all(&script).context(UNWRITABLE)?;
    Ok(ExitCode::SUCCESS)
}

/// Writes a manual page for `command` and one for each command below it.
pub(super) fn write_manual(
    arguments: &ManualArguments,
    command: Command,
) -> anyhow::Result<ExitCode> {
    let folder = &arguments.folder;
    fs::create_dir_all(folder)
        .and_then(|()| clap_mangen::generate_to(command, folder))
        .with_context(|| format!("{}: the pages cannot be written", folder.display()))?;
    Ok(ExitCode::SUCCESS)
}
