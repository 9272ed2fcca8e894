//! Properties that hold for any candidates, and a plain reference that the fast merge must match.

use proptest::prelude::*;
use strum::VariantArray;

use super::{BBox, Candidate, MergedDetection, Refinement, RefinementParameters, refine};

const NMS_FAMILY: [Refinement; 3] = [
    Refinement::Nms,
    Refinement::SoftNmsLinear,
    Refinement::SoftNmsGaussian,
];

/// Boxes on a coarse lattice, so that equal, nested and touching boxes are frequent, with many
/// equal scores.
fn candidate() -> impl Strategy<Value = Candidate> {
    let corner = || (0..60_i32).prop_map(|value| f64::from(value) * 5.0);
    let side = || (0..30_i32).prop_map(|value| f64::from(value) * 5.0);
    let share = |steps: i32| (1..=steps).prop_map(move |value| f64::from(value) / f64::from(steps));
    (
        corner(),
        corner(),
        side(),
        side(),
        share(50),
        0..6_usize,
        share(10),
        1.0..9.0,
    )
        .prop_map(
            |(x, y, width, height, score, view, coordinate_weight, expected_views)| Candidate {
                bbox: BBox::new([x, y, x + width, y + height]).unwrap(),
                score,
                view,
                coordinate_weight,
                expected_views,
            },
        )
}

fn candidates() -> impl Strategy<Value = Vec<Candidate>> {
    prop::collection::vec(candidate(), 0..60)
}

/// Candidates in any order with pairwise different scores.
fn distinct_candidates() -> impl Strategy<Value = Vec<Candidate>> {
    candidates()
        .prop_map(|mut candidates| {
            let mut step = 0.0;
            for candidate in &mut candidates {
                step += 1.0;
                candidate.score = step / 64.0;
            }
            candidates
        })
        .prop_shuffle()
}

fn parameters(
    refinement: impl Strategy<Value = Refinement>,
) -> impl Strategy<Value = RefinementParameters> {
    let threshold = || {
        prop_oneof![
            Just(0.0),
            Just(1.0),
            (0..=20_i32).prop_map(|v| f64::from(v) / 20.0)
        ]
    };
    let max_detections = prop_oneof![1 => 0..8_usize, 2 => Just(1000)];
    (
        refinement,
        threshold(),
        0.05..1.0,
        threshold(),
        max_detections,
    )
        .prop_map(
            |(refinement, iou_threshold, sigma, score_threshold, max_detections)| {
                RefinementParameters {
                    refinement,
                    iou_threshold,
                    sigma,
                    score_threshold,
                    max_detections,
                }
            },
        )
}

fn any_refinement() -> impl Strategy<Value = Refinement> {
    prop::sample::select(Refinement::VARIANTS)
}

fn nms_family() -> impl Strategy<Value = Refinement> {
    prop::sample::select(NMS_FAMILY.to_vec())
}

/// The NMS family as described in the paper: every pair is compared, nothing is left out before the
/// loop, and the threshold is applied to the rescored scores.
fn reference(candidates: &[Candidate], parameters: &RefinementParameters) -> Vec<(usize, f64)> {
    let mut scores: Vec<f64> = candidates.iter().map(|candidate| candidate.score).collect();
    let mut left: Vec<usize> = (0..candidates.len()).collect();
    let mut kept = Vec::new();
    while !left.is_empty() {
        let mut best = 0;
        for position in 1..left.len() {
            if scores[left[position]] > scores[left[best]] {
                best = position;
            }
        }
        let picked = left.remove(best);
        for &index in &left {
            let iou = candidates[picked].bbox.iou(&candidates[index].bbox);
            let suppressed = iou >= parameters.iou_threshold;
            scores[index] *= match parameters.refinement {
                Refinement::Nms if suppressed => 0.0,
                Refinement::SoftNmsLinear if suppressed => 1.0 - iou,
                Refinement::SoftNmsGaussian => (-iou * iou / parameters.sigma).exp(),
                _ => 1.0,
            };
        }
        if scores[picked] > 0.0 && scores[picked] >= parameters.score_threshold {
            kept.push((picked, scores[picked]));
        }
    }
    kept.truncate(parameters.max_detections);
    kept
}

/// Weighted box fusion without a grid, with the means recomputed from all members.
fn fusion_reference(
    candidates: &[Candidate],
    parameters: &RefinementParameters,
) -> Vec<Vec<usize>> {
    let mean = |members: &[usize]| {
        let mut sums = [0.0; 4];
        let mut total = 0.0;
        for &member in members {
            let Candidate {
                bbox,
                score,
                coordinate_weight,
                ..
            } = candidates[member];
            let weight = score * score * score * coordinate_weight;
            total += weight;
            for (sum, coordinate) in sums.iter_mut().zip(bbox.corners()) {
                *sum += weight * coordinate;
            }
        }
        sums.map(|sum| sum / total)
    };
    let mut order: Vec<usize> = (0..candidates.len()).collect();
    order.sort_by(|a, b| candidates[*b].score.total_cmp(&candidates[*a].score));
    let mut clusters: Vec<Vec<usize>> = Vec::new();
    for index in order {
        let mut best: Option<(usize, f64)> = None;
        for (number, members) in clusters.iter().enumerate() {
            let [x_min, y_min, x_max, y_max] = mean(members);
            let fused = BBox::new([x_min, y_min, x_max.max(x_min), y_max.max(y_min)]).unwrap();
            let iou = candidates[index].bbox.iou(&fused);
            // The tolerance covers the last digits, in which the two ways of averaging differ.
            if iou >= parameters.iou_threshold && iou > best.map_or(0.0, |(_, iou)| iou + 1e-9) {
                best = Some((number, iou));
            }
        }
        match best {
            Some((number, _)) => clusters[number].push(index),
            None => clusters.push(vec![index]),
        }
    }
    clusters.sort_unstable();
    clusters
}

fn picks(detections: &[MergedDetection]) -> Vec<(usize, f64)> {
    detections
        .iter()
        .map(|detection| (detection.members[0], detection.score))
        .collect()
}

proptest! {
    #[test]
    fn iou_is_symmetric_and_between_0_and_1(a in candidate(), b in candidate()) {
        let iou = a.bbox.iou(&b.bbox);
        prop_assert!((0.0..=1.0).contains(&iou));
        prop_assert_eq!(iou.to_bits(), b.bbox.iou(&a.bbox).to_bits());
    }

    #[test]
    fn the_fast_nms_family_equals_the_plain_one_to_the_last_bit(
        candidates in candidates(),
        parameters in parameters(nms_family()),
    ) {
        let expected = reference(&candidates, &parameters);
        prop_assert_eq!(picks(&refine(&candidates, &parameters)), expected);
    }

    #[test]
    fn dropping_low_scores_first_changes_nothing_in_the_nms_family(
        candidates in candidates(),
        parameters in parameters(nms_family()),
    ) {
        let everything = RefinementParameters { score_threshold: 0.0, max_detections: 1000, ..parameters };
        let mut filtered_afterwards = refine(&candidates, &everything);
        filtered_afterwards.retain(|detection| detection.score >= parameters.score_threshold);
        filtered_afterwards.truncate(parameters.max_detections);
        prop_assert_eq!(refine(&candidates, &parameters), filtered_afterwards);
    }

    #[test]
    fn the_nms_family_ignores_candidates_below_the_threshold(
        candidates in candidates(),
        parameters in parameters(nms_family()),
    ) {
        let (offered, numbers): (Vec<Candidate>, Vec<usize>) = (candidates.iter().copied())
            .zip(0..)
            .filter(|(candidate, _)| candidate.score >= parameters.score_threshold)
            .unzip();
        let found: Vec<_> = picks(&refine(&offered, &parameters)).into_iter()
            .map(|(member, score)| (numbers[member], score))
            .collect();
        prop_assert_eq!(found, picks(&refine(&candidates, &parameters)));
    }

    #[test]
    fn fast_fusion_forms_the_same_clusters_as_the_plain_one(
        candidates in distinct_candidates(),
        // Avoids the values that IoUs of lattice boxes take, where rounding would decide.
        iou_threshold in prop::sample::select(vec![0.2013, 0.4007, 0.6011]),
    ) {
        let parameters = RefinementParameters {
            refinement: Refinement::Fusion,
            iou_threshold,
            sigma: 0.3,
            score_threshold: 0.0,
            max_detections: 1000,
        };
        let mut clusters: Vec<Vec<usize>> = refine(&candidates, &parameters)
            .into_iter()
            .map(|detection| detection.members)
            .collect();
        clusters.sort_unstable();
        prop_assert_eq!(clusters, fusion_reference(&candidates, &parameters));
    }

    #[test]
    fn fused_boxes_lie_within_the_hull_of_their_members(
        candidates in candidates(),
        parameters in parameters(Just(Refinement::Fusion)),
    ) {
        for detection in refine(&candidates, &parameters) {
            let members = || detection.members.iter().map(|index| candidates[*index].bbox);
            let left = members().map(|bbox| bbox.corners()[0]).fold(f64::INFINITY, f64::min);
            let right = members().map(|bbox| bbox.corners()[2]).fold(f64::NEG_INFINITY, f64::max);
            prop_assert!(detection.bbox.corners()[0] >= left - 1e-9);
            prop_assert!(detection.bbox.corners()[2] <= right + 1e-9);
        }
    }

    #[test]
    fn the_order_of_candidates_does_not_matter_when_scores_differ(
        (candidates, shuffled) in distinct_candidates()
            .prop_flat_map(|candidates| (Just(candidates.clone()), Just(candidates).prop_shuffle())),
        parameters in parameters(any_refinement()),
    ) {
        let boxes = |detections: Vec<MergedDetection>| -> Vec<_> {
            detections.into_iter().map(|detection| (detection.bbox, detection.score)).collect()
        };
        let mut original = boxes(refine(&candidates, &parameters));
        let mut other = boxes(refine(&shuffled, &parameters));
        // Rescored scores may be equal. Then the order decides which detection is cut off.
        if original.len() < parameters.max_detections {
            let by_score_and_place = |a: &(BBox<_>, f64), b: &(BBox<_>, f64)| {
                b.1.total_cmp(&a.1).then(a.0.corners()[0].total_cmp(&b.0.corners()[0]))
                    .then(a.0.corners()[1].total_cmp(&b.0.corners()[1]))
                    .then(a.0.corners()[2].total_cmp(&b.0.corners()[2]))
                    .then(a.0.corners()[3].total_cmp(&b.0.corners()[3]))
            };
            original.sort_by(by_score_and_place);
            other.sort_by(by_score_and_place);
            prop_assert_eq!(original, other);
        } else {
            prop_assert_eq!(original.len(), other.len());
        }
    }

    #[test]
    fn hard_nms_of_its_own_result_changes_nothing(
        candidates in candidates(),
        parameters in parameters(Just(Refinement::Nms)),
    ) {
        let once = refine(&candidates, &parameters);
        let survivors: Vec<Candidate> = once.iter().map(|kept| candidates[kept.members[0]]).collect();
        let twice: Vec<usize> = picks(&refine(&survivors, &parameters)).iter().map(|pick| pick.0).collect();
        prop_assert_eq!(twice, (0..survivors.len()).collect::<Vec<_>>());
    }

    #[test]
    fn the_best_candidate_stays_first_in_the_nms_family(
        candidates in distinct_candidates(),
        refinement in nms_family(),
        iou_threshold in 0.0..=1.0,
    ) {
        let parameters = RefinementParameters {
            refinement,
            iou_threshold,
            sigma: 0.3,
            score_threshold: 0.0,
            max_detections: 1000,
        };
        let best = (0..candidates.len())
            .max_by(|a, b| candidates[*a].score.total_cmp(&candidates[*b].score));
        let first = refine(&candidates, &parameters).first().map(|kept| kept.members[0]);
        prop_assert_eq!(first, best);
    }

    #[test]
    fn results_are_sorted_and_never_exceed_their_best_member(
        candidates in candidates(),
        parameters in parameters(any_refinement()),
    ) {
        let detections = refine(&candidates, &parameters);
        prop_assert!(detections.len() <= parameters.max_detections);
        prop_assert!(detections.is_sorted_by(|a, b| a.score >= b.score));
        for detection in &detections {
            prop_assert!(detection.score >= parameters.score_threshold);
            prop_assert!(detection.score <= candidates[detection.members[0]].score);
            prop_assert!(detection.members.is_sorted_by(|a, b| candidates[*a].score >= candidates[*b].score));
        }
    }

    #[test]
    fn invalid_candidates_give_no_invalid_detections(
        mut candidates in prop::collection::vec(candidate(), 1..20),
        spoiled in prop::collection::vec((0..20_usize, 0..3, any::<f64>()), 0..20),
        parameters in parameters(any_refinement()),
    ) {
        let count = candidates.len();
        for (index, field, value) in spoiled {
            let candidate = &mut candidates[index % count];
            match field {
                0 => candidate.score = value,
                1 => candidate.coordinate_weight = value,
                _ => candidate.expected_views = value,
            }
        }
        for detection in refine(&candidates, &parameters) {
            prop_assert!(detection.score > 0.0 && detection.score <= 1.0, "{}", detection.score);
            prop_assert!(BBox::<super::FramePixels>::new(detection.bbox.corners()).is_ok());
        }
    }

    #[test]
    fn names_of_refinements_parse_back(refinement in any_refinement()) {
        prop_assert_eq!(refinement.to_string().parse(), Ok(refinement));
    }
}
