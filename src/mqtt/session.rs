//! One connection to the broker, from CONNECT to its end. Every operation has a timeout that ends
//! it.

use std::{future::Future, io, time::Duration};

use futures_util::{SinkExt, StreamExt};
use rumqttc::{
    Codec, ConnAck, Connect, ConnectReturnCode, LastWill, Packet, Publish, QoS, Subscribe,
    SubscribeFilter,
};
use tokio::time::{Instant, Interval, MissedTickBehavior, interval, timeout};
use tokio_util::codec::Framed;

use super::{
    Broker,
    connection::{Stream, connect},
    message::Message,
};
use crate::tls::ClientTls;

/// The keep-alive interval. After 1.5 times as long without a packet the broker regards the client
/// as lost and publishes its will (MQTT 3.1.1, section 3.1.2.10). The client waits as long for a
/// packet of the broker.
const KEEP_ALIVE_SECONDS: u16 = 30;
const KEEP_ALIVE: Duration = Duration::from_secs(KEEP_ALIVE_SECONDS as u64);
/// Longest time for connecting, or for sending a message to the broker.
const PATIENCE: Duration = Duration::from_secs(10);
/// Most bytes of an incoming packet: only statuses are expected.
const MAX_INCOMING: usize = 64 * 1024;
/// Most bytes of an outgoing packet: much more than the largest report.
const MAX_OUTGOING: usize = 16 * 1024 * 1024;

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
    packets: Framed<Box<dyn Stream>, Codec>,
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
            let stream = connect(broker, tls).await?;
            let codec = Codec {
                max_incoming_size: MAX_INCOMING,
                max_outgoing_size: MAX_OUTGOING,
            };
            let mut packets = Framed::new(stream, codec);
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
    timeout(PATIENCE, work)
        .await
        .map_err(|_| SessionError::Silent)?
}
