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

use crate::cli::{complete, output::UNWRITABLE};

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

/// Prints the script that completes the command line in a shell. It calls this program.
pub(super) fn print_completions(arguments: &CompletionArguments) -> anyhow::Result<ExitCode> {
    let mut script = Vec::new();
    complete::write_script(arguments.shell, &mut script).context(UNWRITABLE)?;
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
