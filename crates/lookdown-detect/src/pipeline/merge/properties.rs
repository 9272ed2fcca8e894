//! Property tests of the merge, for arbitrary detections and several kinds of cameras.

use std::sync::{Arc, LazyLock};

use lookdown_calibration::{Areas, CameraGeometry};
use lookdown_lens::geometry::{Lens, Mount};
use proptest::prelude::*;
use strum::VariantArray;

use super::*;
use crate::detection::ViewPixels;
use crate::{
    inference::{Model, ViewDetection},
    parameters::Profile,
    pipeline::test_support::BlobDetector,
};

const WIDTH: u32 = 320;
const HEIGHT: u32 = 240;
/// Side length of a view in pixels, equal to the input of [`BlobDetector`].
const SIDE: f64 = 96.0;

/// Cameras in every profile, with a lens image within the frame or larger, that point down,
/// obliquely or along the floor.
static CAMERAS: LazyLock<Vec<(Arc<CameraRig>, Profile)>> = LazyLock::new(|| {
    let mut rigs = Vec::new();
    for (radius, up) in [
        (118.0, [0.0, 0.0, -1.0]),
        (190.0, [0.1, 0.4, -1.0]),
        (190.0, [0.0, -1.0, 0.0]),
    ] {
        for &profile in Profile::VARIANTS {
            let up = nalgebra::Unit::new_normalize(up.into());
            let geometry = CameraGeometry {
                lens: Lens::equidistant_circle(159.5, 119.5, radius, 1.57).unwrap(),
                mount: Mount::new(up, Some(2.8)),
                areas: Areas::default(),
            };
            let plan = profile.view_plan();
            let input = BlobDetector::default().input;
            let rig = CameraRig::new(geometry, WIDTH, HEIGHT, plan.as_ref(), &input);
            rigs.push((Arc::new(rig), profile));
        }
    }
    rigs
});
static MODEL: LazyLock<Arc<Model>> =
    LazyLock::new(|| Arc::new(Model::new(Box::new(BlobDetector::default()))));

/// Generates a box and a number that selects its view.
fn view_box() -> impl Strategy<Value = (usize, BBox<ViewPixels>)> {
    let side = || prop_oneof![4 => 0.0..=SIDE, 1 => Just(0.0), 1 => Just(SIDE)];
    (any::<usize>(), side(), side(), side(), side()).prop_map(|(view, x, y, to_x, to_y)| {
        let sides = [x.min(to_x), y.min(to_y), x.max(to_x), y.max(to_y)];
        (view, BBox::new(sides).unwrap())
    })
}

/// Generates detections with distinct scores and view numbers, in two orders. Score weights make no
/// two scores equal: the scores are proportional to the square roots of 1, 2, 3 …, and no ratio of
/// these is a product of the weights, which are tenths.
fn detections_in_two_orders() -> impl Strategy<Value = [Vec<(usize, ViewDetection)>; 2]> {
    let scored = prop::collection::vec(view_box(), 1..40).prop_map(|detections| {
        let mut squared = 0.0_f64;
        let scored = detections.into_iter().map(|(view, bbox)| {
            squared += 1.0 / 64.0;
            let score = squared.sqrt();
            let posture = None;
            (
                view,
                ViewDetection {
                    bbox,
                    score,
                    posture,
                },
            )
        });
        scored.collect::<Vec<_>>()
    });
    scored.prop_flat_map(|detections| {
        let shuffled = Just(detections.clone()).prop_shuffle();
        (Just(detections), shuffled).prop_map(|(one, other)| [one, other])
    })
}

fn parameters() -> impl Strategy<Value = RefinementParameters> {
    let refinement = prop::sample::select(Refinement::VARIANTS);
    (refinement, 0.0..=1.0, 0.05..1.0, 0.0..0.5).prop_map(
        |(refinement, iou_threshold, sigma, score_threshold)| RefinementParameters {
            refinement,
            iou_threshold,
            sigma,
            score_threshold,
            max_detections: 1000,
        },
    )
}

fn pass(rig: &Arc<CameraRig>, detections: &[(usize, ViewDetection)]) -> Pass {
    let mut per_view = vec![Vec::new(); rig.view_count()];
    for (view, detection) in detections {
        per_view[view % rig.view_count()].push(*detection);
    }
    Pass::new(&[], Arc::clone(rig), Arc::clone(&MODEL), per_view)
}

proptest! {
    #[test]
    fn persons_lie_in_the_frame_and_have_finite_numbers(
        [detections, _] in detections_in_two_orders(),
        camera in prop::sample::select((0..CAMERAS.len()).collect::<Vec<_>>()),
        parameters in parameters(),
    ) {
        let (rig, profile) = &CAMERAS[camera];
        for person in persons(&[pass(rig, &detections)], *profile, &profile.tuning(), &parameters) {
            let [x_min, y_min, x_max, y_max] = person.bbox.corners();
            prop_assert!(0.0 <= x_min && x_min < x_max && x_max <= f64::from(WIDTH), "{person:?}");
            prop_assert!(0.0 <= y_min && y_min < y_max && y_max <= f64::from(HEIGHT), "{person:?}");
            prop_assert!(person.score >= parameters.score_threshold - 1e-12 && person.score <= 1.0);
            prop_assert!(person.views >= 1);
            let turned = person.oriented_box;
            let numbers = [
                turned.center.x, turned.center.y, turned.width, turned.height, turned.angle,
            ];
            prop_assert!(numbers.iter().all(|number| number.is_finite()), "{person:?}");
            prop_assert!(turned.width >= 0.0 && turned.height >= 0.0, "{person:?}");
            if let Some(bearing) = person.bearing {
                prop_assert!(bearing.azimuth.is_finite() && bearing.off_axis.is_finite());
            }
            if let Some(floor) = person.floor {
                prop_assert!(floor.x_m.is_finite() && floor.y_m.is_finite(), "{person:?}");
            }
        }
    }

    #[test]
    fn the_order_of_detections_does_not_change_the_persons(
        [detections, shuffled] in detections_in_two_orders(),
        camera in prop::sample::select((0..CAMERAS.len()).collect::<Vec<_>>()),
        parameters in parameters(),
    ) {
        let (rig, profile) = &CAMERAS[camera];
        let [one, other] = [detections, shuffled]
            .map(|detections| persons(&[pass(rig, &detections)], *profile, &profile.tuning(), &parameters));
        prop_assert_eq!(one.len(), other.len());
        for (one, other) in one.iter().zip(&other) {
            let pairs = one.bbox.corners().into_iter().zip(other.bbox.corners());
            for (one, other) in pairs.chain([(one.score, other.score)]) {
                prop_assert!((one - other).abs() <= 1e-9 * one.abs().max(1.0), "{} {}", one, other);
            }
        }
    }
}
