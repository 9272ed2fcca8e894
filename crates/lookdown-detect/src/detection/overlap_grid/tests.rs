//! Queries of the grid against a comparison of every pair.

use proptest::prelude::*;

use super::{BBox, FramePixels, Overlap, OverlapGrid};

type FrameBox = BBox<FramePixels>;

fn frame_box() -> impl Strategy<Value = FrameBox> {
    (0.0..1000.0, 0.0..1000.0, 0.0..150.0, 0.0..150.0)
        .prop_map(|(x, y, width, height)| BBox::new([x, y, x + width, y + height]).unwrap())
}

fn boxes() -> impl Strategy<Value = Vec<FrameBox>> {
    prop::collection::vec(frame_box(), 0..40)
}

/// An IoU above 0, one that a refinement may use, or 1 for boxes that coincide.
fn least_iou() -> impl Strategy<Value = f64> {
    prop_oneof![Just(0.0), 0.0..1.0, Just(0.5), Just(1.0)]
}

/// Inserts the boxes one by one.
fn grid_of(boxes: &[FrameBox], least_iou: f64) -> OverlapGrid {
    let mut grid = OverlapGrid::covering(boxes.iter(), least_iou);
    for bbox in boxes {
        grid.insert(bbox);
    }
    grid
}

fn found(grid: &OverlapGrid, bbox: &FrameBox, first: usize) -> Vec<Overlap> {
    let mut found = Vec::new();
    grid.overlaps(bbox, first, &mut found);
    found
}

/// Compares every box.
fn overlaps(boxes: &[FrameBox], bbox: &FrameBox, first: usize, least_iou: f64) -> Vec<Overlap> {
    (first..boxes.len())
        .map(|number| Overlap {
            number,
            iou: bbox.iou(&boxes[number]),
        })
        .filter(|overlap| overlap.iou > 0.0 && overlap.iou >= least_iou)
        .collect()
}

proptest! {
    #[test]
    fn the_grid_finds_the_same_overlaps_as_comparing_every_box(
        boxes in boxes(),
        wanted in frame_box(),
        first in 0..40_usize,
        least_iou in least_iou(),
    ) {
        let grid = grid_of(&boxes, least_iou);
        prop_assert_eq!(found(&grid, &wanted, first), overlaps(&boxes, &wanted, first, least_iou));
        for bbox in &boxes {
            prop_assert_eq!(found(&grid, bbox, 0), overlaps(&boxes, bbox, 0, least_iou));
        }
    }

    #[test]
    fn a_box_whose_iou_is_just_enough_is_found(
        wanted in frame_box(),
        share in 0.01..1.0_f64,
        at_the_end in any::<bool>(),
        others in boxes(),
    ) {
        // The whole height and a share of the width, at either end. The IoU is that share.
        let [x_min, y_min, x_max, y_max] = wanted.corners();
        let part = if at_the_end {
            [x_max - share * wanted.width(), y_min, x_max, y_max]
        } else {
            [x_min, y_min, x_min + share * wanted.width(), y_max]
        };
        let part = BBox::new(part).unwrap();
        let least_iou = wanted.iou(&part);
        let mut boxes = vec![part];
        boxes.extend(others);
        let found = found(&grid_of(&boxes, least_iou), &wanted, 0);
        prop_assert_eq!(found, overlaps(&boxes, &wanted, 0, least_iou));
    }

    #[test]
    fn a_box_that_moved_is_found_where_it_is_now(
        boxes in boxes(),
        moves in prop::collection::vec((any::<prop::sample::Index>(), frame_box()), 0..20),
        wanted in frame_box(),
        least_iou in least_iou(),
    ) {
        let mut grid = grid_of(&boxes, least_iou);
        let mut moved = boxes;
        for (index, bbox) in moves {
            if !moved.is_empty() {
                let number = index.index(moved.len());
                grid.move_to(number, &bbox);
                moved[number] = bbox;
            }
        }
        prop_assert_eq!(found(&grid, &wanted, 0), overlaps(&moved, &wanted, 0, least_iou));
        for bbox in &moved {
            prop_assert_eq!(found(&grid, bbox, 0), overlaps(&moved, bbox, 0, least_iou));
        }
    }
}

#[test]
fn few_of_many_scattered_boxes_are_listed_together() {
    let mut boxes = Vec::new();
    for row in 0..20 {
        for column in 0..20 {
            let (x, y) = (f64::from(column) * 50.0, f64::from(row) * 50.0);
            boxes.push(BBox::new([x, y, x + 40.0, y + 40.0]).unwrap());
        }
    }
    let grid = grid_of(&boxes, 0.5);
    assert!(grid.cells.iter().all(|listed| listed.len() <= 4));
}
