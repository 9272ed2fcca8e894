//! Single bands, pixel by pixel.

use lookdown_lens::geometry::lens::ImagePlane;
use proptest::prelude::*;

use super::super::{node_grid::Nodes, visibility::Visibility, *};

pub(super) fn noise(width: u32, height: u32) -> Frame {
    let pixels = (0..width * height * 3).map(|i| (i.wrapping_mul(2_654_435_761) >> 24) as u8);
    Frame::new(width, height, pixels.collect()).unwrap()
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "clamped to the frame first"
)]
/// The slow, obvious way: four neighbors by index, weights in f64, the border repeated.
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

/// The frame's pixels as the plane.
fn identity() -> FrameFromPlane {
    let plane = ImagePlane {
        fx: 1.0,
        fy: 1.0,
        skew: 0.0,
        row_skew: 0.0,
        cx: 0.0,
        cy: 0.0,
    };
    FrameFromPlane::new(&plane, 0.0)
}

fn rendered(
    band: &Band,
    frame: &Frame,
    input: &NetworkInput,
    render: impl Fn(&Source, &Band, Planes),
) -> Vec<f32> {
    let mut values = vec![-1.0; input.view_len()];
    let mut planes = values.chunks_exact_mut(input.plane_len());
    let planes = std::array::from_fn(|_| planes.next().unwrap());
    render(&Source::new(frame, input), band, planes);
    values
}

/// R, G and B at one position.
fn sampled(position: [f32; 2], frame: &Frame) -> Vec<f32> {
    let [x, y] = position.map(|coordinate| [coordinate; 2]);
    let nodes = Nodes { x: &x, y: &y };
    let visibility = Visibility {
        spans: vec![[0, 1]],
        spans_are_hidden: false,
    };
    let band = Band {
        above: nodes,
        below: nodes,
        frame_from_plane: &identity(),
        visibility: &visibility,
        rows: 0..1,
        whole_patches: 0..0,
    };
    rendered(&band, frame, &NetworkInput::plain(1, 1), scalar::render)
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

#[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]
    #[test]
    fn vectors_sample_the_same_to_the_bit(
        (frame_width, frame_height) in (2..12_u32, 2..9_u32),
        (view_width, rows) in (1..40_u32, 1..9_u32),
        nodes in prop::collection::vec(
            prop_oneof![
                20 => (-3.0..14.0_f32, -3.0..11.0_f32),
                3 => (prop::num::f32::ANY, prop::num::f32::ANY),
                3 => (0..12_u8, 0..9_u8).prop_map(|(x, y)| (f32::from(x), f32::from(y))),
            ],
            12,
        ),
        spans in prop::collection::vec((0..40_u32, 0..40_u32), 8),
        spans_are_hidden: bool,
    ) {
        let Some(supported) = vector::Supported::detect() else {
            return Ok(());
        };
        let (x, y): (Vec<_>, Vec<_>) = nodes.into_iter().unzip();
        let visibility = Visibility {
            spans: spans.into_iter().map(|(start, length)| [start, start + length]).collect(),
            spans_are_hidden,
        };
        let across = view_width.div_ceil(8) as usize + 1;
        let band = Band {
            above: Nodes { x: &x[..across], y: &y[..across] },
            below: Nodes { x: &x[6..6 + across], y: &y[6..6 + across] },
            frame_from_plane: &identity(),
            visibility: &visibility,
            rows: 0..rows as usize,
            whole_patches: 0..0,
        };
        let frame = noise(frame_width, frame_height);
        let input = NetworkInput {
            scale: [0.5, 1.0 / 58.0, 1.0],
            offset: [-1.0, -2.1, 0.0],
            ..NetworkInput::plain(view_width, rows)
        };
        let with_vectors = rendered(&band, &frame, &input, |source, band, planes| {
            vector::render(supported, source, band, planes);
        });
        prop_assert_eq!(with_vectors, rendered(&band, &frame, &input, scalar::render));
    }
}
