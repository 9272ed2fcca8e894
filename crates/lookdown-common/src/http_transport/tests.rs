use tokio::{
    io::{AsyncReadExt, AsyncWriteExt},
    net::TcpListener,
    time::timeout,
};

use super::*;

const TIMEOUT: Duration = Duration::from_secs(20);

/// Starts a peer that answers one request with these bytes, `repeated` without end.
async fn peer(first: String, repeated: &'static [u8]) -> Url {
    let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
    let port = listener.local_addr().unwrap().port();
    tokio::spawn(async move {
        let (mut connection, _) = listener.accept().await.unwrap();
        let _ = connection.read(&mut [0; 4096]).await.unwrap();
        let mut sent = connection.write_all(first.as_bytes()).await;
        while sent.is_ok() {
            sent = match repeated {
                [] => std::future::pending().await,
                bytes => connection.write_all(bytes).await,
            };
        }
    });
    format!("http://127.0.0.1:{port}/").parse().unwrap()
}

fn provisional(number: usize) -> String {
    "HTTP/1.1 100 Continue\r\n\r\n".repeat(number)
}

async fn send(url: Url, limit: Option<Duration>) -> Result<Response, HttpError> {
    let client = HttpClient::new(None).unwrap();
    let request = client.get(url);
    let request = match limit {
        Some(limit) => request.timeout(limit),
        None => request,
    };
    timeout(TIMEOUT, client.send(request)).await.unwrap()
}

#[tokio::test]
async fn endless_provisional_responses_end_the_request() {
    let url = peer(provisional(1), b"HTTP/1.1 100 Continue\r\n\r\n").await;
    let failed = send(url, None).await.unwrap_err();
    assert!(matches!(failed, HttpError::Provisional), "{failed}");
}

#[tokio::test]
async fn a_few_provisional_responses_are_skipped() {
    let head = "HTTP/1.1 200 OK\r\ncontent-length: 2\r\n\r\nok";
    let url = peer(provisional(MAX_PROVISIONAL) + head, b"").await;
    let response = send(url, None).await.unwrap();
    assert_eq!(response.text().await.unwrap(), "ok");
}

#[tokio::test]
async fn a_body_that_does_not_end_fails_at_the_timeout() {
    let head = "HTTP/1.1 200 OK\r\ncontent-length: 2\r\n\r\no".to_owned();
    let url = peer(head, b"").await;
    let response = send(url, Some(Duration::from_millis(300))).await.unwrap();
    let failed = timeout(TIMEOUT, response.text()).await.unwrap();
    assert!(with_causes(&failed.unwrap_err()).contains("within 300ms"));
}

#[test]
fn authorities_without_a_certificate_are_refused() {
    let failed = HttpClient::new(Some(b"nothing")).unwrap_err();
    assert!(failed.to_string().contains("it has no certificate"));
}
