//! Splits a stream of concatenated JPEG files, or of PPM files, into files.
//!
//! The segments of a JPEG are followed, so a thumbnail within a file does not end it. Damaged bytes
//! are skipped up to the start of the next JPEG.

use bytes::{Bytes, BytesMut};
use lookdown_common::{JPEG_START, MAX_PPM_HEADER_BYTES, jpeg_length, ppm_length};

/// Bytes that are read at once.
const CHUNK_BYTES: usize = 64 << 10;

/// A parser that takes bytes as they arrive, and returns whole files.
#[derive(Debug)]
pub(crate) struct ImageSplitter {
    buffer: BytesMut,
    max_bytes: usize,
    /// The state before a file: only `ffmpeg` sends pixels, which no camera may.
    start: State,
    state: State,
    /// Number of bytes of the buffer that were parsed; in a PPM, the length of the file.
    parsed: usize,
    /// True once a PPM was longer than a file may be.
    pub(crate) has_skipped_pixels: bool,
    /// The last PPM. Once it is in use no longer, the next one gets its memory: new pages would
    /// take a tenth of the time of a frame.
    last_pixels: Bytes,
}

#[derive(Debug, Clone, Copy)]
enum State {
    /// Before the start of a JPEG.
    Start,
    /// At a marker.
    Marker,
    /// In the compressed data of a scan.
    Scan,
    /// Before the end of the header of a PPM.
    PpmHeader,
    /// In a PPM.
    Pixels,
}

/// The result of one step.
enum Step {
    Continue,
    NeedsMore,
    Whole,
}

impl ImageSplitter {
    /// Creates a splitter of JPEG files with at most this many bytes.
    pub(crate) fn new(max_bytes: usize) -> Self {
        Self::from_state(State::Start, max_bytes)
    }

    /// Creates a splitter of PPM files with at most this many bytes.
    pub(crate) fn for_pixels(max_bytes: usize) -> Self {
        Self::from_state(State::PpmHeader, max_bytes)
    }

    fn from_state(start: State, max_bytes: usize) -> Self {
        Self {
            buffer: BytesMut::new(),
            max_bytes,
            start,
            state: start,
            parsed: 0,
            has_skipped_pixels: false,
            last_pixels: Bytes::new(),
        }
    }

    /// The buffer that received bytes are appended to, with room for a chunk, or for the rest of a
    /// PPM.
    pub(crate) fn buffer(&mut self) -> &mut BytesMut {
        self.buffer.reserve(match self.state {
            State::Pixels => self.parsed - self.buffer.len(),
            _ => CHUNK_BYTES,
        });
        &mut self.buffer
    }

    /// The number of bytes in the buffer.
    pub(crate) fn buffered(&self) -> usize {
        self.buffer.len()
    }

    /// Returns the next whole file, or `None` if more bytes are needed.
    pub(crate) fn next_file(&mut self) -> Option<Bytes> {
        loop {
            match self.step() {
                Step::Whole => {
                    let file = self.buffer.split_to(self.parsed).freeze();
                    if matches!(self.state, State::Pixels) {
                        self.last_pixels = file.clone();
                    }
                    self.restart();
                    return Some(file);
                }
                Step::Continue => {}
                Step::NeedsMore => {
                    if self.buffer.len() > self.max_bytes {
                        self.skip(self.buffer.len());
                    }
                    return None;
                }
            }
        }
    }

    fn restart(&mut self) {
        self.state = self.start;
        self.parsed = 0;
    }

    /// Drops the first bytes, and searches for the next file after them.
    fn skip(&mut self, count: usize) {
        let _ = self.buffer.split_to(count.min(self.buffer.len()));
        self.restart();
    }

    fn step(&mut self) -> Step {
        match self.state {
            State::Start => self.find_start(),
            State::PpmHeader => self.read_ppm_header(),
            State::Marker => self.read_marker(),
            State::Scan => self.read_scan(),
            State::Pixels if self.buffer.len() >= self.parsed => Step::Whole,
            State::Pixels => Step::NeedsMore,
        }
    }

    fn read_ppm_header(&mut self) -> Step {
        match ppm_length(&self.buffer) {
            Some(length) if length <= self.max_bytes => {
                self.parsed = length;
                self.state = State::Pixels;
                if let Ok(mut unused) = std::mem::take(&mut self.last_pixels).try_into_mut() {
                    unused.clear();
                    unused.extend_from_slice(&self.buffer);
                    self.buffer = unused;
                }
            }
            None if self.buffer.len() < MAX_PPM_HEADER_BYTES => return Step::NeedsMore,
            too_long => {
                self.has_skipped_pixels |= too_long.is_some();
                self.skip(self.buffer.len());
                return Step::NeedsMore;
            }
        }
        Step::Continue
    }

    fn find_start(&mut self) -> Step {
        match memchr::memmem::find(&self.buffer, JPEG_START) {
            Some(0) => {
                self.parsed = 2;
                self.state = State::Marker;
                Step::Continue
            }
            Some(before) => {
                self.skip(before);
                Step::Continue
            }
            None => {
                let certain = self.buffer.len().saturating_sub(JPEG_START.len() - 1);
                self.skip(certain);
                Step::NeedsMore
            }
        }
    }

    fn read_marker(&mut self) -> Step {
        let Some([first, second]) = self.bytes_at(self.parsed) else {
            return Step::NeedsMore;
        };
        if first != 0xff {
            self.skip(self.parsed);
            return Step::Continue;
        }
        match second {
            // A fill byte.
            0xff => self.parsed += 1,
            0xd9 => {
                self.parsed += 2;
                return Step::Whole;
            }
            // The start of another file: some cameras leave out the end marker.
            0xd8 if jpeg_length(&self.buffer[..self.parsed]).is_some() => return Step::Whole,
            // A byte that is not a marker, or another file after a damaged one.
            0xd8 | 0x00 => self.skip(self.parsed),
            // Markers without a segment.
            0x01 | 0xd0..=0xd7 => self.parsed += 2,
            marker => {
                let Some(length) = self.bytes_at(self.parsed + 2) else {
                    return Step::NeedsMore;
                };
                let length = usize::from(u16::from_be_bytes(length));
                if length < 2 {
                    self.skip(self.parsed);
                    return Step::Continue;
                }
                self.parsed += 2 + length;
                if marker == 0xda {
                    self.state = State::Scan;
                }
            }
        }
        Step::Continue
    }

    fn read_scan(&mut self) -> Step {
        let rest = self.buffer.get(self.parsed..).unwrap_or_default();
        let Some(found) = memchr::memchr(0xff, rest) else {
            self.parsed = self.parsed.max(self.buffer.len());
            return Step::NeedsMore;
        };
        self.parsed += found;
        match self.bytes_at(self.parsed) {
            None => return Step::NeedsMore,
            // A byte of the data, or a restart marker.
            Some([_, 0x00 | 0xd0..=0xd7]) => self.parsed += 2,
            Some([_, 0xff]) => self.parsed += 1,
            Some(_) => self.state = State::Marker,
        }
        Step::Continue
    }

    fn bytes_at(&self, position: usize) -> Option<[u8; 2]> {
        let bytes = self.buffer.get(position..position + 2)?;
        bytes.try_into().ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A JPEG with a thumbnail in a segment, and a scan with a stuffed byte and a restart marker.
    const WHOLE: &[u8] =
        b"\xff\xd8\xff\xe1\x00\x08\xff\xd8\xff\xd9..\xff\xda\x00\x02ab\xff\x00c\xff\xd0d\xff\xd9";
    const SMALL: &[u8] = b"\xff\xd8\xff\xda\x00\x02xyz\xff\xd9";

    fn files(stream: &[u8], chunk: usize) -> Vec<Bytes> {
        split(ImageSplitter::new(1000), stream, chunk)
    }

    fn split(mut splitter: ImageSplitter, stream: &[u8], chunk: usize) -> Vec<Bytes> {
        let mut files = Vec::new();
        for bytes in stream.chunks(chunk) {
            splitter.buffer().extend_from_slice(bytes);
            while let Some(file) = splitter.next_file() {
                files.push(file);
            }
        }
        files
    }

    #[test]
    fn concatenated_files_are_split_at_any_chunk_size() {
        let stream = [WHOLE, SMALL, WHOLE].concat();
        for chunk in [1, 2, 3, 7, 1000] {
            assert_eq!(files(&stream, chunk), [WHOLE, SMALL, WHOLE], "{chunk}");
        }
    }

    #[test]
    fn pixels_are_split_at_any_chunk_size() {
        let ppm = b"P6\n2 1\n255\nP6\n\xff\xd8\xff";
        for chunk in [1, 2, 7, 1000] {
            let found = split(ImageSplitter::for_pixels(1000), &ppm.repeat(3), chunk);
            assert_eq!(found, [&ppm[..]; 3], "{chunk}");
        }
        // A camera sends none.
        assert_eq!(files(&[&ppm[..11], SMALL].concat(), 1000), [SMALL]);
    }

    #[test]
    fn pixels_get_the_memory_of_those_that_are_in_use_no_longer() {
        let mut splitter = ImageSplitter::for_pixels(1 << 20);
        let file = [&b"P6\n300 300\n255\n"[..], &vec![7; 3 * 300 * 300]].concat();
        let mut next = || {
            let mut found = None;
            for part in file.chunks(CHUNK_BYTES) {
                splitter.buffer().extend_from_slice(part);
                found = splitter.next_file();
            }
            // Reads on before the file is used.
            splitter.buffer();
            found.unwrap()
        };
        let first = next();
        let kept = first.as_ptr();
        drop(first);
        let second = next();
        assert_eq!((second.as_ptr(), &second[..]), (kept, &file[..]));
        // While it is in use, the next one has memory of its own.
        assert_ne!(next().as_ptr(), kept);
    }

    #[test]
    fn pixels_beyond_the_limit_are_skipped_and_told() {
        for (header, is_told) in [("P6\n20 20\n255\n", true), ("P6\nx 20\n255\n", false)] {
            let mut splitter = ImageSplitter::for_pixels(1000);
            splitter.buffer().extend_from_slice(header.as_bytes());
            splitter
                .buffer()
                .extend_from_slice(&[0; MAX_PPM_HEADER_BYTES]);
            assert_eq!(splitter.next_file(), None);
            assert_eq!(splitter.has_skipped_pixels, is_told, "{header}");
            assert_eq!(splitter.buffered(), 0);
        }
    }

    #[test]
    fn damaged_bytes_are_skipped_up_to_the_next_file() {
        let cut = &WHOLE[..WHOLE.len() - 2];
        for damaged in [
            b"noise\xff".as_slice(),
            cut,
            b"\xff\xd8\xff\x00",
            b"\xff\xd8\xff\xe0\x00\x01",
        ] {
            let stream = [SMALL, damaged, SMALL].concat();
            for chunk in [1, 5, 1000] {
                let found = files(&stream, chunk);
                assert_eq!(found, [SMALL, SMALL], "{damaged:x?} in chunks of {chunk}");
            }
        }
    }

    #[test]
    fn a_file_without_an_end_is_bounded() {
        let mut splitter = ImageSplitter::new(1000);
        splitter
            .buffer()
            .extend_from_slice(b"\xff\xd8\xff\xda\x00\x02");
        for _ in 0..100 {
            splitter.buffer().extend_from_slice(&[b'x'; 100]);
            assert_eq!(splitter.next_file(), None);
            assert!(splitter.buffer().len() <= 1000);
        }
        splitter.buffer().extend_from_slice(SMALL);
        assert_eq!(splitter.next_file().as_deref(), Some(SMALL));
    }
}
