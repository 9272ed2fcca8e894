use proptest::prelude::*;

use super::*;
use crate::{
    geometry::{Mount, ViewPlan},
    imaging::ChannelOrder,
};

fn noise(width: u32, height: u32) -> Frame {
    let pixels = (0..width * height * 3).map(|i| (i.wrapping_mul(2_654_435_761) >> 24) as u8);
    Frame::new(width, height, pixels.collect()).unwrap()
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "clamped to the frame first"
)]
/// The slow, obvious way: four neighbours by index, weights in f64, the border repeated.
fn reference(frame: &Frame, position: &Pixel, channel: usize) -> f64 {
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

fn table_of(positions: &[Pixel], frame: &Frame) -> RemapTable {
    let outside = Sample {
        pixel_index: OUTSIDE,
        right_weight: 0,
        lower_weight: 0,
    };
    let samples = positions
        .iter()
        .map(|position| Sample::at(position, frame.width(), frame.height()).unwrap_or(outside));
    RemapTable {
        samples: samples.collect(),
        frame_width: frame.width(),
        frame_height: frame.height(),
    }
}

fn rendered(positions: &[Pixel], frame: &Frame) -> Vec<f32> {
    let input = NetworkInput::plain(u32::try_from(positions.len()).unwrap(), 1);
    let mut slot = vec![-1.0; input.view_len()];
    table_of(positions, frame).render(frame, &input, &mut slot);
    slot
}

#[test]
fn integer_half_and_border_positions_are_sampled_exactly() {
    let frame = noise(7, 5);
    let positions = [
        (2.0, 3.0),
        (0.0, 0.0),
        (6.0, 4.0),
        (2.5, 3.0),
        (2.0, 3.5),
        (5.5, 3.5),
        (-0.5, 4.5),
        (6.5, -0.5),
        (6.25, 2.75),
    ]
    .map(|(x, y)| Pixel::new(x, y));
    let slot = rendered(&positions, &frame);
    for (index, position) in positions.iter().enumerate() {
        for channel in 0..3 {
            let expected = reference(&frame, position, channel);
            let found = f64::from(slot[channel * positions.len() + index]);
            assert!(
                (found - expected).abs() < 1e-4,
                "{position}: {found} instead of {expected}"
            );
        }
    }
}

#[test]
fn positions_outside_the_frame_are_filled() {
    let frame = noise(7, 5);
    let positions =
        [(-0.51, 2.0), (6.51, 2.0), (3.0, 4.51), (f64::NAN, 1.0)].map(|(x, y)| Pixel::new(x, y));
    assert!(
        rendered(&positions, &frame)
            .iter()
            .all(|&value| value == FILL)
    );
}

#[test]
fn channel_order_scale_and_offset_are_applied_per_plane() {
    let frame = Frame::new(2, 2, [10, 20, 30].repeat(4)).unwrap();
    let input = NetworkInput {
        channel_order: ChannelOrder::Bgr,
        scale: [1.0, 2.0, 3.0],
        offset: [0.5, 0.0, -1.0],
        ..NetworkInput::plain(1, 1)
    };
    let mut slot = vec![0.0; 3];
    table_of(&[Pixel::new(0.5, 0.5)], &frame).render(&frame, &input, &mut slot);
    assert_eq!(slot, [30.5, 40.0, 29.0]);
}

#[test]
fn a_view_of_a_real_lens_matches_the_per_pixel_reference() {
    let frame = noise(200, 200);
    let lens = Lens::equidistant_circle(99.5, 99.5, 100.0, 1.5).unwrap();
    let input = NetworkInput::plain(64, 64);
    for view in ViewPlan::balanced().views(&Mount::default(), 64, 64) {
        let table = RemapTable::new(&view, &lens, 200, 200);
        let mut slot = vec![-1.0; input.view_len()];
        table.render(&frame, &input, &mut slot);
        let mut inside = 0_u32;
        for y in 0..64_u32 {
            for x in 0..64_u32 {
                let ray = view.ray_in_camera(&Pixel::new(f64::from(x), f64::from(y)));
                let position = lens.project(&ray);
                inside += u32::from(position.is_some());
                for channel in 0..3 {
                    let expected =
                        position.map_or(0.0, |position| reference(&frame, &position, channel));
                    let found = f64::from(slot[channel * 4096 + (y * 64 + x) as usize]);
                    // Weights are kept to 1/32768: 255 · 2 / 65536 at the most.
                    assert!(
                        (found - expected).abs() < 0.02,
                        "({x}, {y}): {found} instead of {expected}"
                    );
                }
            }
        }
        assert!((table.inside_share() - f64::from(inside) / 4096.0).abs() < 1e-12);
    }
}

#[test]
fn an_interpolated_table_samples_where_the_exact_one_does() {
    let lens = Lens::equidistant_circle(799.5, 799.5, 800.0, 1.5).unwrap();
    let mut worst = 0.0_f64;
    for view in ViewPlan::balanced().views(&Mount::default(), 416, 416) {
        let exact = RemapTable::new(&view, &lens, 1600, 1600);
        let interpolated = RemapTable::interpolated(&view, &lens, 1600, 1600);
        for (exact, found) in exact.samples.iter().zip(&interpolated.samples) {
            assert_eq!(exact.pixel_index == OUTSIDE, found.pixel_index == OUTSIDE);
            let [exact, found] = [exact, found].map(|sample| {
                let place = |pixels: u32, weight: u16| {
                    f64::from(pixels) + f64::from(weight) / f64::from(WEIGHT_ONE)
                };
                Pixel::new(
                    place(sample.pixel_index % 1600, sample.right_weight),
                    place(sample.pixel_index / 1600, sample.lower_weight),
                )
            });
            worst = worst.max((exact - found).norm());
        }
    }
    assert!(worst < 0.15, "{worst}");
}

proptest! {
    #[test]
    fn any_position_samples_what_the_reference_samples(x in -3.0..12.0, y in -3.0..9.0) {
        let frame = noise(9, 6);
        let position = Pixel::new(x, y);
        let slot = rendered(&[position], &frame);
        let within = (-0.5..=8.5).contains(&x) && (-0.5..=5.5).contains(&y);
        for (channel, value) in slot.iter().enumerate() {
            let expected = if within {
                let clamped = Pixel::new(x.clamp(0.0, 8.0), y.clamp(0.0, 5.0));
                reference(&frame, &clamped, channel)
            } else {
                f64::from(FILL)
            };
            prop_assert!((f64::from(*value) - expected).abs() < 0.02);
        }
    }
}
