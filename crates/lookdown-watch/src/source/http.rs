//! Cameras over HTTP: a snapshot that is requested at an interval, or a stream of JPEG files. The
//! content type of the response decides.

use std::{convert::Infallible, time::Duration};

use bytes::{Bytes, BytesMut};
use lookdown_common::{
    HttpClient, HttpError, JPEG_START,
    text::{one_line, with_causes},
};
use reqwest::{
    Response, StatusCode, Url,
    header::{AUTHORIZATION, CONTENT_TYPE, ETAG, HeaderValue, IF_NONE_MATCH},
};
use tokio::time::{MissedTickBehavior, interval, timeout};

use super::{multipart::PartReader, sink::Sink};
use crate::{Camera, MAX_FRAME_BYTES, SourceError, credentials::Login, memory_budget::Reservation};

/// Most characters of a camera's text in an error.
const SHOWN_CHARS: usize = 60;
/// Longest wait for that text.
const WORDS_TIMEOUT: Duration = Duration::from_secs(1);
/// Bytes that show what a response is: the boundary of a part or the start of an image.
const BEGIN_BYTES: usize = 4;
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
        let mut response = get(client, url, login, entity_tag.as_ref()).await?;
        if response.status() == StatusCode::NOT_MODIFIED {
            sink.alive();
            continue;
        }
        let content_type = content_type(&response);
        let begin = begin(&mut response).await?;
        let is_jpeg = begin.starts_with(JPEG_START);
        let is_stream = content_type.starts_with("multipart/")
            || (is_jpeg && content_type.starts_with("video/"));
        let is_unknown =
            content_type.is_empty() || content_type.starts_with("application/octet-stream");
        // An image is one whatever its label is.
        if !is_stream && !is_unknown && !is_jpeg && !content_type.starts_with("image/") {
            let shown = shown(response, begin, content_type).await;
            return Err(SourceError::ContentType(shown));
        }
        // A part of a stream begins with a boundary, whatever the response is called.
        if is_stream || (is_unknown && begin.trim_ascii_start().starts_with(b"--")) {
            read_stream(response, begin, &content_type, sink).await?;
            continue;
        }
        let tag = response.headers().get(ETAG).cloned();
        sink.accept(read_image(response, begin).await?)?;
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
    let request = |login: &mut Login| {
        let mut request = client.get(url.clone());
        if let Some(tag) = entity_tag {
            request = request.header(IF_NONE_MATCH, tag);
        }
        if let Some(authorization) = login.authorization(url) {
            request = request.header(AUTHORIZATION, authorization);
        }
        request
    };
    for attempt in 0..ATTEMPTS {
        let response = match client.send(request(login)).await {
            // Cameras close the connection of a 401 without an announcement.
            Err(_) if attempt > 0 => client.send(request(login)).await,
            sent => sent,
        };
        let response = response.map_err(unreachable)?;
        match response.status() {
            StatusCode::UNAUTHORIZED => {
                login.accept_challenge(response.headers())?;
            }
            StatusCode::NOT_MODIFIED => return Ok(response),
            status if status.is_success() => return Ok(response),
            status if status.is_redirection() => return Err(SourceError::Redirect),
            status @ (StatusCode::SERVICE_UNAVAILABLE | StatusCode::TOO_MANY_REQUESTS) => {
                return Err(SourceError::Busy(status.as_u16()));
            }
            status => {
                let shown = shown(response, BytesMut::new(), status.as_u16().to_string()).await;
                return Err(SourceError::Status(shown));
            }
        }
    }
    let user = login.user().unwrap_or_default().to_owned();
    Err(SourceError::CredentialsRefused { user })
}

/// Describes a response without an image: its media type or status, and the first words of a text.
async fn shown(mut response: Response, begin: BytesMut, kind: String) -> String {
    let media_type = content_type(&response);
    let is_text = media_type.starts_with("text/") || media_type.contains("json");
    let mut text = begin.freeze();
    if is_text && text.is_empty() {
        // A camera may keep the connection open after its answer.
        let chunk = timeout(WORDS_TIMEOUT, response.chunk()).await;
        text = chunk
            .ok()
            .and_then(Result::ok)
            .flatten()
            .unwrap_or_default();
    }
    let text = String::from_utf8_lossy(if is_text { &text[..] } else { b"" });
    let words: String = one_line(text.trim()).chars().take(SHOWN_CHARS).collect();
    if words.is_empty() {
        return kind;
    }
    format!("{kind}: {words}")
}

/// Reads the first bytes of a response, which show what it is.
async fn begin(response: &mut Response) -> Result<BytesMut, SourceError> {
    let mut bytes = BytesMut::new();
    while bytes.len() < BEGIN_BYTES {
        let Some(chunk) = response.chunk().await.map_err(unreachable)? else {
            break;
        };
        bytes.extend_from_slice(&chunk);
    }
    Ok(bytes)
}

/// Reads the whole image of a snapshot after its first bytes.
async fn read_image(mut response: Response, mut image: BytesMut) -> Result<Bytes, SourceError> {
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

/// Reads frames until the stream ends. A damaged frame is dropped. An image with the label of a
/// stream may end.
async fn read_stream(
    mut response: Response,
    begin: BytesMut,
    content_type: &str,
    sink: &Sink<'_>,
) -> Result<(), SourceError> {
    let mut parts = PartReader::new(content_type, MAX_FRAME_BYTES);
    let mut memory = Reservation::default();
    let mut is_received = false;
    let mut chunk = Some(begin.freeze());
    let is_image = chunk
        .as_ref()
        .is_some_and(|begin| begin.starts_with(JPEG_START));
    while let Some(received) = chunk {
        let bytes = parts.buffered() + received.len();
        memory.resize(bytes).map_err(|_| SourceError::Memory)?;
        parts.push(&received);
        while let Some(image) = parts.next_part()? {
            // The sink counts damaged frames.
            is_received |= sink.accept(image).is_ok();
        }
        chunk = response.chunk().await.map_err(unreachable)?;
    }
    if is_image && is_received {
        return Ok(());
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

#[cfg(test)]
mod tests {
    use tokio::{
        io::{AsyncBufReadExt, AsyncWriteExt, BufReader},
        net::TcpListener,
    };

    use super::*;
    use crate::{CameraEntry, Credentials};

    const CHALLENGE: &str = "HTTP/1.1 401 Unauthorized\r\nContent-Length: 0\r\n\
        WWW-Authenticate: Digest realm=\"cam\", qop=\"auth\", nonce=\"abc\"\r\n\r\n";

    /// Requests the image of a camera that closes its connection after each of these answers.
    async fn answer(answers: &'static [&'static str]) -> Result<Response, SourceError> {
        let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
        let url = format!("http://{}/snap.jpg", listener.local_addr().unwrap());
        tokio::spawn(async move {
            for answer in answers {
                let (stream, _) = listener.accept().await.unwrap();
                let mut lines = BufReader::new(stream).lines();
                while lines.next_line().await.unwrap() != Some(String::new()) {}
                lines.get_mut().write_all(answer.as_bytes()).await.unwrap();
            }
        });
        let mut login = Login::new(Some(Credentials {
            user: "viewer".to_owned(),
            password: "geheim".into(),
        }));
        let client = HttpClient::new(None).unwrap();
        get(&client, &url.parse().unwrap(), &mut login, None).await
    }

    #[tokio::test]
    async fn a_connection_that_ends_with_the_challenge_is_replaced() {
        for _ in 0..20 {
            let image = "HTTP/1.1 200 OK\r\nContent-Length: 0\r\n\r\n";
            let answers: &'static [&'static str] = Box::leak(Box::new([CHALLENGE, image]));
            let answer = answer(answers).await;
            assert_eq!(answer.unwrap().status(), StatusCode::OK);
        }
    }

    /// Reads the first frame of a camera whose response has these headers and this body.
    async fn first_frame_of(headers: &'static str, body: Vec<u8>) -> Result<Bytes, SourceError> {
        let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
        let url = format!("http://{}/snap.jpg", listener.local_addr().unwrap());
        tokio::spawn(async move {
            let (stream, _) = listener.accept().await.unwrap();
            let mut lines = BufReader::new(stream).lines();
            while lines.next_line().await.unwrap() != Some(String::new()) {}
            let head = format!("HTTP/1.1 200 OK\r\nConnection: close\r\n{headers}\r\n");
            let stream = lines.get_mut();
            stream
                .write_all(&[head.as_bytes(), &body].concat())
                .await
                .unwrap();
            // The rest of the stream never comes.
            std::future::pending::<()>().await;
        });
        let entry = CameraEntry {
            name: Some("hall".to_owned()),
            url: Some(url),
            ..CameraEntry::default()
        };
        let camera = entry.check("").unwrap();
        let frame = crate::first_frame(&camera, Duration::from_secs(20)).await?;
        Ok(frame.image)
    }

    #[tokio::test]
    async fn streams_and_images_are_told_by_their_first_bytes() {
        let jpeg = b"\xff\xd8\xff\xda\x00\x02xyz\xff\xd9".to_vec();
        let part = [b"--b\r\nContent-Length: 11\r\n\r\n".as_slice(), &jpeg].concat();
        let multipart = "Content-Type: multipart/x-mixed-replace;boundary=b\r\n";
        let motion_jpeg = "Content-Type: video/x-motion-jpeg\r\n";
        let without_boundary = "Content-Type: multipart/x-mixed-replace\r\n";
        for (headers, body) in [
            ("", &part),
            ("Content-Type: application/octet-stream\r\n", &part),
            (without_boundary, &part),
            (multipart, &part),
            (multipart, &jpeg),
            (motion_jpeg, &jpeg),
            (motion_jpeg, &[&jpeg[..], &jpeg[..]].concat()),
        ] {
            let image = first_frame_of(headers, body.clone()).await;
            assert_eq!(image.unwrap(), jpeg, "{headers}");
        }
        let label = "Content-Type: text/html\r\nContent-Length: 11\r\n";
        assert_eq!(first_frame_of(label, jpeg.clone()).await.unwrap(), jpeg);
    }

    #[tokio::test]
    async fn a_busy_camera_and_its_own_words_are_shown() {
        let busy = answer(&["HTTP/1.1 503 Busy\r\nContent-Length: 0\r\n\r\n"]).await;
        assert!(
            busy.unwrap_err()
                .to_string()
                .starts_with("the camera is busy (status 503)")
        );
        let page = "Content-Type: text/html\r\n";
        let other = first_frame_of(page, b"please\nlogin first!!".to_vec()).await;
        let other = other.unwrap_err().to_string();
        assert!(other.contains("text/html: please login first!!"), "{other}");
        let locked =
            "HTTP/1.1 403 No\r\nContent-Type: text/plain\r\nContent-Length: 6\r\n\r\nlocked";
        let locked = answer(Box::leak(Box::new([locked]))).await.unwrap_err();
        let locked = locked.to_string();
        assert!(
            locked.contains("the status \"403: locked\": check"),
            "{locked}"
        );
    }
}
