//! Shares of clients: frames, memory of bodies, listeners and priorities.

use std::{fs, sync::Arc};

use axum::{
    body::{Body, to_bytes},
    http::Request,
};
use lookdown::{access::AccessKeys, api::Access};
use tokio::task::JoinHandle;
use tower::ServiceExt;

use crate::{
    access::line,
    service::{Answer, Bounds, Service, frame, incompressible_frame, with_host},
};

const FAST: &str = "/detect?calibration=lobby&profile=fast";
const GREEDY: &str = "lookdown_greedy";
const MODEST: &str = "lookdown_modest";

/// A service with two keys, of which `modest` may use every priority.
fn service(bounds: Bounds) -> Service {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("keys.toml");
    let scopes = "\"detect\", \"read\"";
    let modest = line("modest", scopes, MODEST).replace(" }", ", highest_priority = 1 }");
    fs::write(&file, line("greedy", scopes, GREEDY) + &modest).unwrap();
    let keys = AccessKeys::open("".parse().unwrap(), Some(&file)).unwrap();
    Service::within(&Bounds {
        access: Access::Keys(Arc::new(keys)),
        ..bounds
    })
}

fn request(method: &str, path: &str, key: &str, body: Vec<u8>) -> Request<Body> {
    let request = Request::builder().method(method).uri(path);
    let request = request.header("x-api-key", key).body(Body::from(body));
    with_host(request.unwrap())
}

async fn ask(service: &Service, path: &str, key: &str, body: Vec<u8>) -> Answer {
    service.send(request("POST", path, key, body)).await
}

/// Sends a frame without waiting for the response.
fn begin(service: &Service, key: &str, body: Vec<u8>) -> JoinHandle<u16> {
    let answer = service.router.clone();
    let answer = answer.oneshot(request("POST", FAST, key, body));
    tokio::spawn(async { answer.await.unwrap().status().as_u16() })
}

/// Waits until this number of frames is in flight.
async fn until_pending(service: &Service, count: usize) {
    let wanted = format!("lookdown_pending_frames {count}\n");
    while !service.get("/metrics").await.text().contains(&wanted) {
        tokio::task::yield_now().await;
    }
}

fn detail(answer: &Answer) -> String {
    let problem = answer.problem();
    problem["detail"].as_str().unwrap().to_owned()
}

#[tokio::test]
async fn one_key_leaves_half_of_the_queue_to_other_keys() {
    let service = service(Bounds {
        frames_in_flight: 4,
        ..Bounds::default()
    });
    service.gate.close();
    let greedy = [(); 2].map(|()| begin(&service, GREEDY, frame()));
    until_pending(&service, 2).await;
    let refused = ask(&service, FAST, GREEDY, frame()).await;
    assert_eq!(refused.status, 429);
    assert_eq!(refused.header("retry-after"), "1");
    let expected = "the key greedy uses its share of the queue already (2 of 4 frames)";
    assert!(detail(&refused).starts_with(expected), "{}", refused.text());
    let modest = begin(&service, MODEST, frame());
    until_pending(&service, 3).await;
    service.gate.open();
    for answer in greedy.into_iter().chain([modest]) {
        assert_eq!(answer.await.unwrap(), 200);
    }
}

#[tokio::test]
async fn one_key_leaves_memory_for_the_bodies_of_other_keys() {
    let image = incompressible_frame();
    let service = service(Bounds {
        max_body_bytes: image.len(),
        max_upload_bytes: image.len() * 3,
        ..Bounds::default()
    });
    service.gate.close();
    let greedy = begin(&service, GREEDY, image.clone());
    until_pending(&service, 1).await;
    let refused = ask(&service, FAST, GREEDY, image.clone()).await;
    assert_eq!(refused.status, 429);
    assert_eq!(refused.header("retry-after"), "1");
    let expected = "the key greedy uses its share of the memory for request bodies already";
    assert!(detail(&refused).starts_with(expected), "{}", refused.text());
    let modest = begin(&service, MODEST, image);
    until_pending(&service, 2).await;
    service.gate.open();
    assert_eq!((greedy.await.unwrap(), modest.await.unwrap()), (200, 200));
}

#[tokio::test]
async fn one_key_leaves_half_of_the_event_streams_to_other_keys() {
    let bounds = Bounds::default();
    let most = bounds.results.max_listeners.get();
    let service = service(bounds);
    let open = async |key| {
        let request = request("GET", "/events", key, Vec::new());
        service.router.clone().oneshot(request).await.unwrap()
    };
    let mut streams = Vec::new();
    for _ in 0..most / 2 {
        streams.push(open(GREEDY).await);
    }
    assert!(streams.iter().all(|stream| stream.status() == 200));
    for path in ["/events", "/results/lobby/latest?wait=1"] {
        let refused = service.send(request("GET", path, GREEDY, Vec::new())).await;
        assert_eq!(refused.status, 429);
        assert_eq!(refused.header("retry-after"), "1");
        let expected = "the key greedy uses its share of the listeners already";
        assert!(detail(&refused).starts_with(expected), "{}", refused.text());
    }
    assert_eq!(open(MODEST).await.status(), 200);
}

#[tokio::test]
async fn a_key_uses_only_its_permitted_priorities() {
    let service = service(Bounds::default());
    for (key, level, status) in [
        (GREEDY, 1, 403),
        (GREEDY, 3, 403),
        (GREEDY, 4, 200),
        (GREEDY, 9, 200),
        (MODEST, 1, 200),
    ] {
        let path = format!("{FAST}&priority={level}");
        let answer = ask(&service, &path, key, frame()).await;
        assert_eq!(answer.status, status, "{key} {level}: {}", answer.text());
        if status == 403 {
            let detail = detail(&answer);
            assert!(
                detail.starts_with("priority: the key greedy may use 4 to 9"),
                "{detail}"
            );
            assert_eq!(answer.problem()["parameter"], "priority");
        }
    }
}

#[tokio::test]
async fn unread_large_responses_take_the_share_of_their_client() {
    let service = service(Bounds {
        max_body_bytes: 300_000,
        max_upload_bytes: 400_000,
        ..Bounds::default()
    });
    let path = format!("{FAST}&format=image");
    let image = |key: &str| {
        let mut request = request("POST", &path, key, incompressible_frame());
        let accept = "image/png".parse().unwrap();
        request.headers_mut().insert("accept", accept);
        service.router.clone().oneshot(request)
    };
    let unread = image(GREEDY).await.unwrap();
    assert_eq!(unread.status(), 200);
    let refused = image(GREEDY).await.unwrap();
    assert_eq!(refused.status(), 429);
    let refused = to_bytes(refused.into_body(), usize::MAX).await.unwrap();
    let refused = String::from_utf8(refused.to_vec()).unwrap();
    assert!(
        refused.contains("responses that the key greedy has not read"),
        "{refused}"
    );
    // Small responses and other keys are served.
    assert_eq!(ask(&service, FAST, GREEDY, frame()).await.status, 200);
    assert_eq!(image(MODEST).await.unwrap().status(), 200);
    drop(unread);
    let read = image(GREEDY).await.unwrap();
    assert_eq!(read.status(), 200);
    let read = to_bytes(read.into_body(), usize::MAX).await.unwrap();
    assert!(read.starts_with(b"\x89PNG"));
}
