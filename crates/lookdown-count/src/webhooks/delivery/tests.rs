use lookdown_common::ServerOptions;
use tokio::{
    io::{AsyncReadExt, AsyncWriteExt},
    net::TcpListener,
};

use super::*;

/// Starts a server that answers each request with this status and body.
async fn server(status: &'static str, body: &'static [u8]) -> ServerClient {
    let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
    let url = format!("http://{}", listener.local_addr().unwrap());
    tokio::spawn(async move {
        while let Ok((mut stream, _)) = listener.accept().await {
            let mut head = vec![0; 4096];
            let length = stream.read(&mut head).await.unwrap();
            assert!(head[..length].starts_with(b"GET /results/hall/latest.jpg?"));
            let length = body.len();
            let head = format!("HTTP/1.1 {status}\r\ncontent-length: {length}\r\n\r\n");
            stream.write_all(head.as_bytes()).await.unwrap();
            stream.write_all(body).await.unwrap();
        }
    });
    let options = ServerOptions {
        url: url.parse().unwrap(),
        api_key: None,
        authorities: None,
        in_process: None,
    };
    ServerClient::new(&options).unwrap()
}

/// Returns `data.image` of the delivered message of a webhook.
async fn image(server: &ServerClient, webhook: &str, age_s: i64) -> Option<Value> {
    let images = Images {
        server: server.clone(),
        webhooks: Arc::new(BTreeSet::from(["with image".to_owned()])),
    };
    let message = Message {
        id: "msg_1".to_owned(),
        webhook: webhook.to_owned(),
        body: json!({ "type": "crossing", "data": { "camera": "hall" } }).to_string(),
        created_s: Timestamp::now().as_second() - age_s,
    };
    let body = images.added_to(&message).await;
    let body: Value = serde_json::from_str(&body).unwrap();
    assert_eq!(body["type"], "crossing");
    body["data"].get("image").cloned()
}

#[tokio::test]
async fn a_recent_message_has_the_image_of_its_camera() {
    let server = server("200 OK", b"\xff\xd8jpeg").await;
    let expected = json!({ "media_type": "image/jpeg", "base64": "/9hqcGVn" });
    assert_eq!(image(&server, "with image", 0).await, Some(expected));
    // The latest image would be one of another time.
    assert_eq!(image(&server, "with image", IMAGE_AGE_S + 2).await, None);
    assert_eq!(image(&server, "without", 0).await, None);
}

#[tokio::test]
async fn a_message_is_delivered_without_a_missing_image() {
    let server = server("404 Not Found", b"").await;
    assert_eq!(image(&server, "with image", 0).await, Some(Value::Null));
}
