//! Hands the followed numbers back to the server, whose number of a camera they become, and reads
//! the error bars of the server's numbers.

use std::{collections::BTreeMap, sync::Arc, time::Duration};

use lookdown_common::{LogOnce, ServerClient, read_body};
use parking_lot::Mutex;
use reqwest::{StatusCode, header::CONTENT_TYPE};
use serde::Deserialize;
use tokio::{
    sync::watch,
    time::{Instant, sleep},
};

use crate::{counter::Counter, snapshot::Snapshot};

/// Longest time for a request.
const TIMEOUT: Duration = Duration::from_secs(5);
/// An unchanged number is sent again after this time: the server forgets it after 15 s.
const REPEAT: Duration = Duration::from_secs(5);
/// The pause after a failure.
const PAUSE: Duration = Duration::from_secs(10);

/// Most bytes of the server's list of cameras: some thousand cameras.
const MAX_LIST_BYTES: usize = 4 << 20;

/// The last number that was sent for each camera, and the time.
type Sent = BTreeMap<String, (u64, Instant)>;

/// A camera of the server.
#[derive(Deserialize)]
struct CameraRow {
    camera: String,
    persons_low: Option<u64>,
    persons_high: Option<u64>,
}

/// Sends each changed number until the snapshots end.
pub(crate) async fn hand_back(
    client: ServerClient,
    mut snapshots: watch::Receiver<Snapshot>,
    counter: Arc<Mutex<Counter>>,
) {
    let (mut sent, mut log) = (Sent::new(), LogOnce::default());
    loop {
        let snapshot = snapshots.borrow_and_update().clone();
        let pause = match send(&client, &snapshot, &mut sent).await {
            Ok(()) => {
                log.clear();
                if !snapshot.cameras.is_empty()
                    && let Some(bars) = bars(&client).await
                {
                    counter.lock().set_bars(bars);
                }
                REPEAT
            }
            Err(problem) => {
                if log.should_log(&problem) {
                    tracing::warn!("the server has its own numbers of persons only: {problem}");
                }
                sleep(PAUSE).await;
                Duration::ZERO
            }
        };
        tokio::select! {
            changed = snapshots.changed() => if changed.is_err() { return },
            () = sleep(pause) => {}
        }
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

/// Sends the known numbers that are new or old.
async fn send(client: &ServerClient, snapshot: &Snapshot, sent: &mut Sent) -> Result<(), String> {
    let known = snapshot.cameras.iter();
    let known = known.filter_map(|camera| Some((camera.name.as_str(), camera.persons?)));
    for (camera, persons) in known {
        let is_sent = |&(last, at): &(u64, Instant)| last == persons && at.elapsed() < REPEAT;
        if sent.get(camera).is_some_and(is_sent) {
            continue;
        }
        let url = client.route(["results", camera, "followed"]);
        let request = client.put(url).timeout(TIMEOUT);
        let request = request.header(CONTENT_TYPE, "application/json");
        let body = format!("{{\"persons\":{persons}}}");
        let response = client.send(request.body(body)).await;
        let response = response.map_err(|error| client.failure(&error))?;
        match response.status() {
            StatusCode::NO_CONTENT => {}
            // The reports of the camera were deleted.
            StatusCode::NOT_FOUND => continue,
            StatusCode::FORBIDDEN => {
                let refusal = client.refusal(response).await;
                return Err(format!("{refusal}; give the key the scope detect, too"));
            }
            _ => return Err(client.refusal(response).await),
        }
        sent.insert(camera.to_owned(), (persons, Instant::now()));
    }
    sent.retain(|camera, _| snapshot.cameras.iter().any(|known| known.name == *camera));
    Ok(())
}
