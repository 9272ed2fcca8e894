//! The error bars of the numbers of persons, which the server knows.

use std::{collections::BTreeMap, sync::Arc, time::Duration};

use lookdown_common::{ServerClient, read_body};
use parking_lot::Mutex;
use serde::Deserialize;
use tokio::time::sleep;

use crate::counter::Counter;

/// Interval of the requests.
const INTERVAL: Duration = Duration::from_secs(5);
/// Longest time for a request.
const TIMEOUT: Duration = Duration::from_secs(5);
/// Most bytes of the server's list of cameras: some thousand cameras.
const MAX_LIST_BYTES: usize = 4 << 20;

/// A camera of the server.
#[derive(Deserialize)]
struct CameraRow {
    camera: String,
    persons_low: Option<u64>,
    persons_high: Option<u64>,
}

/// Reads the bars again and again. Without an answer, the last ones stay.
pub(crate) async fn read_bars(client: ServerClient, counter: Arc<Mutex<Counter>>) {
    loop {
        if let Some(bars) = bars(&client).await {
            counter.lock().set_bars(bars);
        }
        sleep(INTERVAL).await;
    }
}

/// Returns the bars of the server's numbers; `None` if it has none.
async fn bars(client: &ServerClient) -> Option<BTreeMap<String, [u64; 2]>> {
    let request = client.get(client.route(["results"])).timeout(TIMEOUT);
    let response = client.send(request).await.ok()?;
    let body = read_body(response, MAX_LIST_BYTES).await.ok()?;
    let rows: Vec<CameraRow> = serde_json::from_slice(&body).ok()?;
    let bars = rows
        .into_iter()
        .filter_map(|row| Some((row.camera, [row.persons_low?, row.persons_high?])));
    Some(bars.collect())
}
