//! The grid must never miss an overlap.

use proptest::prelude::*;

use super::{BBox, FramePixels, OverlapGrid};

type FrameBox = BBox<FramePixels>;

fn frame_box() -> impl Strategy<Value = FrameBox> {
    (0.0..1000.0, 0.0..1000.0, 0.0..150.0, 0.0..150.0)
        .prop_map(|(x, y, width, height)| BBox::new([x, y, x + width, y + height]).unwrap())
}

fn boxes() -> impl Strategy<Value = Vec<FrameBox>> {
    prop::collection::vec(frame_box(), 0..40)
}

/// Inserts one box after the other.
fn grid_of(boxes: &[FrameBox]) -> OverlapGrid {
    let mut grid = OverlapGrid::covering(boxes.iter());
    for bbox in boxes {
        grid.insert(bbox);
    }
    grid
}

fn near(grid: &OverlapGrid, bbox: &FrameBox, first: usize) -> Vec<usize> {
    let mut found = Vec::new();
    grid.near(bbox, first, &mut found);
    found
}

fn overlapping(boxes: &[FrameBox], bbox: &FrameBox) -> Vec<usize> {
    (0..boxes.len())
        .filter(|number| boxes[*number].intersection_area(bbox) > 0.0)
        .collect()
}

proptest! {
    #[test]
    fn every_overlapping_box_is_found_once_and_in_order(
        boxes in boxes(),
        wanted in frame_box(),
        first in 0..40_usize,
    ) {
        let found = near(&grid_of(&boxes), &wanted, first);
        prop_assert!(found.is_sorted_by(|a, b| a < b));
        prop_assert!(found.iter().all(|number| *number >= first));
        for number in overlapping(&boxes, &wanted) {
            prop_assert!(number < first || found.contains(&number));
        }
    }

    #[test]
    fn a_box_that_moved_is_found_where_it_is_now(
        boxes in boxes(),
        moves in prop::collection::vec((any::<prop::sample::Index>(), frame_box()), 0..20),
        wanted in frame_box(),
    ) {
        let mut grid = grid_of(&boxes);
        let mut moved = boxes;
        for (index, bbox) in moves {
            if !moved.is_empty() {
                let number = index.index(moved.len());
                grid.extend(number, &bbox);
                moved[number] = bbox;
            }
        }
        let found = near(&grid, &wanted, 0);
        prop_assert!(found.is_sorted_by(|a, b| a < b));
        for number in overlapping(&moved, &wanted) {
            prop_assert!(found.contains(&number));
        }
    }
}

#[test]
fn few_of_many_scattered_boxes_are_looked_at() {
    let mut boxes = Vec::new();
    for row in 0..20 {
        for column in 0..20 {
            let (x, y) = (f64::from(column) * 50.0, f64::from(row) * 50.0);
            boxes.push(BBox::new([x, y, x + 40.0, y + 40.0]).unwrap());
        }
    }
    assert!(near(&grid_of(&boxes), &boxes[210], 0).len() <= 9);
}
