//! Annotated frames: painted pixels and encoding.

use lookdown_imaging::{
    Frame,
    annotate::{
        Cancelled, Drawing, Head, Mark, OrientedMark, annotate, annotate_unless, encode_jpeg,
        encode_png,
    },
    decode::{DecodeLimits, decode},
};
use proptest::prelude::*;

const GRAY: [u8; 3] = [90, 90, 90];

fn gray_frame(width: u32, height: u32) -> Frame {
    let length = 3 * width as usize * height as usize;
    Frame::new(width, height, vec![GRAY[0]; length]).unwrap()
}

fn aligned(bbox: [f64; 4]) -> Mark {
    Mark {
        bbox,
        oriented: None,
        head: None,
        label: String::new(),
    }
}

fn annotated(width: u32, height: u32, marks: &[Mark]) -> Frame {
    let mut frame = gray_frame(width, height);
    annotate(&mut frame, &Drawing::new(marks.to_vec()));
    frame
}

fn is_painted(frame: &Frame, x: u32, y: u32) -> bool {
    frame.pixel(x, y) != GRAY
}

fn painted_count(frame: &Frame) -> usize {
    let pixels = frame.pixels().chunks_exact(3);
    pixels.filter(|pixel| *pixel != GRAY).count()
}

#[test]
fn no_marks_leave_the_frame_as_it_was() {
    assert_eq!(annotated(60, 40, &[]), gray_frame(60, 40));
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

/// Marks as large as the frame, and a small one behind them.
fn many_large_marks(side: f64) -> Vec<Mark> {
    let large = |index: u32| {
        let inset = f64::from(index % 7);
        aligned([inset, inset, side - inset, side - inset])
    };
    let mut marks: Vec<_> = (0..900).map(large).collect();
    let middle = side / 2.0;
    marks.push(aligned([
        middle - 20.0,
        middle - 20.0,
        middle + 20.0,
        middle + 20.0,
    ]));
    marks
}

#[test]
fn marks_beyond_the_painting_budget_are_left_out() {
    let marks = many_large_marks(3000.0);
    let frame = annotated(3000, 3000, &marks);
    assert!(is_painted(&frame, 1500, 3));
    assert!(!is_painted(&frame, 1480, 1500));
    let alone = annotated(3000, 3000, &marks[900..]);
    assert!(is_painted(&alone, 1480, 1500));
}

#[test]
fn drawing_stops_at_the_next_mark_when_cancelled() {
    let asked = std::cell::Cell::new(0);
    let is_cancelled = || {
        asked.set(asked.get() + 1);
        asked.get() > 3
    };
    let mut frame = gray_frame(400, 400);
    let drawing = Drawing::new(vec![aligned([50.0, 50.0, 90.0, 90.0]); 900]);
    let outcome = annotate_unless(&mut frame, &drawing, &is_cancelled);
    assert_eq!(outcome, Err(Cancelled));
    assert_eq!(asked.get(), 4);
}

#[test]
fn only_the_boxes_that_are_asked_for_are_outlined() {
    let mark = Mark {
        oriented: Some(OrientedMark {
            cx: 100.0,
            cy: 100.0,
            width: 40.0,
            height: 60.0,
            angle_deg: 0.0,
        }),
        ..aligned([40.0, 40.0, 160.0, 160.0])
    };
    for (boxes, oriented) in [(true, true), (true, false), (false, true), (false, false)] {
        let mut frame = gray_frame(200, 200);
        let drawing = Drawing {
            boxes,
            oriented,
            ..Drawing::new(vec![mark.clone()])
        };
        annotate(&mut frame, &drawing);
        assert_eq!(is_painted(&frame, 40, 100), boxes);
        assert_eq!(is_painted(&frame, 80, 100), oriented);
    }
}

#[test]
fn an_outline_stands_out_from_bright_and_from_dark_floors() {
    for side in [300, 960, 4000] {
        for floor in [0, 128, 255] {
            let mut frame =
                Frame::new(side, side, vec![floor; 3 * (side * side) as usize]).unwrap();
            let size = f64::from(side);
            let bbox = [0.25, 0.25, 0.75, 0.75].map(|part| part * size);
            annotate(&mut frame, &Drawing::new(vec![aligned(bbox)]));
            let light = |x: u32| {
                let channels = frame.pixel(x, side / 2).map(u32::from);
                channels.into_iter().sum::<u32>() / 3
            };
            let reach = side / 100 + 4;
            let across: Vec<_> = (side / 4 - reach..side / 4 + reach).map(light).collect();
            let (darkest, lightest) = (across.iter().min().unwrap(), across.iter().max().unwrap());
            assert!(
                lightest - darkest > 80,
                "{side} pixels on {floor}: {across:?}"
            );
        }
    }
}

#[test]
fn lines_are_drawn_below_the_marks() {
    let mut frame = gray_frame(200, 200);
    let drawing = Drawing {
        lines: vec![
            vec![[10.5, 30.5], [190.5, 30.5], [190.5, 180.5]],
            vec![[0.0, 100.0], [f64::NAN, 100.0]],
        ],
        ..Drawing::new(vec![aligned([100.5, 10.5, 150.5, 150.5])])
    };
    annotate(&mut frame, &drawing);
    assert!(is_painted(&frame, 50, 30) && is_painted(&frame, 190, 100));
    assert!(!is_painted(&frame, 50, 100));
    let alone = annotated(200, 200, &drawing.marks);
    assert_eq!(frame.pixel(100, 30), alone.pixel(100, 30));
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
    // The box is rotated by 45° clockwise, so its upper end points up and to the right.
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
    let (medium, large) = (share(1800), share(3600));
    assert!((medium / large - 1.0).abs() < 0.1, "{medium} and {large}");
}

/// The rectangle painted by a label, apart from its box: left, top, right, bottom, in whole pixels.
fn painted_by_label(width: u32, height: u32, mark: &Mark) -> [u32; 4] {
    let labeled = annotated(width, height, std::slice::from_ref(mark));
    let bare = Mark {
        label: String::new(),
        ..mark.clone()
    };
    let without = annotated(width, height, &[bare]);
    let row_bytes = 3 * width as usize;
    let rows = labeled
        .pixels()
        .chunks_exact(row_bytes)
        .zip(without.pixels().chunks_exact(row_bytes));
    let mut painted = [u32::MAX, u32::MAX, 0, 0];
    for (y, _) in (0..height)
        .zip(rows)
        .filter(|(_, (labeled, without))| labeled != without)
    {
        for x in (0..width).filter(|&x| labeled.pixel(x, y) != without.pixel(x, y)) {
            let [left, top, right, bottom] = painted;
            painted = [left.min(x), top.min(y), right.max(x + 1), bottom.max(y + 1)];
        }
    }
    painted
}

#[test]
fn a_label_stays_whole_wherever_its_box_is() {
    for (width, height) in [(64, 64), (300, 200), (1600, 1200), (4000, 4000)] {
        let (columns, rows) = (f64::from(width), f64::from(height));
        let size = |bbox: [f64; 4]| {
            let mark = Mark {
                label: "0.87".to_owned(),
                ..aligned(bbox)
            };
            let [left, top, right, bottom] = painted_by_label(width, height, &mark);
            [right - left, bottom - top]
        };
        let (x, y) = (columns / 2.0, rows / 2.0);
        let whole = size([x, y, x + 2.0, y + 2.0]);
        assert!(whole[0] > 20 && whole[1] > 10, "{whole:?}");
        let mut borders = vec![[0.0, 0.0, columns, rows]];
        for x in [0.0, x, columns - 3.0] {
            for y in [0.0, y, rows - 3.0] {
                borders.push([x, y, x + 3.0, y + 3.0]);
                borders.push([x - 9.0, y - 9.0, x + 9.0, y + 9.0]);
            }
        }
        for bbox in borders {
            let here = size(bbox);
            // Where the plate lies on its own outline of the same color, a line's width is not
            // visible.
            let unseen = 3 + width.min(height) / 300;
            let mut sides = here.into_iter().zip(whole);
            let is_whole = sides.all(|(here, whole)| here.abs_diff(whole) <= unseen);
            assert!(
                is_whole,
                "{width}×{height}, {bbox:?}: {here:?} of {whole:?}"
            );
        }
    }
}

#[test]
fn a_label_keeps_clear_of_heads() {
    // A head right above the box blocks the positions above it.
    let head = Head {
        cx: 200.0,
        cy: 95.0,
        radius: 40.0,
    };
    let neighbor = Mark {
        head: Some(head),
        ..aligned([160.0, 40.0, 240.0, 148.0])
    };
    let own = Mark {
        label: "0.87".into(),
        ..aligned([180.0, 150.0, 220.0, 200.0])
    };
    let bare = Mark {
        label: String::new(),
        ..own.clone()
    };
    let with = annotated(400, 400, &[neighbor.clone(), own]);
    let without = annotated(400, 400, &[neighbor, bare]);
    let changed = (0..150).flat_map(|y| (0..400).map(move |x| (x, y)));
    let changed = changed.filter(|&(x, y)| with.pixel(x, y) != without.pixel(x, y));
    assert_eq!(changed.count(), 0);
    assert_ne!(with, without);
}

#[test]
fn a_caption_is_complete_and_labels_keep_clear_of_it() {
    let caption = "2026-11-21 09:30:00 UTC";
    for (width, height) in [(64, 64), (300, 300), (2000, 1000)] {
        let mut frame = gray_frame(width, height);
        let drawing = Drawing {
            caption: caption.to_owned(),
            ..Drawing::new(Vec::new())
        };
        annotate(&mut frame, &drawing);
        let painted = |x: u32| (0..height).any(|y| is_painted(&frame, x, y));
        let right = (0..width).rev().find(|&x| painted(x)).unwrap();
        assert!(painted(4), "{width}×{height}");
        assert!(right > width / 8 && right < width - 1, "{right} of {width}");
        assert!(!is_painted(&frame, width / 2, height / 2));
    }
}

#[test]
fn labels_of_neighbors_do_not_cover_each_other() {
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
        assert_eq!(annotated(60, 40, &[mark]), gray_frame(60, 40));
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
    let error = encode_jpeg(&gray_frame(70_000, 1), 90).unwrap_err();
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
        let caption = label.clone();
        let head = oriented.map(|mark| Head { cx: mark.cx, cy: mark.cy, radius: mark.width });
        let mark = Mark { bbox, oriented, head, label };
        let lines = vec![vec![[bbox[0], bbox[1]], [bbox[2], bbox[3]]]];
        let drawing = Drawing { lines, caption, ..Drawing::new(vec![mark]) };
        let mut frame = gray_frame(width, height);
        annotate(&mut frame, &drawing);
        prop_assert_eq!((frame.width(), frame.height()), (width, height));
    }
}
