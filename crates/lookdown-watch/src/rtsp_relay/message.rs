//! The units of an RTSP connection: messages, and packets of media between them (RFC 2326, sections
//! 4, 10.12 and 15).

use bytes::{Buf, BytesMut};

use crate::SourceError;

/// Most bytes of the head of a message.
const MAX_HEAD_BYTES: usize = 16 << 10;
/// Most bytes of a body. A description of a camera has a few streams and less than 4 KiB.
const MAX_BODY_BYTES: usize = 64 << 10;
/// The first byte of a packet of media.
const PACKET: u8 = b'$';
/// Bytes before the content of a packet.
const PACKET_HEAD: usize = 4;

/// A unit of the connection.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Unit {
    /// A request or a response.
    Message(Message),
    /// A packet of media with its head.
    Packet(BytesMut),
}

/// A request or a response.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Message {
    /// The request line or the status line.
    pub(super) start: String,
    /// The names and values of the headers.
    pub(super) headers: Vec<(String, String)>,
    pub(super) body: BytesMut,
}

/// Returns the error of a message that exceeds a limit.
fn too_long() -> SourceError {
    SourceError::Stream(format!(
        "the camera's RTSP messages have more than {MAX_HEAD_BYTES} bytes of headers or \
         {MAX_BODY_BYTES} bytes of content: check that the URL is that of a camera"
    ))
}

/// Removes the next unit from the buffer. Returns `None` if more bytes are needed.
pub(super) fn next_unit(buffer: &mut BytesMut) -> Result<Option<Unit>, SourceError> {
    // Cameras send other bytes between packets. A message begins with a capital letter.
    let is_start = |&byte: &u8| byte == PACKET || byte.is_ascii_uppercase();
    let skipped = buffer.iter().position(is_start).unwrap_or(buffer.len());
    buffer.advance(skipped);
    if buffer.first() == Some(&PACKET) {
        let Some(&[high, low]) = buffer
            .get(2..PACKET_HEAD)
            .and_then(|bytes| <&[u8; 2]>::try_from(bytes).ok())
        else {
            return Ok(None);
        };
        let length = PACKET_HEAD + usize::from(u16::from_be_bytes([high, low]));
        let is_whole = buffer.len() >= length;
        return Ok(is_whole.then(|| Unit::Packet(buffer.split_to(length))));
    }
    let Some(end) = memchr::memmem::find(buffer, b"\r\n\r\n").map(|end| end + 4) else {
        return if buffer.len() > MAX_HEAD_BYTES {
            Err(too_long())
        } else {
            Ok(None)
        };
    };
    if end > MAX_HEAD_BYTES {
        return Err(too_long());
    }
    let head = String::from_utf8_lossy(&buffer[..end]);
    let mut lines = head.lines();
    let start = lines.next().unwrap_or_default().to_owned();
    let headers = lines.filter_map(|line| {
        let (name, value) = line.split_once(':')?;
        Some((name.trim().to_owned(), value.trim().to_owned()))
    });
    let mut message = Message {
        start,
        headers: headers.collect(),
        body: BytesMut::new(),
    };
    let length = message.header("content-length").unwrap_or("0");
    let length: usize = length.parse().map_err(|_| too_long())?;
    if length > MAX_BODY_BYTES {
        return Err(too_long());
    }
    if buffer.len() < end + length {
        return Ok(None);
    }
    buffer.advance(end);
    message.body = buffer.split_to(length);
    Ok(Some(Unit::Message(message)))
}

impl Message {
    /// Returns the value of a header.
    pub(super) fn header(&self, name: &str) -> Option<&str> {
        let mut headers = self.headers.iter();
        let found = headers.find(|(given, _)| given.eq_ignore_ascii_case(name));
        found.map(|(_, value)| &**value)
    }

    /// Replaces a header, or removes it.
    pub(super) fn set(&mut self, name: &str, value: Option<String>) {
        self.headers
            .retain(|(given, _)| !given.eq_ignore_ascii_case(name));
        if let Some(value) = value {
            self.headers.push((name.to_owned(), value));
        }
    }

    /// The number of the request.
    pub(super) fn sequence(&self) -> Option<u32> {
        self.header("cseq")?.parse().ok()
    }

    /// The method and the address of a request.
    pub(super) fn request(&self) -> Option<(&str, &str)> {
        let mut words = self.start.split(' ');
        let (method, address) = (words.next()?, words.next()?);
        words
            .next()?
            .starts_with("RTSP/")
            .then_some((method, address))
    }

    /// The status of a response.
    pub(super) fn status(&self) -> Option<u16> {
        let rest = self.start.strip_prefix("RTSP/")?;
        rest.split(' ').nth(1)?.parse().ok()
    }

    /// Appends the message to a buffer.
    pub(super) fn write(&self, buffer: &mut BytesMut) {
        buffer.extend_from_slice(self.start.as_bytes());
        for (name, value) in &self.headers {
            buffer.extend_from_slice(format!("\r\n{name}: {value}").as_bytes());
        }
        buffer.extend_from_slice(b"\r\n\r\n");
        buffer.extend_from_slice(&self.body);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn units(bytes: &[u8], chunk: usize) -> Result<Vec<Unit>, SourceError> {
        let mut buffer = BytesMut::new();
        let mut units = Vec::new();
        for bytes in bytes.chunks(chunk) {
            buffer.extend_from_slice(bytes);
            while let Some(unit) = next_unit(&mut buffer)? {
                units.push(unit);
            }
        }
        Ok(units)
    }

    #[test]
    fn messages_and_packets_are_read_at_any_chunk_size() {
        let stream = b"RTSP/1.0 200 OK\r\nCSeq: 2\r\nContent-Length: 3\r\n\r\nabc\
            $\x00\x00\x02RR\r\n$\x01\x00\x00OPTIONS * RTSP/1.0\r\nCSeq: 7\r\n\r\n";
        for chunk in [1, 3, 1000] {
            let units = units(stream, chunk).unwrap();
            let [
                Unit::Message(response),
                Unit::Packet(first),
                Unit::Packet(_),
                Unit::Message(request),
            ] = &units[..]
            else {
                panic!("{units:?}")
            };
            assert_eq!(
                (response.status(), response.sequence()),
                (Some(200), Some(2))
            );
            assert_eq!(&response.body[..], b"abc");
            assert_eq!(&first[..], b"$\x00\x00\x02RR");
            assert_eq!(request.request(), Some(("OPTIONS", "*")));
            let mut written = BytesMut::new();
            response.write(&mut written);
            assert!(stream.starts_with(&written));
        }
    }

    #[test]
    fn endless_heads_and_large_descriptions_are_refused() {
        let endless = [b"RTSP/1.0 200 OK\r\nX: ".as_slice(), &vec![b'a'; 20_000]].concat();
        assert!(units(&endless, 1000).is_err());
        let large = b"RTSP/1.0 200 OK\r\nContent-Length: 6400000\r\n\r\n";
        assert!(units(large, 1000).is_err());
        let negative = b"RTSP/1.0 200 OK\r\nContent-Length: -1\r\n\r\n";
        assert!(units(negative, 1000).is_err());
    }
}
