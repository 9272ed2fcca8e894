//! Bounds every reply of Redis while it is read from the socket: its bytes, and the memory of its
//! values. The client library reads a reply of any size into memory, so a reply beyond the limit
//! ends the connection.

use std::{
    io,
    pin::Pin,
    task::{Context, Poll, ready},
};

use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};

/// Memory of a parsed value in addition to its bytes: one of few bytes takes more than those.
const VALUE_BYTES: u64 = 64;
/// Most bytes of a line: a length, a number, a status or an error.
const MAX_LINE_BYTES: usize = 64 << 10;

/// A connection to Redis whose replies are bounded.
pub(super) struct BoundedReplies<S> {
    stream: S,
    meter: ReplyMeter,
}

impl<S> BoundedReplies<S> {
    /// Bounds the replies of `stream`: `max_bytes` for one reply with the memory of its values.
    pub(super) fn new(stream: S, max_bytes: u64) -> Self {
        Self {
            stream,
            meter: ReplyMeter::new(max_bytes),
        }
    }
}

impl<S: AsyncRead + Unpin> AsyncRead for BoundedReplies<S> {
    fn poll_read(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        let before = buffer.filled().len();
        ready!(Pin::new(&mut self.stream).poll_read(context, buffer))?;
        Poll::Ready(self.meter.read(&buffer.filled()[before..]))
    }
}

impl<S: AsyncWrite + Unpin> AsyncWrite for BoundedReplies<S> {
    fn poll_write(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        bytes: &[u8],
    ) -> Poll<io::Result<usize>> {
        Pin::new(&mut self.stream).poll_write(context, bytes)
    }

    fn poll_flush(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_flush(context)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_shutdown(context)
    }
}

/// Follows the replies in a byte stream of RESP2 or RESP3, the protocols of Redis, and adds up the
/// cost of each. Declared lengths count at once, so a huge one is refused before its bytes arrive.
struct ReplyMeter {
    max_bytes: u64,
    /// The cost of the reply so far.
    cost: u64,
    /// The values of the reply that have not begun.
    values_left: u64,
    /// The bytes of a bulk string, with its line end, that have not arrived.
    bulk_left: u64,
    /// The current line.
    line: Vec<u8>,
}

impl ReplyMeter {
    fn new(max_bytes: u64) -> Self {
        Self {
            max_bytes,
            cost: 0,
            values_left: 1,
            bulk_left: 0,
            line: Vec::new(),
        }
    }

    fn read(&mut self, mut bytes: &[u8]) -> io::Result<()> {
        while !bytes.is_empty() {
            if self.bulk_left > 0 {
                let length = usize::try_from(self.bulk_left).unwrap_or(usize::MAX);
                let (part, rest) = bytes.split_at(length.min(bytes.len()));
                if !self.has_line_end(part) {
                    return Err(refused("a string without its line end"));
                }
                self.bulk_left -= part.len() as u64;
                bytes = rest;
                self.end_if_complete();
                continue;
            }
            let end = bytes.iter().position(|&byte| byte == b'\n');
            let (part, rest) = bytes.split_at(end.map_or(bytes.len(), |end| end + 1));
            bytes = rest;
            if self.line.len() + part.len() > MAX_LINE_BYTES {
                return Err(refused(&format!(
                    "a line of more than {MAX_LINE_BYTES} bytes"
                )));
            }
            self.line.extend_from_slice(part);
            if self.line.ends_with(b"\r\n") {
                self.value()?;
                self.line.clear();
                self.end_if_complete();
            }
        }
        Ok(())
    }

    /// Returns false if `part`, the next bytes of a bulk string, reaches its line end and differs.
    fn has_line_end(&self, part: &[u8]) -> bool {
        [(2, b'\r'), (1, b'\n')].into_iter().all(|(left, byte)| {
            let index = self.bulk_left.checked_sub(left);
            let found = index.and_then(|index| part.get(usize::try_from(index).ok()?));
            found.is_none_or(|&found| found == byte)
        })
    }

    /// Counts the value that the current line begins.
    fn value(&mut self) -> io::Result<()> {
        self.values_left -= 1;
        self.add(self.line.len() as u64)?;
        match self.line[0] {
            b'+' | b'-' | b':' | b'_' | b'#' | b',' | b'(' => {}
            b'$' | b'!' | b'=' => {
                if let Some(length) = self.length()? {
                    self.add(length)?;
                    self.bulk_left = length + 2;
                }
            }
            b'*' | b'~' | b'>' => {
                if let Some(length) = self.length()? {
                    self.add_values(length)?;
                }
            }
            // Each entry is a key and a value.
            b'%' => {
                if let Some(length) = self.length()? {
                    self.add_values(length.saturating_mul(2))?;
                }
            }
            other => {
                let other = char::from(other);
                return Err(refused(&format!("{other:?} instead of a value of RESP")));
            }
        }
        Ok(())
    }

    /// The length in the current line. `None` for a value that is absent.
    fn length(&self) -> io::Result<Option<u64>> {
        let text = str::from_utf8(&self.line[1..]).ok();
        let length = text.and_then(|text| text.trim().parse::<i64>().ok());
        let length = length.ok_or_else(|| refused("a length that is not a number"))?;
        Ok(u64::try_from(length).ok())
    }

    fn add_values(&mut self, count: u64) -> io::Result<()> {
        self.add(count.saturating_mul(VALUE_BYTES))?;
        self.values_left += count;
        Ok(())
    }

    fn add(&mut self, cost: u64) -> io::Result<()> {
        self.cost = self.cost.saturating_add(cost);
        if self.cost > self.max_bytes {
            let max = self.max_bytes;
            return Err(refused(&format!("a reply of more than {max} bytes")));
        }
        Ok(())
    }

    fn end_if_complete(&mut self) {
        if self.values_left == 0 && self.bulk_left == 0 {
            self.values_left = 1;
            self.cost = 0;
        }
    }
}

fn refused(sent: &str) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, format!("Redis sent {sent}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    const RESP2: &[u8] =
        b"+OK\r\n*3\r\n$4\r\na\r\nb\r\n:7\r\n*2\r\n$-1\r\n*-1\r\n-ERR no\r\n$0\r\n\r\n";
    const RESP3: &[u8] =
        b"_\r\n#t\r\n,1.5\r\n(7\r\n>2\r\n+pong\r\n%1\r\n$1\r\na\r\n~1\r\n=5\r\ntxt:b\r\n!2\r\nno\r\n";

    #[test]
    fn replies_within_the_limit_pass_in_any_pieces() {
        for replies in [RESP2, RESP3] {
            for size in 1..replies.len() {
                // The largest reply has six values.
                let mut meter = ReplyMeter::new(512);
                for _ in 0..100 {
                    for piece in replies.chunks(size) {
                        meter.read(piece).unwrap();
                    }
                }
                assert_eq!((meter.cost, meter.values_left), (0, 1), "pieces of {size}");
            }
        }
    }

    #[test]
    fn a_huge_declared_length_is_refused_at_once() {
        for header in [
            "$1000\r\n",
            "*20\r\n",
            "*1\r\n*15\r\n",
            ">20\r\n",
            "%10\r\n",
            "%9223372036854775807\r\n",
            "$9223372036854775807\r\n",
            "*9223372036854775807\r\n",
        ] {
            let error = ReplyMeter::new(1000).read(header.as_bytes()).unwrap_err();
            let message = error.to_string();
            assert!(message.contains("more than 1000 bytes"), "{message}");
        }
    }

    #[test]
    fn a_string_without_its_line_end_is_refused_at_once() {
        for reply in ["$1\r\nxy", "$1\r\nx\rx", "$0\r\n\n"].map(str::as_bytes) {
            for size in 1..=reply.len() {
                let mut meter = ReplyMeter::new(1000);
                let mut pieces = reply.chunks(size);
                let refused = pieces.find_map(|piece| meter.read(piece).err());
                let message = refused.unwrap().to_string();
                assert!(
                    message.contains("line end"),
                    "{reply:?} in {size}: {message}"
                );
            }
        }
    }

    #[test]
    fn endless_lines_and_garbage_are_refused() {
        let endless = [b'+'; 1 << 10];
        let mut meter = ReplyMeter::new(1 << 30);
        let read = (0..65).try_for_each(|_| meter.read(&endless));
        assert!(read.is_err());
        for garbage in ["HTTP/1.1 400 Bad Request\r\n", "$x\r\n", "*\r\n", "\r\n"] {
            let read = ReplyMeter::new(1 << 30).read(garbage.as_bytes());
            assert!(read.is_err(), "{garbage:?}");
        }
    }
}
