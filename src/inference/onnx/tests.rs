use super::*;

fn options(floor: f64, per_view: usize) -> OnnxOptions {
    OnnxOptions {
        threads: NonZeroUsize::MIN,
        score_floor: floor,
        max_detections_per_view: per_view,
    }
}

#[test]
fn boxes_are_clipped_and_what_is_no_box_or_no_score_is_dropped() {
    let boxes = [
        [-10.0, 5.0, 50.0, 400.0],
        [f32::NAN, 0.0, 10.0, 10.0],
        [20.0, 20.0, 10.0, 10.0],
        [310.0, 0.0, 320.0, 10.0],
        [1.0, 2.0, 3.0, 4.0],
        [1.0, 2.0, 3.0, 4.0],
    ]
    .concat();
    let scores = [0.9, 0.9, 0.9, 0.9, f32::NAN, 0.019];
    let found = decode_view(
        &boxes,
        &scores,
        &NetworkInput::plain(300, 300),
        &options(0.02, 100),
    );
    assert_eq!(found.len(), 1);
    assert_eq!(found[0].bbox.corners(), [0.0, 5.0, 50.0, 300.0]);
}

#[test]
fn the_best_boxes_of_a_view_are_kept() {
    let boxes = [0.0, 0.0, 10.0, 10.0].repeat(50);
    let scores: Vec<f32> = (0..50_u16)
        .map(|index| f32::from(index * 7 % 50) / 50.0)
        .collect();
    let found = decode_view(
        &boxes,
        &scores,
        &NetworkInput::plain(300, 300),
        &options(0.0, 10),
    );
    assert_eq!(found.len(), 10);
    assert!(found.iter().all(|detection| detection.score > 0.79));
}
