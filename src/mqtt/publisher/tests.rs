use bytes::Bytes;
use futures_util::{SinkExt, StreamExt};
use jiff::Timestamp;
use lookdown_imaging::decode::DecodeLimits;
use rumqttc::{Codec, ConnAck, Connect, ConnectReturnCode, Packet, QoS};
use tokio::net::{TcpListener, TcpStream};
use tokio_util::codec::Framed;

use super::*;
use crate::{
    annotated_image::StoredFrame,
    results::{ImagesOf, MemoryResults, NewReport, ResultLimits},
};

type Client = Framed<TcpStream, Codec>;

struct Setup {
    listener: TcpListener,
    results: Arc<MemoryResults>,
    metrics: Arc<Metrics>,
    publisher: Publisher,
}

async fn setup() -> Setup {
    setup_with(None).await
}

async fn setup_with(image_every: Option<Duration>) -> Setup {
    let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
    let port = listener.local_addr().unwrap().port();
    let results = Arc::new(MemoryResults::new(ResultLimits::default(), Arc::default()));
    let metrics = Arc::<Metrics>::default();
    let options = MqttOptions {
        broker: format!("mqtt://home:secret@127.0.0.1:{port}")
            .parse()
            .unwrap(),
        authorities: None,
        topic_prefix: "lookdown".to_owned(),
        discovery_prefix: Some("homeassistant".to_owned()),
        max_cameras: NonZeroUsize::MIN,
        hold: Duration::ZERO,
        image_every,
        discovery: Discovery {
            images: match image_every {
                Some(_) => ImagesOf::All,
                None => ImagesOf::default(),
            },
            ..Discovery::default()
        },
    };
    let store = Arc::clone(&results) as Arc<dyn ResultStore>;
    Setup {
        listener,
        results,
        publisher: Publisher::new(
            options,
            store,
            FollowedPersons::default(),
            Arc::default(),
            Arc::clone(&metrics),
            Arc::new(Views::new("state".into(), DecodeLimits::default(), None)),
        )
        .unwrap(),
        metrics,
    }
}

fn report(persons: usize) -> NewReport {
    NewReport {
        camera: "lobby".to_owned(),
        received_at: Timestamp::UNIX_EPOCH,
        persons,
        scores: None,
        json: Bytes::from_static(b"{}"),
    }
}

/// Accepts a client of the broker and reads its CONNECT.
async fn accept(listener: &TcpListener) -> (Client, Connect) {
    let (stream, _) = listener.accept().await.unwrap();
    let codec = Codec {
        max_incoming_size: 1 << 20,
        max_outgoing_size: 1 << 20,
    };
    let mut client = Framed::new(stream, codec);
    let Some(Ok(Packet::Connect(hello))) = client.next().await else {
        panic!("no CONNECT came first");
    };
    (client, hello)
}

async fn welcome(client: &mut Client) {
    let welcome = ConnAck::new(ConnectReturnCode::Success, false);
    client.send(Packet::ConnAck(welcome)).await.unwrap();
}

/// The next message: topic, payload, and whether it is retained.
async fn heard(client: &mut Client) -> (String, String, bool) {
    loop {
        match client.next().await.unwrap().unwrap() {
            Packet::Publish(said) => {
                let payload = String::from_utf8(said.payload.to_vec()).unwrap();
                return (said.topic, payload, said.retain);
            }
            Packet::Disconnect => return ("disconnected".to_owned(), String::new(), false),
            _ => {}
        }
    }
}

fn said(topic: &str, payload: &str, retained: bool) -> (String, String, bool) {
    (topic.to_owned(), payload.to_owned(), retained)
}

#[tokio::test]
async fn a_connection_begins_with_a_will_and_ends_with_a_farewell() {
    let setup = setup().await;
    let running = tokio::spawn(setup.publisher.run());
    let (mut client, hello) = accept(&setup.listener).await;
    let will = hello.last_will.unwrap();
    assert_eq!(
        (will.topic.as_str(), will.retain),
        ("lookdown/status", true)
    );
    assert_eq!(will.message, "offline");
    assert_eq!(hello.login.unwrap().password, "secret");
    assert!(
        hello.client_id.starts_with("lookdown-"),
        "{}",
        hello.client_id
    );
    welcome(&mut client).await;
    let status = "lookdown/status";
    assert_eq!(heard(&mut client).await, said(status, "online", true));

    setup.results.publish(report(2), None);
    let configs = [
        heard(&mut client).await,
        heard(&mut client).await,
        heard(&mut client).await,
    ];
    assert!(
        configs
            .iter()
            .all(|(topic, ..)| topic.starts_with("homeassistant/"))
    );
    let camera = "lookdown/cameras/lobby";
    let none =
        r#"{"calibration":null,"model":null,"persons_high":4,"persons_low":0,"profile":null}"#;
    let attributes = said(&format!("{camera}/attributes"), none, true);
    let count = said(&format!("{camera}/persons"), "2", true);
    let frame = said(&format!("{camera}/frame_persons"), "2", true);
    let occupancy = said(&format!("{camera}/occupancy"), "ON", true);
    let availability = said(&format!("{camera}/availability"), "online", true);
    for expected in [&attributes, &count, &frame, &occupancy, &availability] {
        assert_eq!(heard(&mut client).await, *expected);
    }
    assert_eq!(
        heard(&mut client).await,
        said(&format!("{camera}/report"), "{}", false)
    );

    // The whole state is sent at once, and only once for many requests.
    for _ in 0..40 {
        let birth = Publish::new("homeassistant/status", QoS::AtMostOnce, "online");
        client.send(Packet::Publish(birth)).await.unwrap();
    }
    for config in configs {
        assert_eq!(heard(&mut client).await, config);
    }
    for expected in [&attributes, &count, &frame, &occupancy, &availability] {
        assert_eq!(heard(&mut client).await, *expected);
    }
    // Home Assistant withdraws a camera whose reports are deleted.
    assert!(setup.results.delete("lobby").await.unwrap());
    for _ in 0..9 {
        let (_, payload, is_retained) = heard(&mut client).await;
        assert!(payload.is_empty() && is_retained);
    }
    let will = Publish::new(status, QoS::AtMostOnce, "offline");
    client.send(Packet::Publish(will)).await.unwrap();
    assert_eq!(heard(&mut client).await, said(status, "online", true));

    setup.results.listeners().end();
    assert_eq!(heard(&mut client).await, said(status, "offline", true));
    assert_eq!(heard(&mut client).await.0, "disconnected");
    running.await.unwrap();
    assert_eq!(setup.metrics.mqtt_reports_sent.get(), 1);
    assert_eq!(setup.metrics.mqtt_reports_dropped.get(), 0);
    assert_eq!(setup.metrics.mqtt_connected.get(), 0);
}

#[tokio::test]
async fn each_new_image_is_published_and_not_retained() {
    let setup = setup_with(Some(Duration::from_millis(10))).await;
    let running = tokio::spawn(setup.publisher.run());
    let (mut client, _) = accept(&setup.listener).await;
    welcome(&mut client).await;
    let sketch = r#"{"frame_width":1680,"marks":[],"views":[],"zones":[],"timestamp":""}"#;
    let image = StoredFrame {
        jpeg: Bytes::from_static(include_bytes!("../../../samples/office.jpg")),
        sketch: Bytes::from_static(sketch.as_bytes()),
    };
    setup.results.publish(report(1), Some(image.clone()));
    let mut images = 0;
    while images < 2 {
        let Packet::Publish(said) = client.next().await.unwrap().unwrap() else {
            continue;
        };
        if said.topic == "lookdown/cameras/lobby/image" {
            images += 1;
            assert!(!said.retain);
            assert!(said.payload.starts_with(&[0xff, 0xd8]) && said.payload.len() <= 1 << 20);
            if images == 1 {
                setup.results.publish(report(1), Some(image.clone()));
            }
        }
    }
    setup.results.listeners().end();
    running.await.unwrap();
}

#[tokio::test]
async fn without_a_broker_reports_are_counted_without_waiting() {
    let setup = setup().await;
    let running = tokio::spawn(setup.publisher.run());
    // The broker accepts the connection but does not send CONNACK.
    let (client, _) = accept(&setup.listener).await;
    for _ in 0..1000 {
        setup.results.publish(report(1), None);
        tokio::task::yield_now().await;
    }
    setup.results.listeners().end();
    running.await.unwrap();
    drop(client);
    assert_eq!(setup.metrics.mqtt_reports_dropped.get(), 1000);
    assert_eq!(setup.metrics.mqtt_reports_sent.get(), 0);
}

#[tokio::test]
async fn a_report_that_cannot_be_sent_is_counted_as_not_sent() {
    let setup = setup().await;
    let running = tokio::spawn(setup.publisher.run());
    let (mut client, _) = accept(&setup.listener).await;
    welcome(&mut client).await;
    assert_eq!(heard(&mut client).await.1, "online");
    // This exceeds the limit of outgoing messages.
    let json = Bytes::from(vec![b' '; 20 << 20]);
    setup.results.publish(NewReport { json, ..report(1) }, None);
    setup.results.listeners().end();
    running.await.unwrap();
    assert_eq!(setup.metrics.mqtt_reports_dropped.get(), 1);
    assert_eq!(setup.metrics.mqtt_reports_sent.get(), 0);
}

#[tokio::test]
async fn a_new_connection_publishes_the_current_state() {
    let setup = setup().await;
    setup.results.publish(report(7), None);
    let running = tokio::spawn(setup.publisher.run());
    let (mut client, _) = accept(&setup.listener).await;
    welcome(&mut client).await;
    let mut said = Vec::new();
    while said.len() < 6 {
        said.push(heard(&mut client).await);
    }
    assert_eq!(said[0].1, "online");
    assert_eq!(
        said[5],
        (
            "lookdown/cameras/lobby/persons".to_owned(),
            "7".to_owned(),
            true
        )
    );
    setup.results.listeners().end();
    running.await.unwrap();
}
