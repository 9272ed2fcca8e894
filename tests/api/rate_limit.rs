//! Rate limits.

use std::{
    io::{Read, Write},
    net::SocketAddr,
    num::NonZeroU32,
    sync::Arc,
};

use axum::{body::Body, http::Request};
use lookdown::{
    access::{AccessKeys, KeyDigest},
    api::{Access, RequestRate},
};
use tokio::{net::TcpSocket, task::spawn_blocking};

use crate::{
    server::Server,
    service::{Answer, Bounds, OPEN_PATHS, Service, frame},
};

/// Two requests, and the next one after 50 seconds, longer than any test.
const TWO: Option<RequestRate> = Some(RequestRate {
    per_second: 0.02,
    burst: NonZeroU32::new(2).unwrap(),
});

fn open_service() -> Service {
    Service::within(&Bounds {
        request_rate: TWO,
        ..Bounds::default()
    })
}

async fn ask(service: &Service, path: &str, from: &str, key: Option<&str>) -> Answer {
    let mut request = Request::get(path);
    if let Some(key) = key {
        request = request.header("x-api-key", key);
    }
    let mut request = request.body(Body::empty()).unwrap();
    let address: SocketAddr = from.parse().unwrap();
    request.extensions_mut().insert(address);
    service.send(request).await
}

#[tokio::test]
async fn too_many_requests_are_refused_with_retry_after() {
    let service = open_service();
    for left in [1, 0] {
        let answer = ask(&service, "/calibrations", "192.0.2.1:1000", None).await;
        assert_eq!(answer.status, 200);
        assert_eq!(answer.header("ratelimit-policy"), "\"default\";q=2;w=100");
        let reported = answer.header("ratelimit");
        assert_eq!(reported, format!("\"default\";r={left};t=50"));
    }
    let refused = ask(&service, "/calibrations", "192.0.2.1:2000", None).await;
    assert_eq!(refused.status, 429);
    assert_eq!(refused.problem()["type"], "/problems/rate-limited");
    assert_eq!(refused.header("retry-after"), "50");
    assert_eq!(refused.header("ratelimit"), "\"default\";r=0;t=50");
    let other = ask(&service, "/calibrations", "192.0.2.2:1000", None).await;
    assert_eq!(other.status, 200);
}

#[tokio::test]
async fn every_client_route_counts_and_reports_the_limit() {
    let service = Service::within(&Bounds {
        request_rate: Some(RequestRate {
            per_second: 0.02,
            burst: NonZeroU32::new(100).unwrap(),
        }),
        ..Bounds::default()
    });
    let mut left = 100;
    for answer in [
        service
            .post_raw("calibration=lobby&profile=fast", frame())
            .await,
        service.get("/calibrations/missing").await,
        service.get("/calibrations/lobby/views").await,
        service.put("/calibrations/lobby", "nonsense").await,
        service.get("/v2/models/lookdown/ready").await,
        service.post("/v2/models/lookdown/infer", "").await,
    ] {
        left -= 1;
        let reported = answer.header("ratelimit");
        assert!(reported.contains(&format!("r={left};")), "{reported}");
    }
}

#[tokio::test]
async fn health_checks_metrics_and_pages_are_not_counted() {
    let service = open_service();
    for _ in 0..3 {
        for path in OPEN_PATHS {
            let answer = service.get(path).await;
            assert!(answer.status.as_u16() < 400, "{path}");
            assert!(!answer.headers.contains_key("ratelimit"), "{path}");
        }
    }
}

#[tokio::test]
async fn each_key_has_its_own_rate_and_invalid_keys_share_the_address() {
    let digest = |key: &str| KeyDigest::new(key.as_bytes()).hexadecimal();
    let [gate, office] = [digest("gate-key"), digest("office-key")];
    let keys = format!("gate:read:{gate},office:read:{office}").parse();
    let keys = AccessKeys::open(keys.unwrap(), None).unwrap();
    let service = Service::within(&Bounds {
        request_rate: TWO,
        access: Access::Keys(Arc::new(keys)),
        ..Bounds::default()
    });
    let mut statuses = Vec::new();
    for (from, key) in [
        ("192.0.2.1:1", "gate-key"),
        ("192.0.2.2:1", "gate-key"),
        ("192.0.2.3:1", "gate-key"),
        ("192.0.2.1:1", "office-key"),
        ("192.0.2.1:1", "a-guess"),
        ("192.0.2.1:1", "another"),
        ("192.0.2.1:1", "a-third"),
        ("192.0.2.1:1", "office-key"),
    ] {
        let answer = ask(&service, "/calibrations", from, Some(key)).await;
        statuses.push(answer.status.as_u16());
    }
    assert_eq!(statuses, [200, 200, 429, 200, 401, 401, 429, 200]);
}

#[tokio::test]
async fn without_the_setting_nothing_is_counted() {
    let service = Service::start();
    for _ in 0..100 {
        let answer = service.get("/calibrations").await;
        assert_eq!(answer.status, 200);
        assert!(!answer.headers.contains_key("ratelimit"));
    }
}

/// Returns the status of the response to a new connection from an address of the loopback
/// interface.
async fn asked_from(source: &str, server: SocketAddr) -> String {
    let socket = TcpSocket::new_v4().unwrap();
    socket.bind(format!("{source}:0").parse().unwrap()).unwrap();
    let connection = socket.connect(server).await.unwrap().into_std().unwrap();
    connection.set_nonblocking(false).unwrap();
    let exchange = spawn_blocking(move || {
        let mut connection = connection;
        let head = "GET /calibrations HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n";
        connection.write_all(head.as_bytes()).unwrap();
        let mut answer = String::new();
        connection.read_to_string(&mut answer).unwrap();
        answer
    });
    exchange.await.unwrap().chars().take(12).collect()
}

#[tokio::test(flavor = "multi_thread")]
async fn clients_are_distinguished_by_their_connection_address() {
    let server = Server::start(&[
        ("LIMITS__REQUESTS_PER_SECOND", "0.02"),
        ("LIMITS__REQUEST_BURST", "1"),
    ])
    .await;
    for (source, status) in [("127.0.0.1", 200), ("127.0.0.1", 429), ("127.0.0.2", 200)] {
        let reported = asked_from(source, server.address).await;
        assert_eq!(reported, format!("HTTP/1.1 {status}"), "{source}");
    }
}
