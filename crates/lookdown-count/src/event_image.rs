//! The latest image of a camera, for the message of an event.

use std::time::Duration;

use lookdown_common::{ServerClient, read_body};
use reqwest::StatusCode;

/// Longest time of a request: an event does not wait longer for its image.
const TIMEOUT: Duration = Duration::from_secs(5);
/// Widest image, pixels.
const WIDTH: &str = "960";
const JPEG_QUALITY: &str = "80";
/// Most bytes of an image.
const MAX_BYTES: usize = 512 << 10;

/// Returns the image of a camera's latest report as JPEG, with boxes; concealed if the server
/// conceals it. `None` if the server keeps none, or does not answer in time.
pub async fn latest_image(client: &ServerClient, camera: &str) -> Option<Vec<u8>> {
    let mut url = client.route(["results", camera, "latest.jpg"]);
    url.query_pairs_mut()
        .extend_pairs([("width", WIDTH), ("quality", JPEG_QUALITY)]);
    let request = async {
        let response = client.send(client.get(url)).await.ok()?;
        if response.status() != StatusCode::OK {
            return None;
        }
        read_body(response, MAX_BYTES).await.ok()
    };
    tokio::time::timeout(TIMEOUT, request).await.ok()?
}
