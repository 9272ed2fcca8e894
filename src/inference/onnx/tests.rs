use super::*;
use crate::detection::BBox;

#[test]
fn the_best_boxes_of_a_view_are_kept() {
    let mut found: Vec<_> = (0..50)
        .map(|index| ViewDetection {
            bbox: BBox::new([0.0, 0.0, 10.0, 10.0]).unwrap(),
            score: f64::from(index * 7 % 50) / 50.0,
        })
        .collect();
    keep_best(&mut found, 10);
    assert_eq!(found.len(), 10);
    assert!(found.iter().all(|detection| detection.score > 0.79));
}
