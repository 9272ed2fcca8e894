//! Reuse of the memory of frames.
//!
//! An allocator that returns freed memory to the kernel, as configured by `make serve` and in the
//! container image, gets zeroed pages for each new frame. That took 1 to 3 % of all processor time
//! (lab/benches/NOTES.md).

use std::{
    mem,
    ops::{Deref, DerefMut},
};

use parking_lot::Mutex;

/// Largest memory kept for reuse, bytes: a few frames of a common camera.
const MOST_KEPT_BYTES: usize = 64 << 20;
/// Smaller buffers are not kept, bytes.
const LEAST_KEPT_BYTES: usize = 1 << 20;

static KEPT: Mutex<Vec<Vec<u8>>> = Mutex::new(Vec::new());

/// Returns `count` zeros, in the memory of an earlier frame if available. No earlier pixels remain.
pub(super) fn zeros(count: usize) -> Vec<u8> {
    let kept = (count >= LEAST_KEPT_BYTES).then(take).flatten();
    match kept {
        Some(mut bytes) => {
            bytes.clear();
            bytes.resize(count, 0);
            bytes
        }
        // Newly allocated pages are already zero.
        None => vec![0; count],
    }
}

fn take() -> Option<Vec<u8>> {
    KEPT.lock().pop()
}

fn keep(bytes: Vec<u8>) {
    if bytes.capacity() < LEAST_KEPT_BYTES {
        return;
    }
    let mut kept = KEPT.lock();
    let kept_bytes: usize = kept.iter().map(Vec::capacity).sum();
    if kept_bytes + bytes.capacity() <= MOST_KEPT_BYTES {
        kept.push(bytes);
    }
}

/// The bytes of a frame. Their memory is kept for reuse when the frame is dropped.
#[derive(Clone, PartialEq, Eq)]
pub(super) struct Pixels(Vec<u8>);

impl From<Vec<u8>> for Pixels {
    fn from(bytes: Vec<u8>) -> Self {
        Self(bytes)
    }
}

impl Deref for Pixels {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        &self.0
    }
}

impl DerefMut for Pixels {
    fn deref_mut(&mut self) -> &mut [u8] {
        &mut self.0
    }
}

impl Drop for Pixels {
    fn drop(&mut self) {
        keep(mem::take(&mut self.0));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reused_frame_memory_is_zeroed() {
        for _ in 0..100 {
            drop(Pixels::from(vec![7; 3 << 20]));
            assert!(zeros(2 << 20).iter().all(|&byte| byte == 0));
        }
    }

    #[test]
    fn no_more_than_a_few_frames_are_kept() {
        for _ in 0..100 {
            keep(vec![1; 8 << 20]);
            let kept = KEPT.lock();
            let bytes: usize = kept.iter().map(Vec::capacity).sum();
            assert!(bytes <= MOST_KEPT_BYTES, "{bytes}");
        }
    }
}
