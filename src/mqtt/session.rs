//! One connection to the broker, from CONNECT to its end. Every operation has a timeout that ends
//! it.
//!
//! Messages to publish.
//!
//! The connection to the broker: TCP, with TLS if the URL asks for it.
//!
//! The packets of a broker, within limits.
//!
//! Any client of the broker may retain a large message on a subscribed topic, which the broker
//! sends after each subscription. Such a message is skipped, without memory for it: ending the
//! connection would end MQTT for good.
//!
//! The way to the broker: it opens one session after the other, with pauses between the attempts.

use std::{future::Future, io, path::Path, time::Duration};

use bytes::{Buf, Bytes, BytesMut};
use futures_util::{SinkExt, StreamExt};
use lookdown_common::{Backoff, LogOnce};
use rumqttc::{
    Codec, ConnAck, Connect, ConnectReturnCode, LastWill, Packet, Publish, QoS, Subscribe,
    SubscribeFilter,
};
use tokio::time::{Instant, Interval, MissedTickBehavior, interval, sleep_until, timeout};
use tokio_util::codec::{Decoder, Encoder, Framed};
use uuid::Uuid;

use super::Broker;
use crate::tls::{ClientTls, Stream, connect};

/// The keep-alive interval. After 1.5 times as long without a packet the broker regards the client
/// as lost and publishes its will (MQTT 3.1.1, section 3.1.2.10). The client waits as long for a
/// packet of the broker.
const KEEP_ALIVE_SECONDS: u16 = 30;
const KEEP_ALIVE: Duration = Duration::from_secs(KEEP_ALIVE_SECONDS as u64);
/// Longest time for connecting, or for sending a message to the broker.
const BROKER_TIMEOUT: Duration = Duration::from_secs(10);

/// The reason why a connection has ended or could not be opened.
#[derive(Debug, thiserror::Error)]
pub(super) enum SessionError {
    #[error("{0}")]
    Failed(#[from] io::Error),
    #[error("it violates MQTT 3.1.1: {0}")]
    Protocol(#[from] rumqttc::mqttbytes::Error),
    #[error(
        "it refuses the login ({0:?}): check the user, the password and the broker's access rules"
    )]
    Refused(ConnectReturnCode),
    #[error("it has closed the connection")]
    Closed,
    #[error("it does not answer in time")]
    Silent,
}

/// A connection that the broker has accepted.
pub(super) struct Session {
    packets: Framed<Box<dyn Stream>, PacketCodec>,
    ping: Interval,
    last_heard: Instant,
}

impl Session {
    /// Connects. The broker publishes `will` if the connection is lost.
    pub(super) async fn open(
        broker: &Broker,
        tls: Option<&ClientTls>,
        client_id: &str,
        will: Message,
    ) -> Result<Self, SessionError> {
        let login = broker.login.as_ref();
        let mut hello = Connect::new(client_id);
        hello.keep_alive = KEEP_ALIVE_SECONDS;
        hello.last_will = Some(LastWill {
            topic: will.topic,
            message: will.payload,
            qos: QoS::AtMostOnce,
            retain: will.retained,
        });
        if let Some((user, password)) = login {
            hello.set_login(user, password);
        }
        in_time(async {
            let stream = connect(&broker.host, broker.port, tls).await?;
            let mut packets = Framed::new(stream, PacketCodec::default());
            packets.send(Packet::Connect(hello)).await?;
            match packets.next().await {
                Some(Ok(Packet::ConnAck(ConnAck {
                    code: ConnectReturnCode::Success,
                    ..
                }))) => {}
                Some(Ok(Packet::ConnAck(ConnAck { code, .. }))) => {
                    return Err(SessionError::Refused(code));
                }
                Some(Err(error)) => return Err(error.into()),
                Some(Ok(_)) | None => return Err(SessionError::Closed),
            }
            let mut ping = interval(KEEP_ALIVE / 2);
            ping.set_missed_tick_behavior(MissedTickBehavior::Delay);
            Ok(Self {
                packets,
                ping,
                last_heard: Instant::now(),
            })
        })
        .await
    }

    /// Subscribes to these topics.
    pub(super) async fn subscribe(
        &mut self,
        topics: impl IntoIterator<Item = String>,
    ) -> Result<(), SessionError> {
        let filters = topics
            .into_iter()
            .map(|topic| SubscribeFilter::new(topic, QoS::AtMostOnce));
        let mut subscribe = Subscribe::new_many(filters);
        subscribe.pkid = 1;
        in_time(self.send(Packet::Subscribe(subscribe))).await
    }

    /// Sends messages to the broker.
    pub(super) async fn publish(
        &mut self,
        messages: impl IntoIterator<Item = Message>,
    ) -> Result<(), SessionError> {
        for message in messages {
            let mut publish = Publish::from_bytes(message.topic, QoS::AtMostOnce, message.payload);
            publish.retain = message.retained;
            in_time(self.send(Packet::Publish(publish))).await?;
        }
        Ok(())
    }

    /// Returns the next message on a subscribed topic. Keeps the connection alive during the wait,
    /// and fails when the broker does not answer. Cancel-safe: it may be dropped and called again.
    pub(super) async fn next(&mut self) -> Result<Publish, SessionError> {
        loop {
            tokio::select! {
                packet = self.packets.next() => {
                    let packet = packet.ok_or(SessionError::Closed)??;
                    self.last_heard = Instant::now();
                    if let Packet::Publish(publish) = packet {
                        return Ok(publish);
                    }
                }
                _ = self.ping.tick() => {
                    if self.last_heard.elapsed() > KEEP_ALIVE {
                        return Err(SessionError::Silent);
                    }
                    in_time(self.send(Packet::PingReq)).await?;
                }
            }
        }
    }

    /// Sends a last message and DISCONNECT, after which the broker discards the will.
    pub(super) async fn close(mut self, last: Message) -> Result<(), SessionError> {
        self.publish([last]).await?;
        in_time(self.send(Packet::Disconnect)).await?;
        in_time(async { Ok(self.packets.close().await?) }).await
    }

    async fn send(&mut self, packet: Packet) -> Result<(), SessionError> {
        Ok(self.packets.send(packet).await?)
    }
}

async fn in_time<T>(
    work: impl Future<Output = Result<T, SessionError>>,
) -> Result<T, SessionError> {
    timeout(BROKER_TIMEOUT, work)
        .await
        .map_err(|_| SessionError::Silent)?
}

/// A message for a topic.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Message {
    pub(super) topic: String,
    pub(super) payload: Bytes,
    /// True if the broker keeps it for later subscribers.
    pub(super) retained: bool,
}

impl Message {
    /// A message that the broker retains.
    pub(super) fn retained(topic: String, payload: impl Into<Bytes>) -> Self {
        Self {
            topic,
            payload: payload.into(),
            retained: true,
        }
    }

    /// A message for current subscribers only.
    pub(super) fn passing(topic: String, payload: Bytes) -> Self {
        Self {
            topic,
            payload,
            retained: false,
        }
    }

    /// A message that deletes a retained one (MQTT 3.1.1, section 3.3.1.3).
    pub(super) fn forget(topic: String) -> Self {
        Self::retained(topic, Bytes::new())
    }
}

/// Most bytes of an incoming packet: only statuses are expected.
const MAX_INCOMING: usize = 64 * 1024;
/// Most bytes of an outgoing packet: much more than the largest report.
const MAX_OUTGOING: usize = 16 * 1024 * 1024;
/// The type of a PUBLISH in the first byte of a packet (MQTT 3.1.1, section 2.2.1).
const PUBLISH: u8 = 3;

/// Reads and writes packets.
pub(super) struct PacketCodec {
    codec: Codec,
    /// The bytes of a large message that are still to be skipped.
    to_skip: usize,
}

impl Default for PacketCodec {
    fn default() -> Self {
        Self {
            codec: Codec {
                max_incoming_size: MAX_INCOMING,
                max_outgoing_size: MAX_OUTGOING,
            },
            to_skip: 0,
        }
    }
}

impl Decoder for PacketCodec {
    type Item = Packet;
    type Error = <Codec as Decoder>::Error;

    fn decode(&mut self, source: &mut BytesMut) -> Result<Option<Packet>, Self::Error> {
        loop {
            let skipped = self.to_skip.min(source.len());
            source.advance(skipped);
            self.to_skip -= skipped;
            if self.to_skip > 0 {
                return Ok(None);
            }
            match length_of_large_message(source) {
                Some(length) => self.to_skip = length,
                None => return self.codec.decode(source),
            }
        }
    }
}

impl Encoder<Packet> for PacketCodec {
    type Error = <Codec as Encoder<Packet>>::Error;

    fn encode(&mut self, packet: Packet, to: &mut BytesMut) -> Result<(), Self::Error> {
        self.codec.encode(packet, to)
    }
}

/// Returns the length of the message with which these bytes begin, if it is too large (section
/// 2.2.3: seven bits in each of at most four bytes, the lowest first).
fn length_of_large_message(bytes: &[u8]) -> Option<usize> {
    let (first, rest) = bytes.split_first()?;
    if first >> 4 != PUBLISH {
        return None;
    }
    let mut length = 0;
    for (index, byte) in rest.iter().take(4).enumerate() {
        length |= usize::from(byte & 0x7F) << (7 * index);
        if byte & 0x80 == 0 {
            return (length > MAX_INCOMING).then_some(length + index + 2);
        }
    }
    None
}

const FIRST_PAUSE: Duration = Duration::from_secs(1);
const LONGEST_PAUSE: Duration = Duration::from_mins(1);

/// A broker, and the time of the next attempt to connect to it.
pub(super) struct Connector {
    broker: Broker,
    tls: Option<ClientTls>,
    /// Unique, as a broker drops the first of two clients with the same ID.
    client_id: String,
    backoff: Backoff,
    log: LogOnce,
    next_attempt: Instant,
    /// The start of the current session.
    opened: Option<Instant>,
}

impl Connector {
    /// Creates a connector. The ID of the client starts with `client`.
    ///
    /// # Errors
    /// If the authorities cannot be used.
    pub(super) fn new(
        broker: Broker,
        authorities: Option<&Path>,
        client: &str,
    ) -> anyhow::Result<Self> {
        Ok(Self {
            tls: broker.tls(authorities)?,
            broker,
            client_id: format!("{client}-{}", Uuid::new_v4().simple()),
            backoff: Backoff::new(FIRST_PAUSE, LONGEST_PAUSE),
            log: LogOnce::default(),
            next_attempt: Instant::now(),
            opened: None,
        })
    }

    /// Returns the next session: tries until the broker accepts one. The broker publishes `will`
    /// if the session is lost. Cancel-safe: it may be dropped and called again.
    pub(super) async fn session(&mut self, will: &Message) -> Session {
        loop {
            sleep_until(self.next_attempt).await;
            let tls = self.tls.as_ref();
            match Session::open(&self.broker, tls, &self.client_id, will.clone()).await {
                Ok(session) => {
                    tracing::info!("publishing to the broker {} (mqtt.url)", self.broker);
                    self.log.clear();
                    self.opened = Some(Instant::now());
                    return session;
                }
                Err(error) => self.lost(&error),
            }
        }
    }

    /// Logs the end of a session, and schedules the next attempt.
    pub(super) fn lost(&mut self, error: &SessionError) {
        if let Some(opened) = self.opened.take() {
            self.backoff.reset_if_stable(opened.elapsed());
        }
        if self.log.should_log(&error.to_string()) {
            let broker = &self.broker;
            tracing::warn!("not publishing to the broker {broker} (mqtt.url): {error}");
        }
        self.next_attempt = Instant::now() + self.backoff.next_pause();
    }
}

#[cfg(test)]
mod tests {
    use tokio::{
        io::{AsyncReadExt, AsyncWriteExt},
        net::TcpListener,
        spawn,
        time::{sleep, timeout},
    };
    use tokio_util::codec::Decoder;

    use super::*;

    /// The answer to CONNECT.
    const CONN_ACK: [u8; 4] = [0x20, 2, 0, 0];

    /// Connects to a broker that sends `start`, and then `rest` again and again with pauses.
    /// Returns the first error, after the session began or before.
    async fn failure(start: &[u8], rest: &[u8], pause: Duration) -> SessionError {
        let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
        let port = listener.local_addr().unwrap().port();
        let (start, rest) = (start.to_vec(), rest.to_vec());
        let broker = spawn(async move {
            let (mut stream, _) = listener.accept().await.unwrap();
            let _ = stream.read(&mut [0; 1024]).await;
            let mut sent = stream.write_all(&start).await;
            while sent.is_ok() {
                sent = stream.write_all(&rest).await;
                sleep(pause).await;
            }
        });
        let address: Broker = format!("mqtt://127.0.0.1:{port}").parse().unwrap();
        let will = Message {
            topic: "lookdown/status".to_owned(),
            payload: "offline".into(),
            retained: true,
        };
        let opened = Session::open(&address, None, "lookdown", will).await;
        let failure = async { opened?.next().await };
        let failure = failure.await.unwrap_err();
        broker.abort();
        failure
    }

    #[tokio::test]
    async fn packets_of_a_broker_are_bounded() {
        // SUBACK with a declared length of 256 MiB, without end.
        let endless = [0x90, 0xFF, 0xFF, 0xFF, 0x7F];
        let accepted = [&CONN_ACK[..], &endless].concat();
        let filler = [b'x'; 4096];
        for start in [
            &endless[..],
            &accepted,
            &[0xFF; 8],
            b"HTTP/1.1 400 Bad Request",
        ] {
            let error = failure(start, &filler, Duration::ZERO).await;
            let is_refused = matches!(error, SessionError::Protocol(_) | SessionError::Closed);
            assert!(is_refused, "{error:?}");
        }
    }

    #[test]
    fn a_large_message_is_skipped_and_the_next_one_is_read() {
        let mut codec = PacketCodec::default();
        let large = 200_000;
        let small = [0x30, 5, 0, 1, b't', b'4', b'2'];
        // A length of 200,000 in bits of seven.
        let mut sent = vec![0x31, 0xC0, 0x9A, 0x0C];
        sent.resize(4 + large, b'x');
        sent.extend_from_slice(&small);
        let mut received = bytes::BytesMut::new();
        let mut packets = Vec::new();
        for chunk in sent.chunks(1000) {
            received.extend_from_slice(chunk);
            while let Some(packet) = codec.decode(&mut received).unwrap() {
                packets.push(packet);
            }
            assert!(received.len() < 1100, "it is not kept");
        }
        let [Packet::Publish(message)] = &packets[..] else {
            panic!("{packets:?}")
        };
        assert_eq!((&*message.topic, &*message.payload), ("t", &b"42"[..]));
    }

    #[tokio::test(start_paused = true)]
    async fn a_silent_or_slow_broker_is_left_in_time() {
        // PUBLISH of 16 KiB, a byte each 100 ms.
        let slow = [&CONN_ACK[..], &[0x30, 0x80, 0x80, 0x01]].concat();
        for (start, rest) in [(&[][..], &[][..]), (&CONN_ACK, &[]), (&slow, &[0])] {
            let began = Instant::now();
            let error = failure(start, rest, Duration::from_millis(100)).await;
            assert!(matches!(error, SessionError::Silent), "{error:?}");
            assert!(began.elapsed() < BROKER_TIMEOUT + 2 * KEEP_ALIVE);
        }
    }

    #[tokio::test(start_paused = true)]
    async fn a_dropped_attempt_does_not_shorten_the_pause() {
        let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
        let port = listener.local_addr().unwrap().port();
        drop(listener);
        let broker = format!("mqtt://127.0.0.1:{port}").parse().unwrap();
        let mut connector = Connector::new(broker, None, "lookdown").unwrap();
        let will = Message::retained("lookdown/status".to_owned(), "offline");
        for _ in 0..6 {
            connector.lost(&SessionError::Closed);
        }
        // The sixth pause is half of 32 s at least.
        let due = connector.next_attempt;
        assert!(due >= Instant::now() + Duration::from_secs(16));
        for _ in 0..3 {
            let dropped = timeout(Duration::from_secs(1), connector.session(&will)).await;
            assert!(dropped.is_err());
            assert_eq!(connector.next_attempt, due);
        }
    }
}
