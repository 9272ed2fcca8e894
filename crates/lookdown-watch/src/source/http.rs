//! Cameras over HTTP: a snapshot that is requested at an interval, or a stream of JPEG files. The
//! content type of the response decides.

use std::convert::Infallible;

use bytes::{Bytes, BytesMut};
use lookdown_common::{HttpClient, HttpError, text::with_causes};
use reqwest::{
    Response, StatusCode, Url,
    header::{AUTHORIZATION, CONTENT_TYPE, ETAG, HeaderValue, IF_NONE_MATCH},
};
use tokio::time::{MissedTickBehavior, interval};

use super::{multipart::PartReader, sink::Sink};
use crate::{Camera, MAX_FRAME_BYTES, SourceError, credentials::Login, memory_budget::Reservation};

/// Requests for one answer: the second one answers the challenge of the first.
const ATTEMPTS: usize = 2;

/// Reads frames until the camera fails.
pub(super) async fn run(
    camera: &Camera,
    url: &Url,
    client: &HttpClient,
    login: &mut Login,
    sink: &Sink<'_>,
) -> Result<Infallible, SourceError> {
    let mut entity_tag = None;
    let mut ticks = interval(camera.every());
    ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
    loop {
        ticks.tick().await;
        let response = get(client, url, login, entity_tag.as_ref()).await?;
        if response.status() == StatusCode::NOT_MODIFIED {
            sink.alive();
            continue;
        }
        let content_type = content_type(&response);
        if content_type.starts_with("multipart/") {
            return read_stream(response, &content_type, sink).await;
        }
        let is_image = content_type.is_empty() || content_type.starts_with("image/");
        if !is_image && !content_type.starts_with("application/octet-stream") {
            return Err(SourceError::ContentType(content_type));
        }
        let tag = response.headers().get(ETAG).cloned();
        sink.accept(read_image(response).await?)?;
        entity_tag = tag;
    }
}

/// Sends a request, and answers the camera's challenge.
async fn get(
    client: &HttpClient,
    url: &Url,
    login: &mut Login,
    entity_tag: Option<&HeaderValue>,
) -> Result<Response, SourceError> {
    for _ in 0..ATTEMPTS {
        let mut request = client.get(url.clone());
        if let Some(tag) = entity_tag {
            request = request.header(IF_NONE_MATCH, tag);
        }
        if let Some(authorization) = login.authorization(url) {
            request = request.header(AUTHORIZATION, authorization);
        }
        let response = client.send(request).await.map_err(unreachable)?;
        match response.status() {
            StatusCode::UNAUTHORIZED => {
                login.accept_challenge(response.headers())?;
            }
            StatusCode::NOT_MODIFIED => return Ok(response),
            status if status.is_success() => return Ok(response),
            status if status.is_redirection() => return Err(SourceError::Redirect),
            status => return Err(SourceError::Status(status.as_u16())),
        }
    }
    let user = login.user().unwrap_or_default().to_owned();
    Err(SourceError::CredentialsRefused { user })
}

/// Reads the whole image of a snapshot.
async fn read_image(mut response: Response) -> Result<Bytes, SourceError> {
    let mut image = BytesMut::new();
    let mut memory = Reservation::default();
    while let Some(chunk) = response.chunk().await.map_err(unreachable)? {
        if image.len() + chunk.len() > MAX_FRAME_BYTES {
            return Err(SourceError::TooLarge);
        }
        let bytes = image.len() + chunk.len();
        memory.resize(bytes).map_err(|_| SourceError::Memory)?;
        image.extend_from_slice(&chunk);
    }
    Ok(image.freeze())
}

/// Reads frames until the stream ends. A damaged frame is dropped.
async fn read_stream(
    mut response: Response,
    content_type: &str,
    sink: &Sink<'_>,
) -> Result<Infallible, SourceError> {
    let stream = |error: super::multipart::PartError| SourceError::Stream(error.to_string());
    let mut parts = PartReader::new(content_type, MAX_FRAME_BYTES).map_err(stream)?;
    let mut memory = Reservation::default();
    while let Some(chunk) = response.chunk().await.map_err(unreachable)? {
        let bytes = parts.buffered() + chunk.len();
        memory.resize(bytes).map_err(|_| SourceError::Memory)?;
        parts.push(&chunk);
        while let Some(image) = parts.next_part().map_err(stream)? {
            // The sink counts damaged frames.
            let _ = sink.accept(image);
        }
    }
    Err(SourceError::Closed)
}

fn content_type(response: &Response) -> String {
    let value = response.headers().get(CONTENT_TYPE);
    let value = value.and_then(|value| value.to_str().ok());
    let value: String = value.unwrap_or_default().chars().take(200).collect();
    // Boundaries are case-sensitive.
    match value.split_once(';') {
        Some((kind, parameters)) => format!("{};{parameters}", kind.trim().to_ascii_lowercase()),
        None => value.trim().to_ascii_lowercase(),
    }
}

fn unreachable(error: impl Into<HttpError>) -> SourceError {
    SourceError::Unreachable(with_causes(&error.into()))
}
