//! Streams of reports: server-sent events.

use std::{io::Read, time::Duration};

use axum::{body::Body, http::Request, response::Response};
use http_body_util::BodyExt;
use tokio::time::{Instant, timeout};
use tower::ServiceExt;

use crate::{
    server::{Server, rest_of},
    service::{Service, with_host},
};

const EVENTS: &str = "/results/lobby/events";
/// More reports than one read fetches, and more than wait for one subscriber.
const MANY: usize = 100;

/// A stream of events.
pub(crate) struct Stream(Response);

impl Stream {
    async fn open(service: &Service, path: &str, last_heard: Option<&str>) -> Self {
        let header = last_heard.map(|id| ("last-event-id", id));
        Self::open_with(service, path, header).await
    }

    pub(crate) async fn open_with(
        service: &Service,
        path: &str,
        header: Option<(&str, &str)>,
    ) -> Self {
        let mut request = Request::get(path);
        if let Some((name, value)) = header {
            request = request.header(name, value);
        }
        let request = request.body(Body::empty()).unwrap();
        let response = service
            .router
            .clone()
            .oneshot(with_host(request))
            .await
            .unwrap();
        assert_eq!(response.status(), 200);
        Self(response)
    }

    /// Returns the next event or comment; `None` at the end.
    pub(crate) async fn next(&mut self) -> Option<String> {
        let frame = self.0.body_mut().frame().await?;
        let bytes = frame.unwrap().into_data().unwrap();
        Some(String::from_utf8(bytes.to_vec()).unwrap())
    }

    /// Returns the data of the next event, which is a number.
    pub(crate) async fn number(&mut self) -> usize {
        let event = self.next().await.unwrap();
        let data = event.lines().find_map(|line| line.strip_prefix("data: "));
        data.unwrap().parse().unwrap()
    }
}

#[tokio::test]
async fn a_stream_has_the_latest_report_and_then_each_new_one() {
    let service = Service::start();
    service.publish("lobby", 1);
    let first = service.publish("lobby", 2);
    let mut stream = Stream::open(&service, EVENTS, None).await;
    let headers = stream.0.headers();
    for (name, value) in [
        ("content-type", "text/event-stream"),
        ("cache-control", "no-cache"),
        ("x-accel-buffering", "no"),
    ] {
        assert_eq!(headers[name], value);
    }
    service.publish("hall", 3);
    let second = service.publish("lobby", 4);
    assert_eq!(
        stream.next().await.unwrap(),
        format!("id: {first}\ndata: 2\n\n")
    );
    assert_eq!(
        stream.next().await.unwrap(),
        format!("id: {second}\ndata: 4\n\n")
    );
}

#[tokio::test]
async fn the_stream_of_all_cameras_begins_with_the_latest_of_each() {
    let service = Service::start();
    for (camera, number) in [("lobby", 1), ("hall", 2), ("lobby", 3)] {
        service.publish(camera, number);
    }
    let mut stream = Stream::open(&service, "/events", None).await;
    service.publish("stairs", 4);
    service.publish("lobby", 5);
    for number in 2..=5 {
        assert_eq!(stream.number().await, number);
    }
}

#[tokio::test]
async fn a_reconnected_client_receives_missed_reports_once() {
    let service = Service::start();
    let mut ids = Vec::new();
    for number in 0..MANY {
        ids.push(service.publish("lobby", number).to_string());
        service.publish("hall", MANY + number);
    }
    let mut stream = Stream::open(&service, EVENTS, Some(&ids[9])).await;
    service.publish("lobby", MANY);
    for number in 10..MANY {
        assert_eq!(stream.number().await, number);
    }
    service.publish("lobby", MANY + 1);
    assert_eq!(stream.number().await, MANY);
    assert_eq!(stream.number().await, MANY + 1);

    let mut up_to_date = Stream::open(&service, EVENTS, Some(&ids[MANY - 1])).await;
    assert_eq!(up_to_date.number().await, MANY);
}

#[tokio::test]
async fn an_unknown_last_event_id_begins_with_the_latest_report() {
    let service = Service::start();
    service.publish("lobby", 1);
    service.publish("lobby", 2);
    for stranger in ["18446744073709551615", "cam-7", "\u{e9}"] {
        let mut stream = Stream::open(&service, EVENTS, Some(stranger)).await;
        assert_eq!(stream.number().await, 2, "{stranger}");
        let id = service.publish("lobby", 2);
        let next = stream.next().await.unwrap();
        assert!(next.starts_with(&format!("id: {id}\n")), "{next}");
    }
}

#[tokio::test(start_paused = true)]
async fn a_silent_stream_sends_keep_alive_comments() {
    let service = Service::start();
    let mut stream = Stream::open(&service, EVENTS, None).await;
    let began = Instant::now();
    for _ in 0..3 {
        let comment = stream.next().await.unwrap();
        assert!(
            comment.starts_with(':') && comment.ends_with("\n\n"),
            "{comment:?}"
        );
    }
    assert_eq!(began.elapsed(), Duration::from_secs(45));
}

#[tokio::test]
async fn a_disconnected_subscriber_frees_its_permit() {
    let service = Service::start();
    let stream = Stream::open(&service, EVENTS, None).await;
    assert_eq!(service.metrics.results_listeners.get(), 1);
    drop(stream);
    assert_eq!(service.metrics.results_listeners.get(), 0);
}

#[tokio::test]
async fn a_slow_subscriber_is_disconnected_and_can_resume() {
    let service = Service::start();
    let mut stream = Stream::open(&service, EVENTS, None).await;
    for number in 0..MANY {
        service.publish("lobby", number);
    }
    let mut heard = 0;
    let mut last = String::new();
    while let Some(event) = stream.next().await {
        last = event;
        heard += 1;
    }
    assert!((1..MANY).contains(&heard), "{heard}");
    assert_eq!(service.metrics.results_listeners_dropped.get(), 1);
    let metrics = service.get("/metrics").await.text();
    let expected = "lookdown_results_listeners_dropped_total 1";
    assert!(metrics.lines().any(|line| line == expected), "{metrics}");

    let id = last.lines().next().unwrap().strip_prefix("id: ").unwrap();
    let mut stream = Stream::open(&service, EVENTS, Some(id)).await;
    for number in heard..MANY {
        assert_eq!(stream.number().await, number);
    }
}

impl Server {
    /// Returns a connection with an open event stream.
    async fn listen(&self) -> std::net::TcpStream {
        let request = format!("GET {EVENTS} HTTP/1.1\r\nHost: lookdown\r\n\r\n");
        let mut connection = self.connect(request.as_bytes());
        let mut head = [0; 12];
        connection.read_exact(&mut head).unwrap();
        assert_eq!(&head, b"HTTP/1.1 200");
        self.shows("results_listeners", 1).await;
        connection
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_vanished_subscriber_is_detected() {
    let server = Server::start(&[]).await;
    drop(server.listen().await);
    server.shows("results_listeners", 0).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn streams_and_waits_end_at_shutdown() {
    let server = Server::start(&[]).await;
    let stream = server.listen().await;
    assert!(server.detect().await.unwrap().unwrap().contains("200 OK"));
    let latest = server.get("/results/lobby/latest").await;
    let tag = latest.lines().find_map(|line| line.strip_prefix("etag: "));
    let waiting = server.exchange(
        &format!(
            "GET /results/lobby/latest?wait=30 HTTP/1.1\r\nIf-None-Match: {}",
            tag.unwrap()
        ),
        Vec::new(),
    );
    server.shows("results_listeners", 2).await;
    server.shutdown.request_without_pause();
    let rest = rest_of(stream).await;
    assert!(rest.contains("\"camera\":\"lobby\""), "{rest}");
    assert!(rest.ends_with("\r\n0\r\n\r\n"), "{rest}");
    let waiting = waiting.await.unwrap().unwrap();
    assert!(waiting.contains("304 Not Modified"), "{waiting}");
    let ended = timeout(Duration::from_secs(20), server.has_ended());
    ended.await.unwrap();
}
