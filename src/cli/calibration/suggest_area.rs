//! `lookdown calibration suggest-area`: an area from the places where people walked.

use std::{
    io::{self, Write},
    process::ExitCode,
    time::Duration,
};

use anyhow::{Context, bail};
use clap::Args;
use lookdown_common::{ServerClient, read_body};
use serde::Deserialize;
use serde_json::json;

use super::walked_area::{HeatMap, walked_area};
use crate::cli::{async_runtime::of_this_thread, output::UNWRITABLE, server_flags::ServerFlags};

/// Longest time for the heat map.
const TIMEOUT: Duration = Duration::from_secs(30);
/// Largest heat map that is read, bytes.
const MAX_BYTES: usize = 16 << 20;

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

/// The grid of `GET /counts/{camera}/heatmap.json`.
#[derive(Deserialize)]
struct Answer {
    cell_m: f64,
    origin_m: [f64; 2],
    seconds: Vec<Vec<f64>>,
}

/// Prints the field `areas` of a calibration.
pub(super) fn run(arguments: &Arguments) -> anyhow::Result<ExitCode> {
    let runtime = of_this_thread()?;
    let heat_map = runtime.block_on(heat_map(arguments))?;
    let Some(corners) = walked_area(&heat_map) else {
        bail!(
            "{}: no one has walked through at least 2 m² of floor: wait until people have walked \
             where they can be, or give an earlier time with --from",
            arguments.camera
        );
    };
    eprintln!(
        "lookdown: the floor on which people walked, and 0.5 m around it: check it in Zones of the \
         web page"
    );
    let areas = json!([{ "floor_m": corners }]);
    writeln!(io::stdout(), "\"areas\": {areas}").context(UNWRITABLE)?;
    Ok(ExitCode::SUCCESS)
}

async fn heat_map(arguments: &Arguments) -> anyhow::Result<HeatMap> {
    let client = ServerClient::new(&arguments.server.entry().check()?)?;
    let camera = arguments.camera.as_str();
    let mut url = client.route(["counts", camera, "heatmap.json"]);
    if let Some(from) = &arguments.from {
        url.query_pairs_mut().append_pair("from", from);
    }
    let sent = client.send(client.get(url).timeout(TIMEOUT)).await;
    let response = sent.map_err(|error| anyhow::anyhow!(client.failure(&error)))?;
    if !response.status().is_success() {
        bail!(
            "{}: give the address of `lookdown count` with --server, such as \
             http://127.0.0.1:8090",
            client.refusal(response).await
        );
    }
    let body = read_body(response, MAX_BYTES).await?;
    let answer: Answer = serde_json::from_slice(&body)
        .with_context(|| format!("{} has sent no heat map", client.address()))?;
    Ok(HeatMap {
        cell_m: answer.cell_m,
        origin_m: answer.origin_m,
        seconds: answer.seconds,
    })
}
