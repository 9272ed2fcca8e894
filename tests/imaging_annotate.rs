//! Annotated frames: what is painted where, and how they become bytes.
#![expect(clippy::unwrap_used, reason = "a failed encoding is a failed test")]

use lookdown::imaging::Frame;
use lookdown::imaging::annotate::{Mark, OrientedMark, annotate, encode_jpeg, encode_png};
use lookdown::imaging::decode::{DecodeLimits, decode};
use proptest::prelude::*;

const GREY: [u8; 3] = [90, 90, 90];

fn grey_frame(width: u32, height: u32) -> Frame {
    let length = 3 * width as usize * height as usize;
    Frame::new(width, height, vec![GREY[0]; length]).unwrap()
}

fn aligned(bbox: [f64; 4]) -> Mark {
    Mark {
        bbox,
        oriented: None,
        label: String::new(),
    }
}

fn annotated(width: u32, height: u32, marks: &[Mark]) -> Frame {
    let mut frame = grey_frame(width, height);
    annotate(&mut frame, marks);
    frame
}

fn is_painted(frame: &Frame, x: u32, y: u32) -> bool {
    frame.pixel(x, y) != GREY
}

fn painted_count(frame: &Frame) -> usize {
    let pixels = frame.pixels().chunks_exact(3);
    pixels.filter(|pixel| *pixel != GREY).count()
}

#[test]
fn no_marks_leave_the_frame_as_it_was() {
    assert_eq!(annotated(60, 40, &[]), grey_frame(60, 40));
}

#[test]
fn a_box_is_outlined_and_its_inside_stays_visible() {
    let frame = annotated(200, 200, &[aligned([50.0, 60.0, 120.0, 150.0])]);
    for (x, y) in [(50, 100), (120, 100), (80, 60), (80, 150)] {
        assert!(is_painted(&frame, x, y), "({x}, {y})");
    }
    assert!(!is_painted(&frame, 85, 105));
    assert!(!is_painted(&frame, 30, 100));
}

#[test]
fn an_oriented_box_turns_clockwise_from_image_up() {
    let mark = |angle_deg| Mark {
        oriented: Some(OrientedMark {
            cx: 100.0,
            cy: 100.0,
            width: 20.0,
            height: 120.0,
            angle_deg,
        }),
        ..aligned([99.0, 99.0, 101.0, 101.0])
    };
    let upright = annotated(200, 200, &[mark(0.0)]);
    assert!(is_painted(&upright, 100, 40) && !is_painted(&upright, 160, 100));
    let lying = annotated(200, 200, &[mark(90.0)]);
    assert!(is_painted(&lying, 160, 100) && !is_painted(&lying, 100, 40));
    // Up and to the right: the upper end of a box turned by 45° clockwise.
    let leaning = annotated(200, 200, &[mark(45.0)]);
    assert!(is_painted(&leaning, 142, 57) && !is_painted(&leaning, 57, 57));
}

#[test]
fn lines_and_text_grow_with_the_frame() {
    let share = |side: u32| {
        let size = f64::from(side);
        let mark = Mark {
            label: "0.87".into(),
            ..aligned([0.3, 0.3, 0.7, 0.7].map(|part| part * size))
        };
        let count = painted_count(&annotated(side, side, &[mark]));
        f64::from(u32::try_from(count).unwrap()) / (size * size)
    };
    let (medium, large) = (share(900), share(2700));
    assert!((medium / large - 1.0).abs() < 0.1, "{medium} and {large}");
}

#[test]
fn a_label_stays_whole_wherever_its_box_is() {
    let plate = |bbox: [f64; 4]| {
        let label = "person 0.87".to_owned();
        let with = annotated(
            400,
            300,
            &[Mark {
                label,
                ..aligned(bbox)
            }],
        );
        painted_count(&with).abs_diff(painted_count(&annotated(400, 300, &[aligned(bbox)])))
    };
    let in_the_middle = plate([150.0, 120.0, 160.0, 130.0]);
    for bbox in [
        [2.0, 2.0, 12.0, 12.0],
        [388.0, 2.0, 398.0, 12.0],
        [388.0, 288.0, 398.0, 298.0],
        [2.0, 288.0, 12.0, 298.0],
    ] {
        let here = plate(bbox);
        assert!(
            here.abs_diff(in_the_middle) < in_the_middle / 4,
            "{bbox:?}: {here} of {in_the_middle}"
        );
    }
}

#[test]
fn labels_of_neighbours_do_not_cover_each_other() {
    let mark = || Mark {
        label: "0.87".into(),
        ..aligned([150.0, 120.0, 220.0, 180.0])
    };
    let one = painted_count(&annotated(400, 300, &[mark()]));
    let two = painted_count(&annotated(400, 300, &[mark(), mark()]));
    let outline = painted_count(&annotated(
        400,
        300,
        &[aligned([150.0, 120.0, 220.0, 180.0])],
    ));
    assert!(
        two - outline > (one - outline) * 9 / 5,
        "{outline} {one} {two}"
    );
}

#[test]
fn a_mark_that_is_not_finite_is_left_out() {
    let label = "0.5".to_owned();
    for bad in [f64::NAN, f64::INFINITY, 1e300] {
        let mark = Mark {
            label: label.clone(),
            ..aligned([10.0, 10.0, bad, 30.0])
        };
        assert_eq!(annotated(60, 40, &[mark]), grey_frame(60, 40));
    }
}

#[test]
fn png_keeps_every_pixel_and_jpeg_comes_close() {
    let frame = annotated(120, 80, &[aligned([20.0, 20.0, 90.0, 60.0])]);
    let limits = DecodeLimits::default();
    let png = decode(&encode_png(&frame).unwrap(), &limits).unwrap();
    assert_eq!(png.frame, frame);
    let jpeg = decode(&encode_jpeg(&frame, 90).unwrap(), &limits).unwrap();
    assert_eq!((jpeg.frame.width(), jpeg.frame.height()), (120, 80));
    let errors = jpeg.frame.pixels().iter().zip(frame.pixels());
    let sum: u64 = errors.map(|(a, b)| u64::from(a.abs_diff(*b))).sum();
    assert!(sum / (120 * 80 * 3) < 6, "{sum}");
}

#[test]
fn a_frame_too_long_for_jpeg_is_a_clear_error() {
    let error = encode_jpeg(&grey_frame(70_000, 1), 90).unwrap_err();
    assert!(
        error
            .to_string()
            .starts_with("a frame of 70000×1 pixels cannot be written as JPEG")
    );
}

fn coordinate() -> impl Strategy<Value = f64> {
    prop_oneof![
        4 => -50.0..150.0_f64,
        1 => -1e6..1e6_f64,
        1 => any::<f64>(),
    ]
}

proptest! {
    #[test]
    fn any_mark_can_be_drawn_on_any_frame(
        (width, height) in (1..120_u32, 1..120_u32),
        bbox in prop::array::uniform4(coordinate()),
        oriented in prop::option::of(prop::array::uniform5(coordinate())),
        label in "\\PC{0,12}",
    ) {
        let oriented = oriented.map(|[cx, cy, width, height, angle_deg]| OrientedMark {
            cx, cy, width, height, angle_deg,
        });
        let frame = annotated(width, height, &[Mark { bbox, oriented, label }]);
        prop_assert_eq!((frame.width(), frame.height()), (width, height));
    }
}
