//! Fuzzes all refinements with arbitrary candidates: results are finite, in range and sorted.

use lookdown_detect::detection::{BBox, Candidate, Refinement, RefinementParameters, refine};
use strum::VariantArray;

/// The marker of an arbitrary float in the next eight bytes. Other numbers are two bytes, in
/// eighths.
const ANY_FLOAT: i16 = i16::MIN;

/// Merges the candidates that `bytes` encode; returns true if there are any.
pub fn read(bytes: &[u8]) -> bool {
    let mut numbers = Numbers(bytes);
    let parameters = RefinementParameters {
        refinement: Refinement::Nms,
        iou_threshold: numbers.next_number().clamp(0.0, 1.0),
        sigma: numbers.next_number().clamp(f64::MIN_POSITIVE, f64::MAX),
        score_threshold: numbers.next_number().clamp(0.0, 1.0),
        max_detections: usize::from(numbers.next_byte()),
    };
    if parameters.iou_threshold.is_nan()
        || parameters.sigma.is_nan()
        || parameters.score_threshold.is_nan()
    {
        return false;
    }
    let mut candidates = Vec::new();
    while !numbers.0.is_empty() {
        let corners = [(); 4].map(|()| numbers.next_number());
        if let Ok(bbox) = BBox::new(corners) {
            candidates.push(Candidate {
                bbox,
                score: numbers.next_number() / 8.0,
                view: usize::from(numbers.next_byte()),
                coordinate_weight: numbers.next_number() / 8.0,
                expected_views: numbers.next_number(),
            });
        }
    }
    for &refinement in Refinement::VARIANTS {
        let parameters = RefinementParameters {
            refinement,
            ..parameters
        };
        check(&candidates, &parameters);
    }
    !candidates.is_empty()
}

fn check(candidates: &[Candidate], parameters: &RefinementParameters) {
    let merged = refine(candidates, parameters);
    assert!(merged.len() <= parameters.max_detections);
    assert!(merged.is_sorted_by(|one, next| one.score >= next.score));
    for detection in merged {
        let score = detection.score;
        assert!(score > 0.0 && score <= 1.0 && score >= parameters.score_threshold);
        let members = || {
            detection
                .members
                .iter()
                .map(|&index| candidates[index].bbox)
        };
        assert!(members().next().is_some());
        // Means of coordinates lie within those of the members, except for rounding.
        for (axis, value) in detection.bbox.corners().into_iter().enumerate() {
            let of_members = || members().map(|bbox| bbox.corners()[axis]);
            let least = of_members().fold(f64::INFINITY, f64::min);
            let most = of_members().fold(f64::NEG_INFINITY, f64::max);
            let rounding = 1e-9 * least.abs().max(most.abs()).max(1.0);
            assert!(
                value >= least - rounding && value <= most + rounding,
                "{parameters:?}: {value} is not within {least} to {most}"
            );
        }
    }
}

/// Numbers encoded in bytes; zeros after the last.
struct Numbers<'a>(&'a [u8]);

impl Numbers<'_> {
    fn next_number(&mut self) -> f64 {
        match i16::from_le_bytes(self.next_bytes()) {
            ANY_FLOAT => f64::from_le_bytes(self.next_bytes()),
            eighths => f64::from(eighths) / 8.0,
        }
    }

    fn next_byte(&mut self) -> u8 {
        let [byte] = self.next_bytes();
        byte
    }

    fn next_bytes<const COUNT: usize>(&mut self) -> [u8; COUNT] {
        let (taken, rest) = self.0.split_at(COUNT.min(self.0.len()));
        self.0 = rest;
        let mut bytes = [0; COUNT];
        bytes[..taken.len()].copy_from_slice(taken);
        bytes
    }
}
