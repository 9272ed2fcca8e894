//! Whole views.

use lookdown_lens::geometry::{Mount, QuarterTurn, Ray, ViewPlan};
use nalgebra::Unit;

use super::{
    super::*,
    lenses::{FRAME_SIDE, every_lens},
    sampling::{noise, reference},
    three_rings,
};
use crate::ChannelOrder;

fn tilted() -> Mount {
    Mount::new(Unit::new_normalize(Ray::new(0.1, 0.05, -1.0)), None)
}

fn grid_count(tables: &[RemapTable]) -> usize {
    let grids: HashSet<_> = tables
        .iter()
        .map(|table| Arc::as_ptr(&table.grid))
        .collect();
    grids.len()
}

#[test]
fn a_view_shows_what_lies_at_its_positions() {
    let frame = noise(200, 150);
    let lens = Lens::equidistant_circle(99.5, 70.5, 100.0, 1.5).unwrap();
    let (width, height) = (45, 37);
    let input = NetworkInput::plain(width, height);
    let views = three_rings().views(&Mount::default(), width, height);
    for table in RemapTable::for_views(&views, &lens, 200, 150) {
        let mut slot = vec![-1.0; input.view_len()];
        table.render(&frame, &input, &mut slot);
        let mut sees_anything = false;
        for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
            let position = table.position(x, y).filter(|position| {
                (-0.5..=199.5).contains(&position.x) && (-0.5..=149.5).contains(&position.y)
            });
            sees_anything |= position.is_some();
            for channel in 0..3 {
                let expected =
                    position.map_or(0.0, |position| reference(&frame, &position, channel));
                let found = slot[channel * input.plane_len() + (y * width + x) as usize];
                let is_same = (f64::from(found) - expected).abs() < 0.02;
                assert!(is_same, "({x}, {y}): {found} instead of {expected}");
            }
        }
        assert_eq!(table.sees_anything(), sees_anything);
        let mut portable = vec![-1.0; input.view_len()];
        table.render_portably(&frame, &input, &mut portable);
        assert_eq!(slot, portable);
    }
}

#[test]
fn channel_order_scale_and_offset_are_applied_per_plane() {
    let frame = Frame::new(40, 40, [10, 20, 30].repeat(1600)).unwrap();
    let input = NetworkInput {
        channel_order: ChannelOrder::Bgr,
        scale: [1.0, 2.0, 3.0],
        offset: [0.5, 0.0, -1.0],
        ..NetworkInput::plain(16, 16)
    };
    let lens = Lens::equidistant_circle(19.5, 19.5, 20.0, 0.3).unwrap();
    let view = VirtualView::looking_along(&Ray::z(), 16.0, &Mount::default(), 16, 16);
    let mut slot = vec![f32::NAN; input.view_len()];
    RemapTable::for_views(&[view], &lens, 40, 40)[0].render(&frame, &input, &mut slot);
    let at = |x: usize, y: usize| [0, 1, 2].map(|plane| slot[plane * 256 + y * 16 + x]);
    assert_eq!(at(8, 8), [30.5, 40.0, 29.0]);
    assert_eq!(at(0, 0), [0.5, 0.0, -1.0], "beyond the rim is black");
}

#[test]
fn a_shared_grid_puts_every_view_of_a_ring_where_its_own_would() {
    for lens in every_lens() {
        let views = three_rings().views(&Mount::default(), 104, 104);
        let tables = RemapTable::for_views(&views, &lens, FRAME_SIDE, FRAME_SIDE);
        let expected_grids = if lens.model() == "mei" {
            views.len()
        } else {
            3
        };
        assert_eq!(grid_count(&tables), expected_grids, "{}", lens.model());
        for (view, table) in views.iter().zip(&tables) {
            let own =
                RemapTable::for_views(std::slice::from_ref(view), &lens, FRAME_SIDE, FRAME_SIDE);
            for (x, y) in (0..104)
                .step_by(9)
                .flat_map(|y| (0..104).map(move |x| (x, y)))
            {
                let [shared, own] = [table, &own[0]].map(|table| table.position(x, y));
                let distance = shared.zip(own).map(|(shared, own)| (shared - own).norm());
                assert_eq!(shared.is_some(), own.is_some());
                assert!(
                    distance.is_none_or(|distance| distance < 2e-3),
                    "{distance:?}"
                );
            }
        }
    }
}

#[test]
fn every_pixel_of_a_whole_patch_shows_the_lens_image() {
    for lens in every_lens() {
        let views = three_rings().views(&Mount::default(), 100, 100);
        let tables = RemapTable::for_views(&views, &lens, FRAME_SIDE, FRAME_SIDE);
        let last = f64::from(FRAME_SIDE - 1);
        let mut whole = 0;
        for (table, band) in tables.iter().flat_map(|table| {
            (0..table.grid.visibility.bands()).map(move |band| (table, table.band(band)))
        }) {
            for (x, y) in band.whole_patches.flat_map(|patch| {
                let rows = band.rows.clone();
                rows.flat_map(move |y| (8 * patch..8 * patch + 8).map(move |x| (x, y)))
            }) {
                whole += 1;
                let [x, y] = [x, y].map(|coordinate| u32::try_from(coordinate).unwrap());
                let position = table.position(x, y).unwrap();
                let is_within = |place: f64| (0.0..last).contains(&place);
                assert!(
                    is_within(position.x) && is_within(position.y),
                    "{position:?}"
                );
            }
        }
        let pixels: u32 = views.iter().map(|view| view.width * view.height).sum();
        let share = f64::from(whole) / f64::from(pixels);
        assert!(share > 0.5, "{}: {share}", lens.model());
    }
}

#[test]
fn views_not_rotated_about_the_optical_axis_share_nothing() {
    let lens = Lens::equidistant_circle(99.5, 99.5, 100.0, 1.5).unwrap();
    let views = three_rings().views(&tilted(), 64, 64);
    let tables = RemapTable::for_views(&views, &lens, 200, 200);
    assert_eq!(grid_count(&tables), views.len());
    let all = RemapTable::bytes(&tables);
    let each: usize = tables.iter().map(|table| RemapTable::bytes([table])).sum();
    assert_eq!(all, each);
}

#[test]
fn shared_grids_count_once() {
    let lens = Lens::equidistant_circle(99.5, 99.5, 100.0, 1.5).unwrap();
    let views = ViewPlan::fast().views(&Mount::default(), 64, 64);
    let tables = RemapTable::for_views(&views, &lens, 200, 200);
    let one = RemapTable::bytes(&tables[..1]);
    let own = size_of::<RemapTable>() + tables[1].whole_patches.bytes();
    assert_eq!(RemapTable::bytes(&tables), one + (tables.len() - 1) * own);
}

#[test]
fn a_crop_of_scale_one_is_the_turned_frame() {
    let frame = noise(60, 40);
    let (width, height) = (24, 16);
    let input = NetworkInput::plain(width, height);
    for turn in QuarterTurn::ALL {
        let crop = FrameCrop {
            is_mirrored: false,
            turn,
            center: Pixel::new(30.0, 20.0),
            scale: 1.0,
            width,
            height,
        };
        let table = RemapTable::for_crop(&crop, 60, 40);
        let mut slot = vec![-1.0; input.view_len()];
        table.render(&frame, &input, &mut slot);
        for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
            let middle = Pixel::new(f64::from(x) + 0.5, f64::from(y) + 0.5);
            let place = crop.frame_from_crop(&middle);
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "the place lies within the frame"
            )]
            let pixel = frame.pixel(place.x as u32, place.y as u32);
            for (channel, expected) in pixel.into_iter().enumerate() {
                let found = slot[channel * input.plane_len() + (y * width + x) as usize];
                assert_eq!(found, f32::from(expected), "{turn:?} ({x}, {y})");
            }
        }
    }
}

#[test]
fn a_crop_beyond_the_frame_is_black_there() {
    let frame = Frame::new(40, 40, vec![200; 40 * 40 * 3]).unwrap();
    let input = NetworkInput::plain(16, 16);
    let crop = |x: f64| FrameCrop {
        is_mirrored: false,
        turn: QuarterTurn::None,
        center: Pixel::new(x, 20.0),
        scale: 1.0,
        width: 16,
        height: 16,
    };
    let table = RemapTable::for_crop(&crop(0.0), 40, 40);
    let mut slot = vec![-1.0; input.view_len()];
    table.render(&frame, &input, &mut slot);
    let row = &slot[..16];
    assert!(row[..8].iter().all(|&value| value == 0.0), "{row:?}");
    assert!(row[8..].iter().all(|&value| value == 200.0), "{row:?}");
    assert!(!RemapTable::for_crop(&crop(-100.0), 40, 40).sees_anything());
}
