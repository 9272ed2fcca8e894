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
async fn connections_beyond_the_limit_wait_for_a_free_one() {
    let server = Server::start(&[
        ("SERVER__MAX_CONNECTIONS", "2"),
        ("SERVER__METRICS_LISTEN", "127.0.0.1:0"),
    ])
    .await;
    let held = [server.connect_and_ask(), server.connect_and_ask()];
    let request = b"GET /livez HTTP/1.1\r\nHost: lookdown\r\nConnection: close\r\n\r\n";
    let waiting = server.connect(request);
    for path in ["/livez", "/readyz", "/metrics"] {
        let answer = crate::server::get(server.metrics_address, path).await;
        assert!(answer.contains("200 OK"), "{answer}");
    }
    drop(held);
    let answer = rest_of(waiting).await;
    assert!(answer.contains("200 OK"), "{answer}");
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
