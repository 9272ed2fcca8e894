//! Short cuts must not change the kept scores.

use proptest::prelude::*;

use super::{Activation, Floor, Score, sigmoid};

#[test]
fn a_score_equal_to_the_floor_is_kept() {
    let floor = Floor::new(0.25);
    assert_eq!(Activation::None.score(0.25, floor), Score::Kept(0.25));
    assert_eq!(Activation::None.score(0.249_999_99, floor), Score::Below);
    assert_eq!(
        Activation::Sigmoid.score(0.0, Floor::new(0.5)),
        Score::Kept(0.5)
    );
}

#[test]
fn a_floor_of_zero_keeps_every_finite_score() {
    let floor = Floor::new(0.0);
    assert_eq!(Activation::None.score(0.0, floor), Score::Kept(0.0));
    assert_eq!(floor.sigmoid(f32::MIN), Score::Kept(0.0));
    assert_eq!(floor.softmax(&[f32::MIN, f32::MAX], 0), Score::Kept(0.0));
}

#[test]
fn a_floor_of_one_keeps_only_saturated_scores() {
    let floor = Floor::new(1.0);
    assert_eq!(floor.sigmoid(100.0), Score::Kept(1.0));
    assert_eq!(floor.sigmoid(20.0), Score::Below);
    assert_eq!(Activation::None.score(1.0, floor), Score::Kept(1.0));
}

#[test]
fn nothing_reaches_a_floor_that_is_nan() {
    let floor = Floor::new(f64::NAN);
    assert_eq!(floor.sigmoid(100.0), Score::Below);
    assert_eq!(Activation::None.score(1.0, floor), Score::Below);
}

#[test]
fn non_finite_values_are_distinguished_from_low_scores() {
    let floor = Floor::new(0.5);
    for raw in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        assert_eq!(Activation::None.score(raw, floor), Score::NotFinite);
        assert_eq!(Activation::Sigmoid.score(raw, floor), Score::NotFinite);
        assert_eq!(floor.softmax(&[3.0, raw], 0), Score::NotFinite);
    }
}

#[test]
fn a_logit_is_not_a_probability_but_rounding_is_accepted() {
    let floor = Floor::new(0.5);
    assert_eq!(
        Activation::None.score(3.0, floor),
        Score::NotAProbability(3.0)
    );
    assert_eq!(
        Activation::None.score(-3.0, floor),
        Score::NotAProbability(-3.0)
    );
    assert_eq!(Activation::None.score(1.004, floor), Score::Kept(1.0));
    assert_eq!(Activation::None.score(-0.004, floor), Score::Below);
}

#[test]
fn a_product_below_the_floor_is_dropped() {
    let floor = Floor::new(0.5);
    let half_way = Score::Kept(0.6);
    assert_eq!(half_way.times(floor, || half_way), Score::Below);
    assert_eq!(Score::Kept(1.0).times(floor, || half_way), Score::Kept(0.6));
}

fn plain_softmax(logits: &[f32], class: usize) -> f64 {
    let exponentials: Vec<f64> = logits.iter().map(|&l| f64::from(l).exp()).collect();
    exponentials[class] / exponentials.iter().sum::<f64>()
}

/// Computed by the formula alone, without the short cuts.
fn plainly(score: f64, floor: f64) -> Option<f64> {
    (score >= floor).then_some(score)
}

fn kept(score: Score) -> Option<f64> {
    match score {
        Score::Kept(score) => Some(score),
        _ => None,
    }
}

proptest! {
    #[test]
    fn the_logit_short_cut_drops_nothing_the_sigmoid_would_keep(
        logit in prop_oneof![-50.0_f32..50.0, -1e-3_f32..1e-3],
        nudge in -3_i32..4,
        offset in -1e-3_f64..1e-3,
    ) {
        // Floors close to the score itself, down to single roundings.
        let score = sigmoid(f64::from(logit));
        let near = (0..nudge.abs()).fold(score, |s, _| if nudge > 0 { s.next_up() } else { s.next_down() });
        for floor in [near, near + offset, 0.0, 1.0] {
            prop_assert_eq!(kept(Floor::new(floor).sigmoid(logit)), plainly(score, floor));
        }
    }

    #[test]
    fn the_softmax_short_cut_drops_nothing_the_softmax_would_keep(
        logits in prop::collection::vec(-20.0_f32..20.0, 1..6),
        floor in 0.0_f64..1.0,
    ) {
        let score = plain_softmax(&logits, 0);
        // Where rounding decides, either result is correct.
        prop_assume!((score - floor).abs() > 1e-12);
        let found = kept(Floor::new(floor).softmax(&logits, 0));
        prop_assert_eq!(found.is_some(), plainly(score, floor).is_some());
        if let Some(found) = found {
            prop_assert!((found - score).abs() < 1e-12);
        }
    }
}
