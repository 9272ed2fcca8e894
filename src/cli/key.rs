//! `lookdown key`

use std::{
    io::{self, Write},
    process::ExitCode,
};

use anyhow::Context;
use clap::{Args, Subcommand};
use lookdown_detect::fairness::PriorityLevel;

use super::parameters::one_of;
use crate::access::{KeyDigest, KeyName, Scope, Scopes, new_key};
use crate::cli::progress::UNWRITABLE;

#[derive(Debug, Subcommand)]
pub(super) enum Command {
    /// Create an API key, and the line for `access.keys_file` that registers it
    New(Arguments),
}

#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// Name of the key: 1 to 64 of a-z, 0-9, _ and -
    #[arg(long)]
    name: KeyName,
    /// A scope of the key; may be given several times
    #[arg(long = "scope", required = true, value_name = "SCOPE", value_parser = one_of::<Scope>())]
    scopes: Vec<Scope>,
    /// Highest priority of its requests, 1 (highest) to 9 [default: 5]
    #[arg(long, value_name = "NUMBER")]
    priority: Option<PriorityLevel>,
}

/// Runs the subcommand.
pub(super) fn run(command: &Command) -> anyhow::Result<ExitCode> {
    let Command::New(Arguments {
        name,
        scopes,
        priority,
    }) = command;
    let key = new_key().context("the operating system returns no random numbers")?;
    let scopes = Scopes::new(scopes).context("--scope: give one")?;
    let digest = KeyDigest::new(key.as_bytes()).hexadecimal();
    let quoted = scopes.joined("\", \"");
    let in_file = priority.map(|level| format!(", highest_priority = {level}"));
    let in_file = in_file.unwrap_or_default();
    let in_entry = priority
        .map(|level| format!(":{level}"))
        .unwrap_or_default();
    let written = writeln!(
        io::stdout(),
        "# The key. It is shown only once. Clients send it as Authorization: Bearer KEY.\n\
         {key}\n\
         # The line for access.keys_file, which does not contain the key:\n\
         {name} = {{ scopes = [\"{quoted}\"], sha256 = \"{digest}\"{in_file} }}\n\
         # The same for LOOKDOWN__ACCESS__KEYS:\n\
         {name}:{}:{digest}{in_entry}",
        scopes.joined("+"),
    );
    written.context(UNWRITABLE)?;
    Ok(ExitCode::SUCCESS)
}
