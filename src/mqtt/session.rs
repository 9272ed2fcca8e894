//! One connection to the broker, from its beginning to its end. Whatever takes too long ends it.

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

/// After one and a half times as long without a word the broker takes us for dead and publishes our
/// will (MQTT 3.1.1, section 3.1.2.10); so long without a word of its own is as much as we wait.
const KEEP_ALIVE_SECONDS: u16 = 30;
const KEEP_ALIVE: Duration = Duration::from_secs(KEEP_ALIVE_SECONDS as u64);
/// Longest that connecting, or giving the broker a message, may take.
const PATIENCE: Duration = Duration::from_secs(10);
/// Most bytes of what the broker sends: statuses.
const MAX_INCOMING: usize = 64 * 1024;
/// Most bytes of what it is sent: the largest report by far.
const MAX_OUTGOING: usize = 16 * 1024 * 1024;

/// A connection that has ended, or never began.
#[derive(Debug, thiserror::Error)]
pub(super) enum SessionError {
    #[error("{0}")]
    Failed(#[from] io::Error),
    #[error("it does not speak MQTT 3.1.1 as it should: {0}")]
    Protocol(#[from] rumqttc::mqttbytes::Error),
    #[error("it refuses us ({0:?}): look at user and password in mqtt.url, and at its rules")]
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
    /// Connects, and has the broker say `will` if it loses us.
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

    /// Asks to be told what is published on these topics.
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

    /// Gives the broker messages.
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

    /// The next that somebody has published on a topic that was asked for. Shows the broker meanwhile
    /// that we are there, and ends when the broker is not. May be given up and called again.
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

    /// Says a last message and goodbye, after which the broker forgets our will.
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
