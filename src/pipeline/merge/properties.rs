//! What must hold for whatever a network finds, through any kind of camera.

use std::sync::{Arc, LazyLock};

use proptest::prelude::*;
use strum::VariantArray;

use super::*;
use crate::{
    calibration::{Areas, CameraGeometry},
    geometry::{FieldOfViewReading, Lens, Mount},
    inference::{Model, ViewDetection},
    pipeline::{Profile, test_support::BlobDetector},
};

const WIDTH: u32 = 320;
const HEIGHT: u32 = 240;
/// Pixels of a view, each side: those of [`BlobDetector`].
const SIDE: f64 = 96.0;

/// Cameras whose lens image lies in the frame or is larger, that look down, askance or along the
/// floor, in every profile.
static LOOKS: LazyLock<Vec<(Arc<CameraRig>, BackProjection)>> = LazyLock::new(|| {
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
            let plan = profile.view_plan(FieldOfViewReading::default());
            let input = BlobDetector::default().input;
            let rig = CameraRig::new(geometry, WIDTH, HEIGHT, plan.as_ref(), &input);
            rigs.push((Arc::new(rig), profile.back_projection()));
        }
    }
    rigs
});
static MODEL: LazyLock<Arc<Model>> =
    LazyLock::new(|| Arc::new(Model::new(Box::new(BlobDetector::default()))));

/// A find in whichever view the number chooses.
fn find() -> impl Strategy<Value = (usize, BBox<ViewPixels>)> {
    let side = || prop_oneof![4 => 0.0..=SIDE, 1 => Just(0.0), 1 => Just(SIDE)];
    (any::<usize>(), side(), side(), side(), side()).prop_map(|(view, x, y, to_x, to_y)| {
        let sides = [x.min(to_x), y.min(to_y), x.max(to_x), y.max(to_y)];
        (view, BBox::new(sides).unwrap())
    })
}

/// Finds of different scores, each with its view's number, in two orders. No doubt makes two scores equal: they are
/// the square roots of 1, 2, 3 …, of whose ratios none is a product of the tenths that doubts are.
fn finds_in_two_orders() -> impl Strategy<Value = [Vec<(usize, ViewDetection)>; 2]> {
    let scored = prop::collection::vec(find(), 1..40).prop_map(|finds| {
        let mut squared = 0.0_f64;
        let scored = finds.into_iter().map(|(view, bbox)| {
            squared += 1.0 / 64.0;
            let score = squared.sqrt();
            (view, ViewDetection { bbox, score })
        });
        scored.collect::<Vec<_>>()
    });
    scored.prop_flat_map(|finds| {
        let shuffled = Just(finds.clone()).prop_shuffle();
        (Just(finds), shuffled).prop_map(|(one, other)| [one, other])
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

fn look(rig: &Arc<CameraRig>, finds: &[(usize, ViewDetection)]) -> Pass {
    let mut per_view = vec![Vec::new(); rig.view_count()];
    for (view, detection) in finds {
        per_view[view % rig.view_count()].push(*detection);
    }
    Pass {
        rig: Arc::clone(rig),
        model: Arc::clone(&MODEL),
        per_view,
    }
}

proptest! {
    #[test]
    fn persons_lie_in_the_frame_and_every_number_of_theirs_is_finite(
        [finds, _] in finds_in_two_orders(),
        camera in prop::sample::select((0..LOOKS.len()).collect::<Vec<_>>()),
        parameters in parameters(),
    ) {
        let (rig, back_projection) = &LOOKS[camera];
        for person in persons(&[look(rig, &finds)], *back_projection, &parameters) {
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
    fn the_order_in_which_views_tell_what_they_found_does_not_matter(
        [finds, shuffled] in finds_in_two_orders(),
        camera in prop::sample::select((0..LOOKS.len()).collect::<Vec<_>>()),
        parameters in parameters(),
    ) {
        let (rig, back_projection) = &LOOKS[camera];
        let [one, other] = [finds, shuffled]
            .map(|finds| persons(&[look(rig, &finds)], *back_projection, &parameters));
        prop_assert_eq!(one.len(), other.len());
        for (one, other) in one.iter().zip(&other) {
            let pairs = one.bbox.corners().into_iter().zip(other.bbox.corners());
            for (one, other) in pairs.chain([(one.score, other.score)]) {
                prop_assert!((one - other).abs() <= 1e-9 * one.abs().max(1.0), "{} {}", one, other);
            }
        }
    }
}
