//! Limits of connections and of request heads.

use crate::server::{Server, rest_of};

/// A request with this number of headers of this size, besides `Host`.
fn with_headers(count: usize, bytes: usize) -> String {
    let value = "v".repeat(bytes - 9);
    let headers: Vec<_> = (0..count)
        .map(|index| format!("X-{index:03}: {value}\r\n"))
        .collect();
    let headers = headers.concat();
    format!("GET /livez HTTP/1.1\r\nHost: lookdown\r\nConnection: close\r\n{headers}\r\n")
}

#[tokio::test(flavor = "multi_thread")]
async fn too_large_heads_are_refused_with_431() {
    let server = Server::start(&[
        ("SERVER__MAX_HEADERS", "100"),
        ("SERVER__MAX_HEADER_BYTES", "4096"),
    ])
    .await;
    let answer = async |count, bytes| {
        let request = with_headers(count, bytes);
        rest_of(server.connect(request.as_bytes())).await
    };
    for (count, bytes) in [(98, 20), (1, 3900)] {
        let answer = answer(count, bytes).await;
        assert!(answer.contains("200 OK"), "{answer}");
    }
    for (count, bytes) in [(99, 20), (197, 20), (1, 4100), (2, 4000)] {
        let answer = answer(count, bytes).await;
        let status = "431 Request Header Fields Too Large";
        assert!(answer.contains(status), "{count} × {bytes}: {answer}");
        assert!(
            answer.contains("/problems/headers-too-large"),
            "{count} × {bytes}: {answer}"
        );
    }
    for (count, bytes) in [(300, 12), (1, 10_000), (10, 100_000)] {
        let answer = answer(count, bytes).await;
        let status = "431 Request Header Fields Too Large";
        assert!(answer.contains(status), "{count} × {bytes}: {answer}");
    }
    server.shows("connections", 0).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn beyond_the_connection_limit_only_health_checks_succeed() {
    let server = Server::start(&[("SERVER__MAX_CONNECTIONS", "2")]).await;
    let held = [server.connect_and_ask(), server.connect_and_ask()];
    for path in ["/livez", "/readyz", "/metrics"] {
        let answer = server.get(path).await;
        assert!(answer.contains("200 OK"), "{answer}");
        assert!(answer.contains("\r\nconnection: close\r\n"), "{answer}");
    }
    let refused = server.detect().await.unwrap().unwrap();
    for part in [
        "503 Service Unavailable",
        "/problems/too-many-connections",
        "\r\nretry-after: 1\r\n",
        "\r\nconnection: close\r\n",
    ] {
        assert!(refused.contains(part), "{refused}");
    }
    // More than the socket buffers hold: the client only reads the response if the server drains
    // the body.
    let large = vec![0; 16 << 20];
    let post = format!("POST /detect HTTP/1.1\r\nContent-Length: {}", large.len());
    let refused = server.exchange(&post, large).await.unwrap().unwrap();
    assert!(refused.contains("too-many-connections"), "{refused}");

    drop(held);
    while !server.detect().await.unwrap().unwrap().contains("200 OK") {}
}

#[tokio::test(flavor = "multi_thread")]
async fn silent_connections_do_not_delay_health_checks() {
    // The header timeout is far longer than this test: silent connections must not delay a health
    // check.
    let chosen = [
        ("SERVER__MAX_CONNECTIONS", "1"),
        ("SERVER__HEADER_TIMEOUT_MILLIS", "600000"),
    ];
    let server = Server::start(&chosen).await;
    let regular = server.connect_and_ask();
    let silent: Vec<_> = (0..600).map(|_| server.connect(b"")).collect();
    assert!(server.get("/livez").await.contains("200 OK"));
    for connection in silent {
        assert_eq!(rest_of(connection).await, "");
    }
    drop(regular);
    server.shows("connections", 0).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn the_metrics_port_serves_metrics_and_health_checks_only() {
    let server = Server::start(&[("SERVER__METRICS_LISTEN", "127.0.0.1:0")]).await;
    let get = async |path| crate::server::get(server.metrics_address, path).await;
    for path in ["/metrics", "/livez", "/readyz"] {
        assert!(get(path).await.contains("200 OK"), "{path}");
    }
    for path in ["/detect", "/calibrations", "/openapi.json", "/docs/", "/"] {
        let answer = get(path).await;
        assert!(answer.contains("404 Not Found"), "{path}: {answer}");
        assert!(answer.contains("/problems/not-found"), "{path}");
    }
    assert!(server.get("/metrics").await.contains("404 Not Found"));
    for path in ["/livez", "/readyz", "/calibrations", "/openapi.json"] {
        assert!(server.get(path).await.contains("200 OK"), "{path}");
    }
}
