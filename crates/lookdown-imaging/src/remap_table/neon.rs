//! Sampling eight pixels at a time with NEON, as two vectors of four. To the bit what `scalar`
//! does: the same operations in the same order, none of them fused.
//!
//! Pixels are read through slices; what is unsafe is to call a function that needs NEON, and to see
//! arrays as vectors and vectors as arrays.

use std::{
    arch::aarch64::{
        float32x4_t, int32x4_t, uint8x16_t, uint8x16x2_t, uint32x4_t, vabsq_f32, vaddq_f32,
        vaddq_s32, vandq_u32, vbslq_f32, vceqq_u32, vcgtq_f32, vcleq_f32, vcltq_f32, vcvtq_f32_s32,
        vcvtq_f32_u32, vcvtq_s32_f32, vdupq_n_f32, vdupq_n_s32, vdupq_n_u32, vminq_s32, vmlaq_s32,
        vmlaq_u32, vmulq_f32, vmulq_n_s32, vmulq_u32, vqtbl2q_u8, vreinterpretq_f32_u32,
        vreinterpretq_u32_f32, vreinterpretq_u32_s32, vreinterpretq_u32_u8, vsubq_f32, vsubq_u32,
    },
    mem::transmute,
};

use super::{
    band::{Band, Block, Lanes, Seen},
    block_size::LANES,
    rendering::{FrameLines, PAIR_BYTES, Planes, Source, WEIGHT_ONE, pair, render_band},
};

/// Pixels in a vector.
const QUARTET: usize = 4;
/// The bytes of one pixel.
const PIXEL_BYTES: u8 = 3;
/// A table index that selects no byte, but zero.
const NO_BYTE: u8 = 0xff;

/// Exists only where the processor has NEON.
#[derive(Debug, Clone, Copy)]
pub(super) struct Supported(());

impl Supported {
    /// Proof of NEON, if the processor has it.
    pub(super) fn detect() -> Option<Self> {
        std::arch::is_aarch64_feature_detected!("neon").then_some(Self(()))
    }
}

/// As `scalar::render`, for frames of less than 2 GiB.
pub(super) fn render(_proof: Supported, source: &Source, band: &Band, planes: Planes) {
    // SAFETY: there is proof that the processor has NEON.
    unsafe { render_with_neon(source, band, planes) }
}

#[target_feature(enable = "neon")]
fn render_with_neon(source: &Source, band: &Band, planes: Planes) {
    let frame_lines = FrameLines::new(source);
    let locate = |block: &Block, seen| match seen {
        Seen::Whole => [0, QUARTET].map(|first| whole_samples(source, block, first)),
        Seen::Lanes(lanes) => [0, QUARTET].map(|first| samples(source, block, first, lanes)),
    };
    let sample = |[left, right]: &[Samples; 2], _| {
        let left = sample_quartet(source, &frame_lines, left);
        let right = sample_quartet(source, &frame_lines, right);
        [0, 1, 2].map(|channel| joined(left[channel], right[channel]))
    };
    render_band(source, band, planes, locate, sample, |_| {});
}

/// Sampling positions and weights of four pixels.
struct Samples {
    /// Index of the first byte of each upper left neighbor.
    first_bytes: [u32; QUARTET],
    left_weight: uint32x4_t,
    right_weight: uint32x4_t,
    lower_weight: float32x4_t,
    /// All bits set where something is seen.
    is_visible: uint32x4_t,
}

#[target_feature(enable = "neon")]
fn sample_quartet(
    source: &Source,
    frame_lines: &FrameLines,
    samples: &Samples,
) -> [float32x4_t; 3] {
    let upper = pixel_pairs(frame_lines.upper, &samples.first_bytes);
    let lower = pixel_pairs(frame_lines.lower, &samples.first_bytes);
    [0, 1, 2].map(|channel| {
        let upper = weighted_sum(upper, channel, samples);
        let lower = weighted_sum(lower, 2 + channel, samples);
        let share = vmulq_f32(vsubq_f32(lower, upper), samples.lower_weight);
        let sum = vreinterpretq_u32_f32(vaddq_f32(upper, share));
        let sum = vreinterpretq_f32_u32(vandq_u32(sum, samples.is_visible));
        let channel = usize::from(channel);
        let scaled = vmulq_f32(sum, vdupq_n_f32(source.scale[channel]));
        vaddq_f32(scaled, vdupq_n_f32(source.offset[channel]))
    })
}

/// The samples of four pixels that all show the lens image, within the frame.
#[target_feature(enable = "neon")]
fn whole_samples(source: &Source, block: &Block, first_lane: usize) -> Samples {
    let [left, top] = [0, 1].map(|axis| {
        let position = positions(block.start[axis], block.step[axis], first_lane);
        Neighbors::new(position, vcvtq_s32_f32(position))
    });
    Samples::new(source, &left, &top, vdupq_n_u32(u32::MAX))
}

#[target_feature(enable = "neon")]
fn samples(source: &Source, block: &Block, first_lane: usize, lanes: Lanes) -> Samples {
    let [x, y] = [0, 1].map(|axis| positions(block.start[axis], block.step[axis], first_lane));
    let (left, is_within_width) = split(x, source.width);
    let (top, is_within_height) = split(y, source.height);
    let bits = from_words([1, 2, 4, 8].map(|bit| bit << first_lane));
    let sees_lens = vceqq_u32(vandq_u32(vdupq_n_u32(u32::from(lanes)), bits), bits);
    let is_within = vandq_u32(is_within_width, is_within_height);
    Samples::new(source, &left, &top, vandq_u32(is_within, sees_lens))
}

impl Samples {
    #[target_feature(enable = "neon")]
    fn new(source: &Source, left: &Neighbors, top: &Neighbors, is_visible: uint32x4_t) -> Self {
        let pixel = vmlaq_s32(left.lower, top.lower, whole(source.width));
        let first_byte = vmulq_n_s32(pixel, i32::from(PIXEL_BYTES));
        let right = vmulq_f32(left.upper_weight, vdupq_n_f32(f32::from(WEIGHT_ONE)));
        let right = vreinterpretq_u32_s32(vcvtq_s32_f32(right));
        Self {
            first_bytes: to_words(vreinterpretq_u32_s32(first_byte)),
            left_weight: vsubq_u32(vdupq_n_u32(u32::from(WEIGHT_ONE.unsigned_abs())), right),
            right_weight: right,
            lower_weight: top.upper_weight,
            is_visible,
        }
    }
}

/// Along one axis, of two neighbors each the lower one (the left or upper one in the frame), and
/// the weight of the other.
struct Neighbors {
    lower: int32x4_t,
    upper_weight: float32x4_t,
}

impl Neighbors {
    #[target_feature(enable = "neon")]
    fn new(position: float32x4_t, lower: int32x4_t) -> Self {
        Self {
            lower,
            upper_weight: vsubq_f32(position, vcvtq_f32_s32(lower)),
        }
    }
}

/// Along one axis, where four pixels of a block sample.
#[target_feature(enable = "neon")]
fn positions(start: f32, step: f32, first_lane: usize) -> float32x4_t {
    let lanes = vcvtq_f32_s32(vaddq_s32(whole(first_lane), from_signed([0, 1, 2, 3])));
    vaddq_f32(vdupq_n_f32(start), vmulq_f32(vdupq_n_f32(step), lanes))
}

/// As `scalar::split`: neighbors, and whether that is within.
#[target_feature(enable = "neon")]
fn split(position: float32x4_t, count: usize) -> (Neighbors, uint32x4_t) {
    let (first, last) = (vdupq_n_f32(0.0), vcvtq_f32_s32(whole(count - 1)));
    // What is not a number becomes 0, and is not within.
    let within = vbslq_f32(vcgtq_f32(position, first), position, first);
    let within = vbslq_f32(vcltq_f32(within, last), within, last);
    let beyond = vabsq_f32(vsubq_f32(position, within));
    let is_within = vcleq_f32(beyond, vdupq_n_f32(0.5));
    let lower = vminq_s32(vcvtq_s32_f32(within), whole(count - 2));
    (Neighbors::new(within, lower), is_within)
}

/// Eight bytes from each of the given ones.
#[target_feature(enable = "neon")]
fn pixel_pairs(lines: &[u8], first_bytes: &[u32; QUARTET]) -> uint8x16x2_t {
    let pairs = first_bytes.map(|first| pair(lines, first));
    // SAFETY: both are 32 bytes, and all values of these are valid.
    unsafe { transmute::<[[u8; PAIR_BYTES]; QUARTET], uint8x16x2_t>(pairs) }
}

/// The weighted sums of pairs of pixels: the byte `first_byte` of each pair, and the same channel
/// of its right pixel.
#[target_feature(enable = "neon")]
fn weighted_sum(pairs: uint8x16x2_t, first_byte: u8, samples: &Samples) -> float32x4_t {
    let left = bytes_of_pairs(pairs, first_byte);
    let right = bytes_of_pairs(pairs, first_byte + PIXEL_BYTES);
    let sum = vmulq_u32(left, samples.left_weight);
    vcvtq_f32_u32(vmlaq_u32(sum, right, samples.right_weight))
}

/// One byte of each pair.
#[target_feature(enable = "neon")]
fn bytes_of_pairs(pairs: uint8x16x2_t, byte: u8) -> uint32x4_t {
    let selected = [0, 8, 16, 24].map(|pair| [pair + byte, NO_BYTE, NO_BYTE, NO_BYTE]);
    // SAFETY: both are 16 bytes, and all values of these are valid.
    let selected = unsafe { transmute::<[[u8; 4]; QUARTET], uint8x16_t>(selected) };
    vreinterpretq_u32_u8(vqtbl2q_u8(pairs, selected))
}

/// A number of pixels in all lanes.
#[target_feature(enable = "neon")]
fn whole(count: usize) -> int32x4_t {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_possible_wrap,
        reason = "a frame of less than 2 GiB"
    )]
    vdupq_n_s32(count as i32)
}

fn from_words(words: [u32; QUARTET]) -> uint32x4_t {
    // SAFETY: both are 16 bytes, and all values of these are valid.
    unsafe { transmute(words) }
}

fn from_signed(words: [i32; QUARTET]) -> int32x4_t {
    // SAFETY: both are 16 bytes, and all values of these are valid.
    unsafe { transmute(words) }
}

fn to_words(vector: uint32x4_t) -> [u32; QUARTET] {
    // SAFETY: both are 16 bytes, and all values of these are valid.
    unsafe { transmute(vector) }
}

fn joined(left: float32x4_t, right: float32x4_t) -> [f32; LANES] {
    // SAFETY: both are 32 bytes, and all values of these are valid.
    unsafe { transmute([left, right]) }
}
