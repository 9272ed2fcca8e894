//! The numbers of persons of a `lookdown count` on another host.

use std::{collections::BTreeMap, time::Duration};

use lookdown_common::{LogOnce, ServerClient, read_body};
use serde::Deserialize;
use tokio::{
    sync::watch,
    time::{Instant, sleep},
};

/// Interval of the requests.
const INTERVAL: Duration = Duration::from_secs(1);
/// Longest time for a request.
const TIMEOUT: Duration = Duration::from_secs(5);
/// The numbers are unknown after this time without an answer.
const VALID_FOR: Duration = Duration::from_secs(15);
/// Most bytes of an answer: several times more than the list of all cameras.
const MAX_BYTES: usize = 8 << 20;

/// Persons now, by the name of the camera.
pub type PersonsByCamera = BTreeMap<String, u64>;

/// A camera of `GET /counts`.
#[derive(Deserialize)]
struct CountedCamera {
    name: String,
    persons: Option<u64>,
}

/// Reads the numbers each second until `numbers` has no receiver.
pub async fn read_persons(client: ServerClient, numbers: watch::Sender<PersonsByCamera>) {
    let (mut log, mut answered) = (LogOnce::default(), Instant::now());
    loop {
        match read(&client).await {
            Ok(known) => {
                log.clear();
                answered = Instant::now();
                numbers.send_replace(known);
            }
            Err(problem) => {
                if log.should_log(&problem) {
                    tracing::warn!("counts.url: the numbers of persons are medians: {problem}");
                }
                if answered.elapsed() >= VALID_FOR {
                    numbers.send_replace(PersonsByCamera::new());
                }
            }
        }
        tokio::select! {
            () = numbers.closed() => return,
            () = sleep(INTERVAL) => {}
        }
    }
}

async fn read(client: &ServerClient) -> Result<PersonsByCamera, String> {
    let request = client.get(client.route(["counts"])).timeout(TIMEOUT);
    let response = client.send(request).await;
    let response = response.map_err(|error| client.failure(&error))?;
    if !response.status().is_success() {
        return Err(client.refusal(response).await);
    }
    let body = read_body(response, MAX_BYTES).await;
    let body = body.map_err(|error| client.failure(&error))?;
    let cameras: Vec<CountedCamera> = serde_json::from_slice(&body)
        .map_err(|_| format!("{} is not a `lookdown count`: correct it", client.address()))?;
    let known = cameras.into_iter();
    Ok(known
        .filter_map(|camera| Some((camera.name, camera.persons?)))
        .collect())
}
