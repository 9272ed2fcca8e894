//! Refusals while the client still sends.

use std::{
    io::{Read, Write},
    net::{SocketAddr, TcpStream},
    num::NonZeroU32,
    sync::Arc,
};

use axum::{
    body::{Body, Bytes},
    http::Request,
};
use http_body_util::channel::Channel;
use lookdown::{
    access::AccessKeys,
    api::{Access, RequestRate},
};
use tokio::{net::TcpListener, task::spawn_blocking};

use crate::service::{Answer, Bounds, Service, frame};

const MAX_BODY_BYTES: usize = 10_000;

fn tight() -> Bounds {
    Bounds {
        max_body_bytes: MAX_BODY_BYTES,
        ..Bounds::default()
    }
}

fn with_keys() -> Service {
    let keys = AccessKeys::open("".parse().unwrap(), None).unwrap();
    Service::within(&Bounds {
        access: Access::Keys(Arc::new(keys)),
        ..tight()
    })
}

/// Sends a body in parts of 100 bytes; returns the number of parts that were read.
async fn send(
    service: &Service,
    request: axum::http::request::Builder,
    parts: usize,
) -> (Answer, usize) {
    let (mut sender, channel) = Channel::<Bytes, axum::Error>::new(1);
    let sending = tokio::spawn(async move {
        for part in 0..parts {
            if sender
                .send_data(Bytes::from_static(&[b'x'; 100]))
                .await
                .is_err()
            {
                return part;
            }
        }
        parts
    });
    let answer = service
        .send(request.body(Body::new(channel)).unwrap())
        .await;
    (answer, sending.await.unwrap())
}

#[tokio::test]
async fn the_body_of_a_refused_request_is_drained_on_every_route() {
    let no_key = with_keys();
    let open = Service::within(&tight());
    let rare = Service::within(&Bounds {
        request_rate: Some(RequestRate {
            per_second: 0.02,
            burst: NonZeroU32::MIN,
        }),
        ..tight()
    });
    rare.get("/calibrations").await;
    for (service, method, path, status) in [
        (&no_key, "POST", "/detect", 401),
        (&no_key, "PUT", "/calibrations/lobby", 401),
        (&no_key, "POST", "/v2/models/lookdown/infer", 401),
        (&open, "POST", "/nowhere", 404),
        (&open, "POST", "/calibrations", 405),
        (&open, "POST", "/detect", 413),
        (&open, "POST", "/v2/models/lookdown/infer", 413),
        (&open, "PUT", "/calibrations/Not-An-Id", 422),
        (&rare, "PUT", "/calibrations/lobby", 429),
    ] {
        let request = Request::builder().method(method).uri(path);
        let (answer, taken) = send(service, request, 300).await;
        assert_eq!(answer.status, status, "{method} {path}: {}", answer.text());
        answer.problem();
        assert_eq!(taken, 300, "{method} {path}");
    }
}

#[tokio::test]
async fn draining_stops_at_a_multiple_of_the_body_limit() {
    let service = Service::within(&tight());
    for path in ["/detect", "/nowhere"] {
        let (_, taken) = send(&service, Request::post(path), 1_000_000).await;
        let bytes = taken * 100;
        assert!(
            (3 * MAX_BODY_BYTES..6 * MAX_BODY_BYTES).contains(&bytes),
            "{path}: {bytes}"
        );
    }
}

#[tokio::test]
async fn expect_continue_is_answered_without_draining() {
    let service = with_keys();
    let asking = Request::post("/detect").header("expect", "100-continue");
    let (answer, taken) = send(&service, asking, 300).await;
    assert_eq!(answer.status, 401);
    assert!(taken < 5, "{taken}");
    // The client received 100 Continue and therefore sends.
    let service = Service::within(&tight());
    let asking = Request::post("/detect").header("expect", "100-continue");
    let (answer, taken) = send(&service, asking, 300).await;
    assert_eq!((answer.status.as_u16(), taken), (413, 300));
}

async fn listen(service: &Service) -> SocketAddr {
    let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
    let address = listener.local_addr().unwrap();
    let router = service.router.clone();
    tokio::spawn(async move { axum::serve(listener, router).await });
    address
}

fn rest(connection: &mut TcpStream) -> String {
    let mut answer = String::new();
    connection.read_to_string(&mut answer).unwrap();
    answer
}

#[tokio::test(flavor = "multi_thread")]
async fn a_client_that_sends_first_can_read_the_refusal() {
    let max_body_bytes = 1 << 20;
    let service = Service::within(&Bounds {
        max_body_bytes,
        ..Bounds::default()
    });
    let address = listen(&service).await;
    for (line, status) in [
        (
            "POST /detect HTTP/1.1\r\nContent-Type: multipart/form-data; boundary=b",
            413,
        ),
        ("POST /detect HTTP/1.1", 413),
        ("PUT /calibrations/lobby HTTP/1.1", 413),
        ("PUT /calibrations/Not-An-Id HTTP/1.1", 422),
        ("PUT /nowhere HTTP/1.1", 404),
    ] {
        let sent = spawn_blocking(move || {
            let mut connection = TcpStream::connect(address).unwrap();
            let length = 3 * max_body_bytes;
            write!(
                connection,
                "{line}\r\nHost: localhost\r\nConnection: close\r\nContent-Length: {length}\r\n\r\n"
            )
            .unwrap();
            connection.write_all(&vec![0; length]).unwrap();
            rest(&mut connection)
        });
        let answer = sent.await.unwrap();
        assert!(
            answer.starts_with(&format!("HTTP/1.1 {status}")),
            "{line}: {answer}"
        );
        assert!(answer.contains("/problems/"), "{answer}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn expect_continue_does_not_hang() {
    let service = Service::start();
    let address = listen(&service).await;
    let accepted = spawn_blocking(move || {
        let mut connection = TcpStream::connect(address).unwrap();
        let image = frame();
        let length = image.len();
        write!(
            connection,
            "POST /detect?calibration=lobby&profile=fast HTTP/1.1\r\nHost: localhost\r\n\
             Connection: close\r\nExpect: 100-continue\r\nContent-Length: {length}\r\n\r\n"
        )
        .unwrap();
        let mut go_on = [0; 25];
        connection.read_exact(&mut go_on).unwrap();
        assert_eq!(&go_on, b"HTTP/1.1 100 Continue\r\n\r\n");
        connection.write_all(&image).unwrap();
        rest(&mut connection)
    });
    let answer = accepted.await.unwrap();
    assert!(answer.starts_with("HTTP/1.1 200 OK"), "{answer}");

    for path in ["/nowhere", "/calibrations"] {
        let refused = spawn_blocking(move || {
            let mut connection = TcpStream::connect(address).unwrap();
            write!(
                connection,
                "DELETE {path} HTTP/1.1\r\nHost: localhost\r\nExpect: 100-continue\r\n\
                 Content-Length: 1000\r\n\r\n"
            )
            .unwrap();
            rest(&mut connection)
        });
        let answer = refused.await.unwrap();
        assert!(answer.starts_with("HTTP/1.1 40"), "{answer}");
    }
}
