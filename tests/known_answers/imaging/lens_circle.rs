//! The lens circle of synthetic rooms with a known circle is found within half a percent.

use lookdown_imaging::{
    Frame,
    lens_circle::{LensCircle, assumed_circle, find_lens_circle, shows_two_circles},
};
use proptest::prelude::*;

/// A room seen through a fisheye lens, rendered from formulas.
#[derive(Debug, Clone)]
struct Room {
    width: u32,
    height: u32,
    circle: LensCircle,
    /// Brightness of the walls, 0 to 255. The texture varies it by half.
    light: f64,
    /// Brightness of the surround, 0 to 255.
    surround: f64,
    /// Half the range of the noise on every pixel.
    noise: f64,
    /// Width of the rim's blur, in pixels.
    blur: f64,
    /// Directions in which the room is unlit, in radians from image right, clockwise.
    dark: std::ops::Range<f64>,
    seed: u64,
}

impl Room {
    fn new(width: u32, height: u32, [cx, cy, radius]: [f64; 3]) -> Self {
        Self {
            width,
            height,
            circle: LensCircle { cx, cy, radius },
            light: 150.0,
            surround: 2.0,
            noise: 2.0,
            blur: 1.0,
            dark: 0.0..0.0,
            seed: 1,
        }
    }

    fn paint(&self) -> Frame {
        let mut random = self
            .seed
            .wrapping_mul(2)
            .wrapping_add(0x9E37_79B9_7F4A_7C15);
        let (width, height) = (f64::from(self.width), f64::from(self.height));
        paint(self.width, self.height, |x, y| {
            let (dx, dy) = (x - self.circle.cx, y - self.circle.cy);
            let inside = (self.circle.radius - dx.hypot(dy)) / self.blur + 0.5;
            let angle = dy.atan2(dx).rem_euclid(std::f64::consts::TAU);
            let light = if self.dark.contains(&angle) {
                3.0
            } else {
                self.light
            };
            // Bands of furniture and windows with edges as sharp as the rim.
            let bands = (23.0 * x / width).sin() * (17.0 * y / height + 0.3).cos();
            let texture =
                1.0 + 0.2 * (9.0 * x / height).sin() + if bands > 0.4 { 0.3 } else { -0.1 };
            random ^= random << 13;
            random ^= random >> 7;
            random ^= random << 17;
            let noise = self.noise * (f64::from(random.to_be_bytes()[1]) / 127.5 - 1.0);
            let value = self.surround + inside.clamp(0.0, 1.0) * light * texture + noise;
            [value, 0.9 * value, 0.7 * value]
        })
    }
}

fn paint(width: u32, height: u32, mut color: impl FnMut(f64, f64) -> [f64; 3]) -> Frame {
    let mut pixels = Vec::new();
    for y in 0..height {
        for x in 0..width {
            // `as` saturates, like overexposure.
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "saturation is intended"
            )]
            pixels.extend(color(f64::from(x), f64::from(y)).map(|value| value as u8));
        }
    }
    Frame::new(width, height, pixels).unwrap()
}

/// White bars like the strokes of a burnt-in date, three strokes per glyph.
fn burn_in_caption(frame: &mut Frame, left: u32, top: u32, glyphs: u32, size: u32) {
    let stroke = (size / 7).max(1);
    let width = frame.width();
    for glyph in 0..glyphs {
        let start = left + glyph * size;
        for y in top..top + size {
            for x in start..start + size * 3 / 4 {
                let (dx, dy) = (x - start, y - top);
                let is_upright = dx < stroke || (dx + stroke >= size * 3 / 4);
                let is_bar = dy >= size / 2 && dy < size / 2 + stroke;
                if is_upright || is_bar {
                    let at = 3 * (y * width + x) as usize;
                    frame.pixels_mut()[at..at + 3].fill(255);
                }
            }
        }
    }
}

fn assert_found(frame: &Frame, truth: &LensCircle) {
    let found = find_lens_circle(frame);
    let is_close = found.is_some_and(|found| {
        let allowed = 0.005 * truth.radius;
        (found.cx - truth.cx).hypot(found.cy - truth.cy) <= allowed
            && (found.radius - truth.radius).abs() <= allowed
    });
    assert!(is_close, "{found:?} is not within 0.5 % of {truth:?}");
}

#[test]
fn a_whole_circle_is_found_to_a_quarter_of_a_pixel() {
    let room = Room::new(640, 480, [322.3, 237.8, 211.4]);
    let found = find_lens_circle(&room.paint()).unwrap();
    assert!((found.cx - 322.3).abs() < 0.25, "{found:?}");
    assert!((found.cy - 237.8).abs() < 0.25, "{found:?}");
    assert!((found.radius - 211.4).abs() < 0.25, "{found:?}");
}

#[test]
fn two_lens_circles_are_told_from_one() {
    let mut halves = Room::new(320, 320, [162.0, 157.0, 150.0]).paint();
    let above = Frame::new(320, 640, halves.pixels().repeat(2)).unwrap();
    assert!(shows_two_circles(&above));
    let rows: Vec<u8> = halves
        .pixels_mut()
        .chunks(320 * 3)
        .flat_map(|row| row.repeat(2))
        .collect();
    assert!(shows_two_circles(&Frame::new(640, 320, rows).unwrap()));
    for circle in [
        [320.0, 160.0, 150.0],
        [320.0, 160.0, 300.0],
        [160.0, 160.0, 150.0],
    ] {
        assert!(
            !shows_two_circles(&Room::new(640, 320, circle).paint()),
            "{circle:?}"
        );
    }
}

#[test]
fn a_circle_that_touches_all_four_borders_is_found() {
    let room = Room::new(500, 500, [249.5, 249.5, 250.0]);
    assert_found(&room.paint(), &room.circle);
}

#[test]
fn a_circle_cut_off_at_the_top_and_bottom_is_found() {
    let room = Room::new(800, 450, [404.0, 220.0, 300.0]);
    assert_found(&room.paint(), &room.circle);
}

#[test]
fn a_circle_visible_only_in_the_corners_is_found() {
    let room = Room::new(600, 600, [299.0, 302.0, 360.0]);
    assert_found(&room.paint(), &room.circle);
}

#[test]
fn a_dark_quarter_of_the_room_does_not_move_the_circle() {
    let room = Room {
        dark: 0.4..2.0,
        ..Room::new(600, 600, [297.0, 301.0, 280.0])
    };
    assert_found(&room.paint(), &room.circle);
}

#[test]
fn a_dim_room_on_a_gray_noisy_surround_is_found() {
    let room = Room {
        light: 40.0,
        surround: 30.0,
        noise: 4.0,
        ..Room::new(640, 640, [318.0, 322.0, 300.0])
    };
    assert_found(&room.paint(), &room.circle);
}

#[test]
fn a_soft_rim_is_found_in_its_middle() {
    let room = Room {
        blur: 9.0,
        ..Room::new(900, 700, [450.0, 348.0, 330.0])
    };
    assert_found(&room.paint(), &room.circle);
}

#[test]
fn captions_in_the_corners_are_ignored() {
    let room = Room::new(720, 576, [360.0, 288.0, 280.0]);
    let mut frame = room.paint();
    burn_in_caption(&mut frame, 8, 8, 9, 22);
    burn_in_caption(&mut frame, 520, 540, 7, 28);
    assert_found(&frame, &room.circle);
}

#[test]
fn a_line_along_the_border_is_ignored() {
    let room = Room::new(700, 600, [351.0, 300.0, 270.0]);
    let mut frame = room.paint();
    frame.pixels_mut()[..3 * 700 * 2].fill(200);
    assert_found(&frame, &room.circle);
}

#[test]
fn the_same_pixels_give_the_same_circle() {
    let frame = Room::new(400, 400, [201.0, 199.0, 190.0]).paint();
    assert_eq!(find_lens_circle(&frame), find_lens_circle(&frame));
}

#[test]
fn a_frame_filled_by_the_lens_image_has_no_circle() {
    let room = Room::new(500, 400, [250.0, 200.0, 900.0]);
    assert_eq!(find_lens_circle(&room.paint()), None);
    let dim = Room {
        light: 25.0,
        ..room
    };
    assert_eq!(find_lens_circle(&dim.paint()), None);
}

#[test]
fn a_lamp_or_a_table_in_the_dark_is_no_lens() {
    let lamp = Room::new(640, 480, [300.0, 260.0, 70.0]);
    assert_eq!(find_lens_circle(&lamp.paint()), None);
    let table = paint(640, 480, |x, y| {
        let is_table = (150.0..420.0).contains(&x) && (100.0..330.0).contains(&y);
        [if is_table { 180.0 } else { 2.0 }; 3]
    });
    assert_eq!(find_lens_circle(&table), None);
}

#[test]
fn a_frame_of_one_color_has_no_circle() {
    for value in [0.0, 60.0, 255.0] {
        assert_eq!(find_lens_circle(&paint(320, 240, |_, _| [value; 3])), None);
    }
}

#[test]
fn the_assumed_circle_is_the_largest_in_the_middle() {
    let expected = LensCircle {
        cx: 959.5,
        cy: 539.5,
        radius: 540.0,
    };
    assert_eq!(assumed_circle(1920, 1080), expected);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn any_painted_circle_is_found(
        (width, height) in (300..800_u32, 300..800_u32),
        (across, down) in (-0.06..0.06, -0.06..0.06),
        radius in 0.3..0.58,
        light in 50.0..220.0,
        surround in 0.0..20.0,
        noise in 0.0..4.0,
        blur in 1.0..3.0,
        seed in any::<u64>(),
    ) {
        let short_side = f64::from(width.min(height));
        let middle = assumed_circle(width, height);
        let room = Room {
            light,
            surround,
            noise,
            blur,
            seed,
            ..Room::new(width, height, [
                middle.cx + across * short_side,
                middle.cy + down * short_side,
                radius * short_side,
            ])
        };
        assert_found(&room.paint(), &room.circle);
    }

    #[test]
    fn any_frame_is_handled_without_a_panic(
        width in 1..80_u32,
        height in 1..80_u32,
        noise in prop::collection::vec(any::<u8>(), 1..64),
    ) {
        let length = 3 * (width * height) as usize;
        let pixels = noise.into_iter().cycle().take(length).collect();
        let frame = Frame::new(width, height, pixels).unwrap();
        if let Some(circle) = find_lens_circle(&frame) {
            prop_assert!(circle.cx.is_finite() && circle.cy.is_finite());
            prop_assert!(circle.radius.is_finite() && circle.radius > 0.0);
        }
    }
}
