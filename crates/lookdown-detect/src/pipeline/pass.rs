//! One pass over a frame: the views of a rig and the detections in each of them.

use std::sync::{Arc, OnceLock};

use lookdown_lens::geometry::{BackProjection, Footprint, Posture};
use nalgebra::Vector2;

use super::camera_rig::CameraRig;
use crate::{
    detection::{BBox, Candidate},
    inference::{Model, ViewDetection},
};

/// The weight of the coordinates of a cut-off box when boxes are averaged.
const BORDER_WEIGHT: f64 = 0.1;

/// One pass over a frame. All passes over a frame share its camera.
pub(super) struct Pass {
    /// The views.
    pub(super) rig: Arc<CameraRig>,
    /// The model that processed the views.
    pub(super) model: Arc<Model>,
    /// The detections in each view. Empty if the network was not run, as of views while persons are
    /// followed.
    pub(super) per_view: Vec<Vec<ViewDetection>>,
    /// The number of views in the passes before.
    first_vote: usize,
    mapped: OnceLock<Vec<Mapped>>,
}

impl Pass {
    /// Returns the pass after `before` with these detections in each view of `rig`.
    pub(super) fn new(
        before: &[Self],
        rig: Arc<CameraRig>,
        model: Arc<Model>,
        per_view: Vec<Vec<ViewDetection>>,
    ) -> Self {
        Self {
            first_vote: before.iter().map(|pass| pass.per_view.len()).sum(),
            rig,
            model,
            per_view,
            mapped: OnceLock::new(),
        }
    }

    /// Returns the boxes of the views, mapped to the frame at the first call by the back projection
    /// of the profile.
    pub(super) fn mapped(&self, back_projection: BackProjection) -> &[Mapped] {
        self.mapped.get_or_init(|| {
            let mut mapped = Vec::with_capacity(self.per_view.iter().map(Vec::len).sum());
            for (view, found) in self.per_view.iter().enumerate() {
                let of_view = found.iter();
                mapped.extend(of_view.filter_map(|one| self.map(view, one, back_projection)));
            }
            mapped
        })
    }

    fn map(
        &self,
        view: usize,
        found: &ViewDetection,
        back_projection: BackProjection,
    ) -> Option<Mapped> {
        let footprint = self.rig.footprint(view, &found.bbox, back_projection)?;
        let cut_off = self.rig.cuts_off(view, &found.bbox, &self.model.input);
        let posture = found.posture;
        let candidate = Candidate {
            bbox: BBox::new(footprint.bounds()).ok()?,
            score: found.score,
            view: self.first_vote + self.rig.voter(view),
            coordinate_weight: if cut_off { BORDER_WEIGHT } else { 1.0 },
            expected_views: 1.0,
        };
        Some(Mapped {
            candidate,
            footprint,
            cut_off,
            is_exact: self.rig.is_exact(),
            posture,
            widths: posture.and_then(|_| self.rig.widths(view, &found.bbox)),
        })
    }

    /// Returns true if the views are upright crops of the frame.
    pub(super) fn is_of_crops(&self) -> bool {
        self.rig.crops().next().is_some()
    }

    /// Returns true if the views vote on who is on the floor.
    pub(super) fn tells_postures(&self) -> bool {
        self.model.tells_postures && !self.per_view.is_empty()
    }
}

/// A box of a view, with its footprint in the frame.
pub(super) struct Mapped {
    /// The bounds of the footprint, with the number of the view's vote, unique over all passes.
    pub(super) candidate: Candidate,
    pub(super) footprint: Footprint,
    pub(super) cut_off: bool,
    /// True for a box from a crop of the frame.
    pub(super) is_exact: bool,
    /// The posture of a person on the floor, if the score is that of such a person.
    pub(super) posture: Option<Posture>,
    /// The vectors across the box's sides in the frame, if it tells the posture.
    pub(super) widths: Option<[Vector2<f64>; 2]>,
}

/// Returns the number of votes of views in which a person with this footprint is wholly visible:
/// over all passes, or over those that tell postures.
pub(super) fn views_holding(passes: &[Pass], footprint: &Footprint, of_postures: bool) -> usize {
    let voting = passes
        .iter()
        .filter(|pass| !of_postures || pass.tells_postures());
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
        let model = Arc::new(Model::new(Box::new(BlobDetector::default())));
        let pass = Pass::new(&[], Arc::new(rig), model, per_view);
        let mapped = pass.mapped(BackProjection::TiltedEllipse);
        let votes: Vec<_> = mapped.iter().map(|one| one.candidate.view).collect();
        assert_eq!(votes, [0, 1]);
    }
}
