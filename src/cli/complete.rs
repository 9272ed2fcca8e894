//! Completion on the command line: the answers to a shell, whose script `lookdown completions`
//! prints.
//!
//! `lookdown completions` and `lookdown manual`: the command line for shells and as manual pages.

use std::{
    ffi::{OsStr, OsString},
    fs,
    io::{self, Write},
    path::PathBuf,
    process::ExitCode,
};

use anyhow::Context;
use clap::{Args, Command};
use clap_complete::{
    CompleteEnv, CompletionCandidate, Shell,
    engine::ArgValueCompleter,
    env::{EnvCompleter, Shells},
};
use lookdown_detect::inference::model_names;

use crate::{cli::progress::UNWRITABLE, settings};

/// The variable that the scripts set: the name of the shell.
const VARIABLE: &str = "LOOKDOWN_COMPLETE";
const NAME: &str = "lookdown";
/// The end of the script for zsh. Loaded as a function, as from a folder of completions, the script
/// must also complete the line.
const ZSH_FUNCTION: &str = "if [ \"$funcstack[1]\" = \"_lookdown\" ]; then
    _clap_dynamic_completer_lookdown \"$@\"
fi
";

/// Completes a command line for a shell that asks for it. Returns `false` if none asks.
pub(super) fn complete(
    arguments: &[OsString],
    command: impl Fn() -> Command,
) -> clap::error::Result<bool> {
    let folder = std::env::current_dir().ok();
    let completion = CompleteEnv::with_factory(command).var(VARIABLE);
    completion.try_complete(arguments, folder.as_deref())
}

/// Writes the script of a shell.
pub(super) fn write_script(shell: Shell, script: &mut Vec<u8>) -> io::Result<()> {
    let shells = Shells::builtins();
    let name = shell.to_string();
    let completer: &dyn EnvCompleter = shells
        .completer(&name)
        .ok_or_else(|| io::Error::other(format!("{name}: there are no completions")))?;
    completer.write_registration(VARIABLE, NAME, NAME, NAME, script)?;
    if shell == Shell::Zsh {
        script.extend_from_slice(ZSH_FUNCTION.as_bytes());
    }
    Ok(())
}

/// Completes the name of a model in the model repository of the default settings and variables.
pub(super) fn model_completer() -> ArgValueCompleter {
    ArgValueCompleter::new(models)
}

fn models(begun: &OsStr) -> Vec<CompletionCandidate> {
    // Without a repository there is nothing to offer.
    let settings = settings::load_with(None, settings::environment(), &[]).ok();
    let folder = settings.and_then(|settings| settings.model.find_repository().ok());
    let names = folder.map_or_else(Vec::new, |folder| model_names(&folder));
    let begun = begun.to_string_lossy();
    let names = names.into_iter().filter(|name| name.starts_with(&*begun));
    names.map(CompletionCandidate::new).collect()
}

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
    write_script(arguments.shell, &mut script).context(UNWRITABLE)?;
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
