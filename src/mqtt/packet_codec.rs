//! The packets of a broker, within limits.
//!
//! Any client of the broker may retain a large message on a subscribed topic, which the broker
//! sends after each subscription. Such a message is skipped, without memory for it: ending the
//! connection would end MQTT for good.

use bytes::{Buf, BytesMut};
use rumqttc::{Codec, Packet};
use tokio_util::codec::{Decoder, Encoder};

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
