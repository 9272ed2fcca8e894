//! Server-sent events (HTML Living Standard, section 9.2), with a limit on their size.

use bytes::BytesMut;

/// Most bytes of an event: the largest page of reports of the server.
const MAX_EVENT_BYTES: usize = 8 << 20;

/// An event with data.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Event {
    /// Its ID; `None` if it is not an ID of a Lookdown server.
    pub(crate) id: Option<u64>,
    pub(crate) data: Vec<u8>,
}

/// An event with more bytes than are accepted.
#[derive(Debug, thiserror::Error)]
#[error("an event has more than {} MiB", MAX_EVENT_BYTES >> 20)]
pub(crate) struct TooLarge;

/// Splits a stream into events.
#[derive(Debug, Default)]
pub(crate) struct EventParser {
    unread: BytesMut,
    /// Bytes of `unread` that contain no line end.
    searched: usize,
    id: Option<u64>,
    data: Vec<u8>,
    has_data: bool,
}

impl EventParser {
    /// Adds bytes of the stream.
    pub(crate) fn push(&mut self, bytes: &[u8]) {
        self.unread.extend_from_slice(bytes);
    }

    /// Returns the next complete event.
    pub(crate) fn next_event(&mut self) -> Result<Option<Event>, TooLarge> {
        while let Some(line) = self.line() {
            if line.is_empty() {
                let data = std::mem::take(&mut self.data);
                if std::mem::take(&mut self.has_data) {
                    return Ok(Some(Event { id: self.id, data }));
                }
                continue;
            }
            let colon = line.iter().position(|byte| *byte == b':');
            let (field, value) = line.split_at(colon.unwrap_or(line.len()));
            let value = value.strip_prefix(b":").unwrap_or(value);
            let value = value.strip_prefix(b" ").unwrap_or(value);
            match field {
                b"id" => {
                    self.id = std::str::from_utf8(value)
                        .ok()
                        .and_then(|id| id.parse().ok());
                }
                b"data" => {
                    if self.has_data {
                        self.data.push(b'\n');
                    }
                    self.data.extend_from_slice(value);
                    self.has_data = true;
                }
                // Comments, and fields without a meaning here.
                _ => {}
            }
            if self.data.len() > MAX_EVENT_BYTES {
                return Err(TooLarge);
            }
        }
        if self.unread.len() > MAX_EVENT_BYTES {
            return Err(TooLarge);
        }
        Ok(None)
    }

    /// Takes the next complete line without its end.
    fn line(&mut self) -> Option<BytesMut> {
        let end = self.unread[self.searched..]
            .iter()
            .position(|byte| *byte == b'\n');
        let Some(end) = end else {
            self.searched = self.unread.len();
            return None;
        };
        let mut line = self.unread.split_to(self.searched + end + 1);
        self.searched = 0;
        line.truncate(line.len() - 1);
        if line.last() == Some(&b'\r') {
            line.truncate(line.len() - 1);
        }
        Some(line)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STREAM: &[u8] =
        b": hello\n\nid: 7\ndata: {\"a\":1}\n\nid:8\r\ndata:x\r\ndata: y\r\n\r\nretry: 5\nid: z\ndata\n\n";

    fn events(size: usize) -> Vec<Event> {
        let mut parser = EventParser::default();
        let mut events = Vec::new();
        for chunk in STREAM.chunks(size) {
            parser.push(chunk);
            while let Some(event) = parser.next_event().unwrap() {
                events.push(event);
            }
        }
        events
    }

    #[test]
    fn events_are_the_same_however_the_stream_is_cut() {
        let event = |id, data: &str| Event {
            id,
            data: data.into(),
        };
        let expected = [
            event(Some(7), "{\"a\":1}"),
            event(Some(8), "x\ny"),
            event(None, ""),
        ];
        for size in 1..=STREAM.len() {
            assert_eq!(events(size), expected, "{size}");
        }
    }

    #[test]
    fn an_event_without_end_is_refused() {
        let mut parser = EventParser::default();
        for prefix in ["", "data: x\n"] {
            parser.push(prefix.as_bytes());
            parser.push(&vec![b'x'; MAX_EVENT_BYTES]);
            parser.push(b"x");
            assert!(parser.next_event().is_err(), "{prefix}");
        }
    }
}
