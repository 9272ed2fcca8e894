//! Sampling eight pixels at a time with AVX2. To the bit what `scalar` does: the same operations in
//! the same order, none of them fused.
//!
//! Pixels are read through slices; what is unsafe is to call functions that need AVX2,
//! and to see a vector as an array.

use std::{
    arch::x86_64::{
        __m256, __m256i, _CMP_LE_OQ, _MM_HINT_T0, _mm_prefetch, _mm256_add_epi32, _mm256_add_ps,
        _mm256_and_ps, _mm256_and_si256, _mm256_andnot_ps, _mm256_castps_si256,
        _mm256_castsi256_ps, _mm256_cmp_ps, _mm256_cmpeq_epi32, _mm256_cvtepi32_ps,
        _mm256_cvttps_epi32, _mm256_madd_epi16, _mm256_max_ps, _mm256_min_epi32, _mm256_min_ps,
        _mm256_mul_ps, _mm256_mullo_epi32, _mm256_or_si256, _mm256_set1_epi32, _mm256_set1_ps,
        _mm256_setr_epi8, _mm256_setr_epi32, _mm256_setr_epi64x, _mm256_setr_ps, _mm256_setzero_ps,
        _mm256_shuffle_epi8, _mm256_shuffle_ps, _mm256_slli_epi32, _mm256_srli_epi32,
        _mm256_srli_epi64, _mm256_sub_epi32, _mm256_sub_ps,
    },
    ptr,
};

use super::{
    band::{Band, Block, Lanes, Seen},
    block_size::LANES,
    rendering::{FrameLines, Planes, Source, Values, WEIGHT_ONE, pair, render_band},
};

/// Exists only where the processor has AVX2.
#[derive(Debug, Clone, Copy)]
pub(super) struct Supported(());

impl Supported {
    /// Proof of AVX2, if the processor has it.
    pub(super) fn detect() -> Option<Self> {
        is_x86_feature_detected!("avx2").then_some(Self(()))
    }
}

/// As `scalar::render`, for frames of less than 2 GiB.
pub(super) fn render(_proof: Supported, source: &Source, band: &Band, planes: Planes) {
    // SAFETY: there is proof that the processor has AVX2.
    unsafe { render_with_avx2(source, band, planes) }
}

#[target_feature(enable = "avx2")]
fn render_with_avx2(source: &Source, band: &Band, planes: Planes) {
    let frame_lines = FrameLines::new(source);
    let locate = |block: &Block, seen| match seen {
        Seen::Whole => whole_samples(source, block),
        Seen::Lanes(lanes) => samples(source, block, lanes),
    };
    let sample = |samples: &_, row| {
        announce_pixels(source, samples, row);
        sample_block(source, &frame_lines, samples)
    };
    let announce = |place: &f32| _mm_prefetch::<_MM_HINT_T0>(ptr::from_ref(place).cast());
    render_band(source, band, planes, locate, sample, announce);
}

/// Sampling positions and weights of eight pixels.
struct Samples {
    /// Index of the first byte of each upper left neighbor.
    first_bytes: [u32; LANES],
    /// As 16-bit numbers, the weights of left and right neighbors.
    weights: __m256i,
    lower_weight: __m256,
    /// All bits set where something is seen.
    is_visible: __m256,
}

#[target_feature(enable = "avx2")]
fn sample_block(source: &Source, frame_lines: &FrameLines, samples: &Samples) -> Values {
    let [low, high] = pixel_pairs(frame_lines.upper, &samples.first_bytes);
    let upper = weighted_sums(
        low_halves(low, high),
        low_halves(_mm256_srli_epi64::<16>(low), _mm256_srli_epi64::<16>(high)),
        samples.weights,
    );
    let [low, high] = pixel_pairs(frame_lines.lower, &samples.first_bytes);
    let lower = weighted_sums(
        low_halves(_mm256_srli_epi64::<16>(low), _mm256_srli_epi64::<16>(high)),
        high_halves(low, high),
        samples.weights,
    );
    let value = |channel: usize| {
        let difference = _mm256_sub_ps(lower[channel], upper[channel]);
        let share = _mm256_mul_ps(difference, samples.lower_weight);
        let sum = _mm256_and_ps(_mm256_add_ps(upper[channel], share), samples.is_visible);
        let scaled = _mm256_mul_ps(sum, _mm256_set1_ps(source.scale[channel]));
        let offset = _mm256_set1_ps(source.offset[channel]);
        singles(_mm256_add_ps(scaled, offset))
    };
    [value(0), value(1), value(2)]
}

/// The samples of a block whose pixels all show the lens image, within the frame.
#[target_feature(enable = "avx2")]
fn whole_samples(source: &Source, block: &Block) -> Samples {
    let [left, top] = [0, 1].map(|axis| {
        let position = positions(block.start[axis], block.step[axis]);
        Neighbors::new(position, _mm256_cvttps_epi32(position))
    });
    let all = _mm256_castsi256_ps(_mm256_set1_epi32(-1));
    Samples::new(source, &left, &top, all)
}

#[target_feature(enable = "avx2")]
fn samples(source: &Source, block: &Block, lanes: Lanes) -> Samples {
    let (left, is_within_width) = split(block.start[0], block.step[0], source.width);
    let (top, is_within_height) = split(block.start[1], block.step[1], source.height);
    let bits = _mm256_setr_epi32(1, 2, 4, 8, 16, 32, 64, 128);
    let lanes = _mm256_and_si256(_mm256_set1_epi32(i32::from(lanes)), bits);
    let sees_lens = _mm256_castsi256_ps(_mm256_cmpeq_epi32(lanes, bits));
    let is_within = _mm256_and_ps(is_within_width, is_within_height);
    Samples::new(source, &left, &top, _mm256_and_ps(is_within, sees_lens))
}

impl Samples {
    #[target_feature(enable = "avx2")]
    fn new(source: &Source, left: &Neighbors, top: &Neighbors, is_visible: __m256) -> Self {
        let pixel = _mm256_mullo_epi32(top.lower, whole(source.width));
        let pixel = _mm256_add_epi32(pixel, left.lower);
        let first_byte = _mm256_add_epi32(_mm256_slli_epi32::<1>(pixel), pixel);
        let one = i32::from(WEIGHT_ONE);
        let right = _mm256_mul_ps(left.upper_weight, _mm256_set1_ps(f32::from(WEIGHT_ONE)));
        let right = _mm256_cvttps_epi32(right);
        let left = _mm256_sub_epi32(_mm256_set1_epi32(one), right);
        Self {
            first_bytes: words(first_byte),
            weights: _mm256_or_si256(_mm256_slli_epi32::<16>(right), left),
            lower_weight: top.upper_weight,
            is_visible,
        }
    }
}

/// Along one axis, of two neighbors each the lower one (the left or upper one in the frame), and
/// the weight of the other.
struct Neighbors {
    lower: __m256i,
    upper_weight: __m256,
}

impl Neighbors {
    #[target_feature(enable = "avx2")]
    fn new(position: __m256, lower: __m256i) -> Self {
        Self {
            lower,
            upper_weight: _mm256_sub_ps(position, _mm256_cvtepi32_ps(lower)),
        }
    }
}

/// Bytes that the processor fetches at once.
const CACHE_LINE: isize = 64;

/// Lets the processor fetch what lies ahead: it follows neither the curves nor the rows of a view
/// by itself.
///
/// Eight blocks, one below the other, are a patch that may lie in the frame at any angle. Each of
/// them announces two pixels of the patch after the next, so that all announce its diagonals, which
/// are close to each line of the frame that it meets; and what lies beside them on that line, as it
/// is at a patch's sides that there is something new.
#[target_feature(enable = "avx2")]
fn announce_pixels(source: &Source, samples: &Samples, row: usize) {
    let first_bytes = samples.first_bytes.map(|byte| byte as usize);
    let two_blocks = 2_usize.wrapping_mul(first_bytes[LANES - 1].wrapping_sub(first_bytes[0]));
    for lane in [row, LANES - 1 - row] {
        // Some of it may lie beyond the frame: nothing is read, only fetched.
        let ahead = first_bytes[lane].wrapping_add(two_blocks);
        let ahead = source.pixels.as_ptr().wrapping_add(ahead);
        for beside in [-CACHE_LINE, 0, CACHE_LINE] {
            let upper = ahead.wrapping_offset(beside);
            let lower = upper.wrapping_add(3 * source.width);
            _mm_prefetch::<_MM_HINT_T0>(upper.cast());
            _mm_prefetch::<_MM_HINT_T0>(lower.cast());
        }
    }
}

/// Along one axis, where the pixels of a block sample.
#[target_feature(enable = "avx2")]
fn positions(start: f32, step: f32) -> __m256 {
    let lane = _mm256_setr_ps(0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0);
    let steps = _mm256_mul_ps(_mm256_set1_ps(step), lane);
    _mm256_add_ps(_mm256_set1_ps(start), steps)
}

/// As `scalar::split`: neighbors, and whether that is within.
#[target_feature(enable = "avx2")]
fn split(start: f32, step: f32, count: usize) -> (Neighbors, __m256) {
    let position = positions(start, step);
    let last = _mm256_cvtepi32_ps(whole(count - 1));
    // In this order what is not a number becomes 0, and is not within.
    let within = _mm256_min_ps(_mm256_max_ps(position, _mm256_setzero_ps()), last);
    let beyond = _mm256_andnot_ps(_mm256_set1_ps(-0.0), _mm256_sub_ps(position, within));
    let is_within = _mm256_cmp_ps::<_CMP_LE_OQ>(beyond, _mm256_set1_ps(0.5));
    let lower = _mm256_min_epi32(_mm256_cvttps_epi32(within), whole(count - 2));
    (Neighbors::new(within, lower), is_within)
}

/// Eight bytes from each of the given ones: of pixels 0, 1, 4 and 5, and of 2, 3, 6 and 7.
#[target_feature(enable = "avx2")]
fn pixel_pairs(lines: &[u8], first_bytes: &[u32; LANES]) -> [__m256i; 2] {
    let pair = |lane: usize| i64::from_le_bytes(pair(lines, first_bytes[lane]));
    [
        _mm256_setr_epi64x(pair(0), pair(1), pair(4), pair(5)),
        _mm256_setr_epi64x(pair(2), pair(3), pair(6), pair(7)),
    ]
}

/// The first four bytes of each of the eight, in the pixels' order.
#[target_feature(enable = "avx2")]
fn low_halves(low: __m256i, high: __m256i) -> __m256i {
    let (low, high) = (_mm256_castsi256_ps(low), _mm256_castsi256_ps(high));
    _mm256_castps_si256(_mm256_shuffle_ps::<0b10_00_10_00>(low, high))
}

/// The last four bytes of each of the eight, in the pixels' order.
#[target_feature(enable = "avx2")]
fn high_halves(low: __m256i, high: __m256i) -> __m256i {
    let (low, high) = (_mm256_castsi256_ps(low), _mm256_castsi256_ps(high));
    _mm256_castps_si256(_mm256_shuffle_ps::<0b11_01_11_01>(low, high))
}

/// Red, green and blue of eight pairs of pixels: the first four of each one's six bytes are
/// R, G, B, R, the last four B, R, G, B.
#[target_feature(enable = "avx2")]
fn weighted_sums(first_four: __m256i, last_four: __m256i, weights: __m256i) -> [__m256; 3] {
    #[rustfmt::skip]
    let outer_bytes = _mm256_setr_epi8(
        0, -1, 3, -1, 4, -1, 7, -1, 8, -1, 11, -1, 12, -1, 15, -1,
        0, -1, 3, -1, 4, -1, 7, -1, 8, -1, 11, -1, 12, -1, 15, -1,
    );
    let left_green = _mm256_and_si256(_mm256_srli_epi32::<8>(first_four), _mm256_set1_epi32(0xff));
    let right_green = _mm256_and_si256(last_four, _mm256_set1_epi32(0x00ff_0000));
    [
        _mm256_shuffle_epi8(first_four, outer_bytes),
        _mm256_or_si256(left_green, right_green),
        _mm256_shuffle_epi8(last_four, outer_bytes),
    ]
    .map(|pair| _mm256_cvtepi32_ps(_mm256_madd_epi16(pair, weights)))
}

/// A number of pixels in all lanes.
#[target_feature(enable = "avx2")]
fn whole(count: usize) -> __m256i {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_possible_wrap,
        reason = "a frame of less than 2 GiB"
    )]
    _mm256_set1_epi32(count as i32)
}

fn words(vector: __m256i) -> [u32; LANES] {
    // SAFETY: both are 32 bytes, and every value of them is one of the array.
    unsafe { std::mem::transmute(vector) }
}

fn singles(vector: __m256) -> [f32; LANES] {
    // SAFETY: both are 32 bytes, and every value of them is one of the array.
    unsafe { std::mem::transmute(vector) }
}
