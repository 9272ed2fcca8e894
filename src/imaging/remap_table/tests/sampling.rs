//! Single rows, pixel by pixel.

use proptest::prelude::*;

use super::super::{visibility::RowVisibility, *};

pub(super) fn noise(width: u32, height: u32) -> Frame {
    let pixels = (0..width * height * 3).map(|i| (i.wrapping_mul(2_654_435_761) >> 24) as u8);
    Frame::new(width, height, pixels.collect()).unwrap()
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "clamped to the frame first"
)]
/// The slow, obvious way: four neighbours by index, weights in f64, the border repeated.
pub(super) fn reference(frame: &Frame, position: &Pixel, channel: usize) -> f64 {
    let at = |x: f64, y: f64| {
        let x = x.clamp(0.0, f64::from(frame.width() - 1)) as u32;
        let y = y.clamp(0.0, f64::from(frame.height() - 1)) as u32;
        f64::from(frame.pixel(x, y)[channel])
    };
    let (left, top) = (position.x.floor(), position.y.floor());
    let (right_weight, lower_weight) = (position.x - left, position.y - top);
    at(left, top) * (1.0 - right_weight) * (1.0 - lower_weight)
        + at(left + 1.0, top) * right_weight * (1.0 - lower_weight)
        + at(left, top + 1.0) * (1.0 - right_weight) * lower_weight
        + at(left + 1.0, top + 1.0) * right_weight * lower_weight
}

fn rendered(
    row: &Row,
    frame: &Frame,
    input: &NetworkInput,
    render_rows: impl Fn(&Source, &[Row], Planes),
) -> Vec<f32> {
    let mut values = vec![-1.0; input.view_len()];
    let mut planes = values.chunks_exact_mut(input.plane_len());
    let planes = std::array::from_fn(|_| planes.next().unwrap());
    render_rows(
        &Source::new(frame, input),
        std::slice::from_ref(row),
        planes,
    );
    values
}

/// R, G and B at one position.
fn sampled(position: [f32; 2], frame: &Frame) -> Vec<f32> {
    let [x, y] = position.map(|coordinate| vec![coordinate; 2]);
    let row = Row {
        nodes: &Places { x, y },
        visibility: RowVisibility {
            start: 0,
            end: 1,
            is_hidden: false,
        },
    };
    rendered(&row, frame, &NetworkInput::plain(1, 1), scalar::render_rows)
}

fn precise([x, y]: [f32; 2]) -> Pixel {
    Pixel::new(f64::from(x), f64::from(y))
}

#[test]
fn integer_half_and_border_positions_are_sampled_exactly() {
    let frame = noise(7, 5);
    for position in [
        [2.0, 3.0],
        [0.0, 0.0],
        [6.0, 4.0],
        [2.5, 3.0],
        [2.0, 3.5],
        [5.5, 3.5],
        [-0.5, 4.5],
        [6.5, -0.5],
        [6.25, 2.75],
    ] {
        for (channel, found) in sampled(position, &frame).into_iter().enumerate() {
            let expected = reference(&frame, &precise(position), channel);
            let is_same = (f64::from(found) - expected).abs() < 1e-4;
            assert!(is_same, "{position:?}: {found} instead of {expected}");
        }
    }
}

#[test]
fn positions_outside_the_frame_are_black() {
    let frame = noise(7, 5);
    for position in [[-0.51, 2.0], [6.51, 2.0], [3.0, 4.51], [f32::NAN, 1.0]] {
        assert_eq!(sampled(position, &frame), [0.0; 3], "{position:?}");
    }
}

proptest! {
    #[test]
    fn any_position_samples_what_the_reference_samples(
        x in -3.0..12.0_f32,
        y in -3.0..9.0_f32,
    ) {
        let frame = noise(9, 6);
        let is_within = (-0.5..=8.5).contains(&x) && (-0.5..=5.5).contains(&y);
        for (channel, found) in sampled([x, y], &frame).into_iter().enumerate() {
            let expected = if is_within {
                reference(&frame, &precise([x, y]), channel)
            } else {
                0.0
            };
            // Weights are kept to 1/16384.
            prop_assert!((f64::from(found) - expected).abs() < 0.02);
        }
    }
}

#[cfg(target_arch = "x86_64")]
proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]
    #[test]
    fn vectors_sample_the_same_to_the_bit(
        (frame_width, frame_height) in (2..12_u32, 2..9_u32),
        view_width in 1..40_u32,
        nodes in prop::collection::vec(
            prop_oneof![
                20 => (-3.0..14.0_f32, -3.0..11.0_f32),
                3 => (prop::num::f32::ANY, prop::num::f32::ANY),
                3 => (0..12_u8, 0..9_u8).prop_map(|(x, y)| (f32::from(x), f32::from(y))),
            ],
            6,
        ),
        (start, length) in (0..40_u32, 0..40_u32),
        is_hidden: bool,
    ) {
        let Some(avx2) = vector::Avx2::detect() else {
            return Ok(());
        };
        let (x, y) = nodes.into_iter().unzip();
        let row = Row {
            nodes: &Places { x, y },
            visibility: RowVisibility { start, end: start + length, is_hidden },
        };
        let frame = noise(frame_width, frame_height);
        let input = NetworkInput {
            scale: [0.5, 1.0 / 58.0, 1.0],
            offset: [-1.0, -2.1, 0.0],
            ..NetworkInput::plain(view_width, 1)
        };
        let with_vectors = rendered(&row, &frame, &input, |source, rows, planes| {
            vector::render_rows(avx2, source, rows, planes);
        });
        prop_assert_eq!(with_vectors, rendered(&row, &frame, &input, scalar::render_rows));
    }
}
