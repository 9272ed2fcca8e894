//! Parses `multipart/x-mixed-replace`, the format of MJPEG cameras (RFC 2046, section 5.1, with the
//! deviations of cameras).
//!
//! The boundary is accepted with and without its leading dashes, lines may end without a carriage
//! return, and `Content-Length` may be missing or wrong. A stream without a usable boundary is
//! split by the JPEG files in it.

use bytes::{Bytes, BytesMut};
use lookdown_common::{JPEG_END, JPEG_START};
use memchr::memmem;

use crate::{SourceError, image_splitter::ImageSplitter};

/// Most bytes of the headers of a part.
const MAX_HEADER_BYTES: usize = 8 << 10;
/// Most bytes before the first boundary, and after a body of a wrong length.
const MAX_BYTES_BETWEEN: usize = 64 << 10;

/// A parser that takes bytes as they arrive, and returns whole bodies.
#[derive(Debug)]
pub(crate) struct PartReader {
    buffer: BytesMut,
    boundary: Vec<u8>,
    max_part_bytes: usize,
    state: State,
    /// Number of bytes that do not contain what is searched for.
    searched: usize,
    /// Reads the stream instead, if it has no usable boundary.
    splitter: Option<ImageSplitter>,
}

#[derive(Debug, Clone, Copy)]
enum State {
    /// Before a boundary.
    Boundary,
    /// In the headers of a part.
    Headers,
    /// In a body, with the length that its headers declare.
    Body(Option<usize>),
}

/// Returns the error of a frame that exceeds the limit.
fn too_large() -> SourceError {
    let problem = "a frame of the camera's multipart stream is too large: reduce its resolution";
    SourceError::Stream(problem.to_owned())
}

impl PartReader {
    /// Creates a parser for a `Content-Type`, with a limit for each part.
    pub(crate) fn new(content_type: &str, max_part_bytes: usize) -> Self {
        let boundary = boundary_of(content_type);
        Self {
            buffer: BytesMut::new(),
            boundary: [b"--", boundary.unwrap_or_default().as_bytes()].concat(),
            max_part_bytes,
            state: State::Boundary,
            searched: 0,
            splitter: boundary
                .is_none()
                .then(|| ImageSplitter::new(max_part_bytes)),
        }
    }

    /// Appends received bytes.
    pub(crate) fn push(&mut self, bytes: &[u8]) {
        match &mut self.splitter {
            Some(splitter) => splitter.buffer().extend_from_slice(bytes),
            None => self.buffer.extend_from_slice(bytes),
        }
    }

    /// The number of bytes in the buffer.
    pub(crate) fn buffered(&self) -> usize {
        let splitter = self.splitter.as_ref();
        splitter.map_or(self.buffer.len(), ImageSplitter::buffered)
    }

    /// Splits the rest of the stream by its JPEG files.
    fn split(&mut self) -> Option<Bytes> {
        let mut splitter = ImageSplitter::new(self.max_part_bytes);
        splitter.buffer().extend_from_slice(&self.buffer.split());
        self.splitter.insert(splitter).next_file()
    }

    /// Returns the body of the next part, or `None` if more bytes are needed.
    ///
    /// # Errors
    /// [`SourceError`] if the stream cannot be read further.
    pub(crate) fn next_part(&mut self) -> Result<Option<Bytes>, SourceError> {
        if let Some(splitter) = &mut self.splitter {
            return Ok(splitter.next_file());
        }
        loop {
            match self.state {
                State::Boundary => {
                    let Some(end) = self.end_of_boundary_line() else {
                        // An image before any boundary: it has another one than is declared.
                        let image = memmem::find(&self.buffer, JPEG_START);
                        let is_whole = image.is_some_and(|at| {
                            at == 0 || memmem::find(&self.buffer[at..], JPEG_END).is_some()
                        });
                        let has_none = self.buffer.len() > MAX_BYTES_BETWEEN;
                        return Ok(if has_none || is_whole {
                            self.split()
                        } else {
                            None
                        });
                    };
                    self.consume(end, State::Headers);
                }
                State::Headers => {
                    let Some(end) = self.end_of_headers()? else {
                        return Ok(None);
                    };
                    let length = content_length(&self.buffer[..end]);
                    self.consume(end, State::Body(length));
                }
                State::Body(length) => {
                    let body = match length {
                        Some(length) => self.body_of_length(length)?,
                        None => self.body_up_to_boundary()?,
                    };
                    let Some(body) = body else { return Ok(None) };
                    self.state = State::Boundary;
                    if body.len() > self.buffer.len() {
                        // The rest would keep the memory of the body.
                        self.buffer = BytesMut::from(&self.buffer[..]);
                    }
                    if !body.is_empty() {
                        return Ok(Some(body));
                    }
                }
            }
        }
    }

    fn consume(&mut self, count: usize, state: State) -> Bytes {
        self.searched = 0;
        self.state = state;
        self.buffer.split_to(count).freeze()
    }

    /// Returns the position of a boundary, or remembers that there is none so far.
    fn find_boundary(&mut self) -> Option<usize> {
        let found = memmem::find(&self.buffer[self.searched..], &self.boundary);
        if found.is_none() {
            let certain = self.buffer.len().saturating_sub(self.boundary.len());
            self.searched = self.searched.max(certain);
        }
        found.map(|found| self.searched + found)
    }

    fn end_of_boundary_line(&mut self) -> Option<usize> {
        let start = self.find_boundary()?;
        let line = memchr::memchr(b'\n', &self.buffer[start..])?;
        Some(start + line + 1)
    }

    fn end_of_headers(&self) -> Result<Option<usize>, SourceError> {
        let head = &self.buffer[..self.buffer.len().min(MAX_HEADER_BYTES)];
        // A part without headers starts with the empty line.
        let end = match head {
            [b'\n', ..] => Some(1),
            [b'\r', b'\n', ..] => Some(2),
            _ => {
                let long = memmem::find(head, b"\n\r\n").map(|at| at + 3);
                let short = memmem::find(head, b"\n\n").map(|at| at + 2);
                [long, short].into_iter().flatten().min()
            }
        };
        if end.is_none() && self.buffer.len() > MAX_HEADER_BYTES {
            return Err(SourceError::Stream(format!(
                "a part of the camera's multipart stream has more than {MAX_HEADER_BYTES} bytes of \
                 headers: give the URL of a JPEG snapshot or RTSP"
            )));
        }
        Ok(end)
    }

    fn body_of_length(&mut self, length: usize) -> Result<Option<Bytes>, SourceError> {
        let is_jpeg = self.buffer.starts_with(&JPEG_START[..2]);
        if length > self.max_part_bytes && is_jpeg {
            self.state = State::Body(None);
            return self.body_up_to_boundary();
        }
        if length > self.max_part_bytes {
            let has_begun = self.buffer.len() >= 2;
            return if has_begun {
                Err(too_large())
            } else {
                Ok(None)
            };
        }
        if !is_jpeg || ends_jpeg(self.buffer.get(..length).unwrap_or_default()) {
            let is_whole = self.buffer.len() >= length;
            return Ok(is_whole.then(|| self.consume(length, State::Boundary)));
        }
        // The length is not that of the image: up to the boundary, if that is behind an image.
        let boundary = self.find_boundary();
        let is_behind = boundary.is_some_and(|end| {
            let dashes = self.buffer[..end]
                .iter()
                .rev()
                .take_while(|byte| **byte == b'-');
            ends_jpeg(&self.buffer[..end - dashes.count()])
        });
        if is_behind || self.buffer.len() >= length {
            self.state = State::Body(None);
            return self.body_up_to_boundary();
        }
        Ok(None)
    }

    fn body_up_to_boundary(&mut self) -> Result<Option<Bytes>, SourceError> {
        let found = self.find_boundary();
        if found.unwrap_or(self.searched) > self.max_part_bytes {
            return Err(too_large());
        }
        let Some(mut end) = found else {
            return Ok(None);
        };
        // The boundary itself may begin with dashes that its declaration lacks.
        while end > 0 && self.buffer[end - 1] == b'-' {
            end -= 1;
        }
        for ending in [b'\n', b'\r'] {
            if end > 0 && self.buffer[end - 1] == ending {
                end -= 1;
            }
        }
        Ok(Some(self.consume(end, State::Boundary)))
    }
}

/// Returns true for bytes that end with the end of a JPEG, possibly with padding.
fn ends_jpeg(bytes: &[u8]) -> bool {
    let padded = |byte: &u8| matches!(byte, 0 | b'\r' | b'\n');
    let end = bytes.iter().rposition(|byte| !padded(byte));
    end.is_some_and(|end| bytes[..=end].ends_with(JPEG_END))
}

/// Returns the boundary of a `Content-Type` without leading dashes.
fn boundary_of(content_type: &str) -> Option<&str> {
    let mut parameters = content_type.split(';').skip(1);
    let value = parameters.find_map(|parameter| {
        let (name, value) = parameter.split_once('=')?;
        let is_boundary = name.trim().eq_ignore_ascii_case("boundary");
        is_boundary.then(|| value.trim().trim_matches('"'))
    })?;
    let value = value.trim_start_matches('-');
    (!value.is_empty()).then_some(value)
}

/// Returns the declared length of a body.
fn content_length(headers: &[u8]) -> Option<usize> {
    let headers = std::str::from_utf8(headers).ok()?;
    headers
        .lines()
        .find_map(|line| {
            let (name, value) = line.split_once(':')?;
            let is_length = name.trim().eq_ignore_ascii_case("content-length");
            is_length.then(|| value.trim().parse().ok())?
        })
        // Some cameras declare 0 for a length that they do not know.
        .filter(|length| *length > 0)
}

#[cfg(test)]
mod tests {
    use super::*;

    const TYPE: &str = "multipart/x-mixed-replace; boundary=frame";

    fn parts(content_type: &str, stream: &[u8], chunk: usize) -> Result<Vec<Bytes>, SourceError> {
        let mut reader = PartReader::new(content_type, 100);
        let mut parts = Vec::new();
        for bytes in stream.chunks(chunk) {
            reader.push(bytes);
            while let Some(part) = reader.next_part()? {
                parts.push(part);
            }
        }
        Ok(parts)
    }

    #[test]
    fn parts_are_read_at_any_chunk_size() {
        let stream = b"--frame\r\nContent-Type: image/jpeg\r\nContent-Length: 3\r\n\r\none\r\n\
            --frame\r\nContent-Type: image/jpeg\r\n\r\ntwo\r\n--frame\r\n\r\n3--3\r\n--frame--\r\n";
        for chunk in [1, 2, 5, 1000] {
            assert_eq!(parts(TYPE, stream, chunk).unwrap(), ["one", "two", "3--3"]);
        }
    }

    #[test]
    fn deviations_of_cameras_are_accepted() {
        let doubled = "multipart/x-mixed-replace;boundary=\"--frame\"";
        let stream = b"----frame\nContent-length:3\n\none\n----frame\n\ntwo\n----frame\n";
        let declared = b"--frame\nContent-length:3\n\none\n--frame\n\ntwo\n--frame\n";
        for chunk in [1, 1000] {
            assert_eq!(parts(doubled, stream, chunk).unwrap(), ["one", "two"]);
            assert_eq!(parts(doubled, declared, chunk).unwrap(), ["one", "two"]);
        }
    }

    #[test]
    fn the_rest_of_a_stream_does_not_keep_a_part_in_memory() {
        let mut reader = PartReader::new(TYPE, 100);
        reader.push(b"--frame\r\nContent-Length: 90\r\n\r\n");
        reader.push(&[b'x'; 90]);
        reader.push(b"\r\n--frame\r\n");
        let part = reader.next_part().unwrap().unwrap();
        assert!(part.is_unique());
        assert!(reader.buffered() > 0);
    }

    #[test]
    fn a_wrong_length_costs_one_part_only() {
        let stream =
            b"--frame\r\nContent-Length: 2\r\n\r\nwrong\r\n--frame\r\n\r\nright\r\n--frame\r\n";
        assert_eq!(parts(TYPE, stream, 4).unwrap(), ["wr", "right"]);
    }

    #[test]
    fn large_parts_and_endless_headers_are_refused() {
        let declared = b"--frame\r\nContent-Length: 101\r\n\r\nxx";
        let problem = |stream, chunk| parts(TYPE, stream, chunk).unwrap_err().to_string();
        assert!(problem(declared, 1).contains("is too large"));
        let endless = [b"--frame\r\n\r\n".as_slice(), &[b'x'; 500]].concat();
        assert!(problem(&endless, 10).contains("is too large"));
        let headers = [b"--frame\r\n".as_slice(), &[b'x'; 9000]].concat();
        assert!(problem(&headers, 1000).contains("bytes of headers"));
    }

    const JPEG: &[u8] = b"\xff\xd8\xff\xda\x00\x02xyz\xff\xd9";

    /// A stream of two images whose parts have this header.
    fn stream(header: &str) -> Vec<u8> {
        let part = [
            b"--frame\r\n",
            header.as_bytes(),
            b"\r\n\r\n",
            JPEG,
            b"\r\n",
        ]
        .concat();
        [&part, &part, b"--frame\r\n".as_slice()].concat()
    }

    #[test]
    fn streams_without_a_usable_boundary_are_split_by_images() {
        let noise = [vec![b'x'; 70_000], stream("A: b")].concat();
        for content_type in [
            "",
            "multipart/x-mixed-replace",
            "a/b; boundary=--",
            "a/b; boundary=x",
        ] {
            for chunk in [1, 1000] {
                let found = parts(content_type, &noise, chunk).unwrap();
                assert_eq!(found, [JPEG, JPEG], "{content_type}");
            }
        }
        // Another boundary than is declared, with little before the image.
        let other = stream("A: b");
        assert_eq!(parts("a/b; boundary=x", &other, 1).unwrap(), [JPEG, JPEG]);
        // A snapshot with the label of a stream.
        assert_eq!(parts(TYPE, JPEG, 4).unwrap(), [JPEG]);
    }

    #[test]
    fn wrong_lengths_of_images_are_corrected() {
        for length in [0, 3, 9, 12, 15, 40, 90, 999] {
            let stream = stream(&format!("Content-Length: {length}"));
            for chunk in [1, 7, 1000] {
                let found = parts(TYPE, &stream, chunk).unwrap();
                let is_whole = found.iter().all(|part| part.starts_with(JPEG));
                assert!(found.len() == 2 && is_whole, "{length}: {found:?}");
            }
        }
    }
}
