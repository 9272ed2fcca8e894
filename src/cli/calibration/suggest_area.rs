//! `lookdown calibration suggest-area`: an area from the places where people walked.

use std::{
    io::{self, Write},
    process::ExitCode,
};

use anyhow::Context;
use clap::Args;
use serde::Deserialize;
use serde_json::json;

use crate::cli::{
    async_runtime::for_this_thread,
    progress::UNWRITABLE,
    server_flags::{ServerFlags, read_json},
};

/// Arguments of `lookdown calibration suggest-area`.
#[derive(Debug, Args)]
pub(in super::super) struct Arguments {
    /// The camera
    #[arg(value_name = "CAMERA")]
    camera: String,
    /// The first time that counts, such as 2026-11-22T09:00:00Z [default: a day ago]
    #[arg(long, value_name = "TIME")]
    from: Option<String>,
    #[command(flatten)]
    server: ServerFlags,
}

/// The answer of `GET /counts/{camera}/suggested-area`.
#[derive(Deserialize)]
struct SuggestedArea {
    floor_m: Vec<[f64; 2]>,
}

/// Prints the field `areas` of a calibration.
pub(super) fn run(arguments: &Arguments) -> anyhow::Result<ExitCode> {
    let area = for_this_thread()?.block_on(suggested_area(arguments))?;
    eprintln!(
        "lookdown: the floor on which people walked, and 0.5 m around it: check it in Zones of the \
         web page"
    );
    let areas = json!([{ "floor_m": area.floor_m }]);
    writeln!(io::stdout(), "\"areas\": {areas}").context(UNWRITABLE)?;
    Ok(ExitCode::SUCCESS)
}

async fn suggested_area(arguments: &Arguments) -> anyhow::Result<SuggestedArea> {
    let client = arguments.server.client()?;
    let mut url = client.route(["counts", &arguments.camera, "suggested-area"]);
    if let Some(from) = &arguments.from {
        url.query_pairs_mut().append_pair("from", from);
    }
    read_json(&client, url, "suggested area").await
}
