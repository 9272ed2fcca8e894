//! One pass over a frame: the views of a rig and the detections in each of them.

use std::sync::Arc;

use lookdown_lens::geometry::Footprint;

use super::camera_rig::CameraRig;
use crate::inference::{Model, ViewDetection};

/// One pass over a frame. All passes over a frame share its camera.
pub(super) struct Pass {
    /// The views.
    pub(super) rig: Arc<CameraRig>,
    /// The model that processed the views.
    pub(super) model: Arc<Model>,
    /// The detections in each view.
    pub(super) per_view: Vec<Vec<ViewDetection>>,
    /// True if the model finds people on the floor alone. Its views vote on no one else.
    pub(super) is_of_floor: bool,
}

impl Pass {
    /// Returns true if the views are upright crops of the frame.
    pub(super) fn is_of_crops(&self) -> bool {
        self.rig.crops().next().is_some()
    }
}

/// A detection in one view of a pass.
#[derive(Clone, Copy)]
pub(super) struct PassDetection<'a> {
    pub(super) pass: &'a Pass,
    /// The index of the view in its rig.
    pub(super) view: usize,
    /// The number of the vote of the view, unique over all passes.
    pub(super) vote: usize,
    pub(super) detection: &'a ViewDetection,
}

/// Returns the detections of all passes.
pub(super) fn detections(passes: &[Pass]) -> impl Iterator<Item = PassDetection<'_>> {
    let numbered = passes.iter().scan(0, |before, pass| {
        let first = *before;
        *before += pass.per_view.len();
        Some((first, pass))
    });
    numbered.flat_map(|(first, pass)| {
        let views = pass.per_view.iter().enumerate();
        views.flat_map(move |(view, found)| {
            let vote = first + pass.rig.voter(view);
            found.iter().map(move |detection| PassDetection {
                pass,
                view,
                vote,
                detection,
            })
        })
    })
}

/// Returns the number of votes of views in which a person with this footprint is wholly visible:
/// over the passes for people on the floor, or over all others.
pub(super) fn views_holding(passes: &[Pass], footprint: &Footprint, of_floor: bool) -> usize {
    let voting = passes.iter().filter(|pass| pass.is_of_floor == of_floor);
    voting.map(|pass| pass.rig.views_holding(footprint)).sum()
}

#[cfg(test)]
mod tests {
    use lookdown_calibration::{Areas, CameraGeometry};
    use lookdown_lens::geometry::{FrameCrop, Lens, Mount, Pixel, QuarterTurn};

    use super::*;
    use crate::{detection::BBox, pipeline::test_support::BlobDetector};

    #[test]
    fn each_tile_of_a_mosaic_has_a_vote_of_its_own() {
        let geometry = CameraGeometry {
            lens: Lens::equidistant_circle(99.5, 99.5, 100.0, 1.57).unwrap(),
            mount: Mount::default(),
            areas: Areas::default(),
        };
        let input = BlobDetector::default().input;
        let tile = |x: f64| FrameCrop {
            turn: QuarterTurn::None,
            is_mirrored: false,
            center: Pixel::new(x, 100.0),
            scale: 1.0,
            width: 48,
            height: 48,
        };
        let rig = CameraRig::new(geometry, 200, 200, None, &input);
        let rig = rig.with_crops(96, &[tile(90.0), tile(100.0)], 200, 200);
        let found = |left: f64| ViewDetection {
            bbox: BBox::new([left, 10.0, left + 20.0, 40.0]).unwrap(),
            score: 0.9,
            posture: None,
        };
        // The same person in both tiles of one input.
        let per_view = rig.per_view(vec![vec![found(20.0), found(58.0)]]);
        let pass = Pass {
            rig: Arc::new(rig),
            model: Arc::new(Model::new(Box::new(BlobDetector::default()))),
            per_view,
            is_of_floor: false,
        };
        let votes: Vec<_> = detections(&[pass]).map(|found| found.vote).collect();
        assert_eq!(votes, [0, 1]);
    }
}
