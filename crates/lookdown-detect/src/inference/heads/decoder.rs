//! The interface of all heads, and the collection of the persons of a batch.

use lookdown_lens::geometry::Posture;

use super::{
    score::{Floor, Score},
    shape::{Batch, Output, TensorView},
};
use crate::{
    detection::{BBox, BBoxError, ViewPixels},
    inference::{HeadOutput, ViewDetection},
};

/// The outputs that a head reads, or a sentence about those that it cannot read.
pub(super) type Selected<'o> = Result<Vec<&'o Output<'o>>, String>;

/// Interface of all heads. `batch.views` is known in a run only.
pub(super) trait Decoder {
    /// Selects the outputs that are decoded, and checks their shapes.
    fn select<'o>(&self, outputs: &'o [Output<'o>], batch: &Batch) -> Selected<'o>;

    /// Passes every candidate of the selected outputs to `collector`.
    fn decode(&self, tensors: &[&TensorView<'_>], collector: &mut CandidateCollector);
}

/// Collects persons and counts the dropped candidates.
pub(super) struct CandidateCollector {
    pub(super) batch: Batch,
    /// Least score of a person.
    pub(super) floor: Floor,
    /// The whole view. `None` for inputs too large to have boxes.
    bounds: Option<BBox<ViewPixels>>,
    output: HeadOutput,
    not_a_probability: Option<f32>,
}

impl CandidateCollector {
    pub(super) fn new(batch: Batch, floor: f64) -> Self {
        let [width, height] = [batch.width, batch.height].map(f64::from);
        Self {
            batch,
            floor: Floor::new(floor),
            bounds: BBox::new([0.0, 0.0, width, height]).ok(),
            output: HeadOutput {
                per_view: vec![Vec::new(); batch.views.unwrap_or(0)],
                non_finite: 0,
            },
            not_a_probability: None,
        }
    }

    /// Adds a candidate of the view with the number `view`. Its corners (`x_min, y_min, x_max,
    /// y_max`, view pixels) are computed only if its score is kept.
    pub(super) fn offer(&mut self, view: usize, score: Score, corners: impl FnOnce() -> [f64; 4]) {
        if let Some(score) = self.judge(score) {
            self.add(view, score, None, corners());
        }
    }

    /// Returns the score if it is kept. Counts it if it is not finite.
    pub(super) fn judge(&mut self, score: Score) -> Option<f64> {
        match score {
            Score::Kept(score) => return Some(score),
            Score::Below => {}
            Score::NotFinite => self.count_non_finite(),
            Score::NotAProbability(raw) => self.not_a_probability = Some(raw),
        }
        None
    }

    /// Adds a candidate whose score is kept. Boxes without area in the view are dropped.
    pub(super) fn add(
        &mut self,
        view: usize,
        score: f64,
        posture: Option<Posture>,
        corners: [f64; 4],
    ) {
        let bbox = match BBox::new(corners) {
            Ok(bbox) => bbox,
            Err(BBoxError::Coordinate(_)) => return self.count_non_finite(),
            Err(BBoxError::Inverted(_)) => return,
        };
        let clipped = self.bounds.and_then(|bounds| bbox.clipped_to(&bounds));
        if let (Some(bbox), Some(found)) = (clipped, self.output.per_view.get_mut(view)) {
            found.push(ViewDetection {
                bbox,
                score,
                posture,
            });
        }
    }

    pub(super) fn count_non_finite(&mut self) {
        self.output.non_finite += 1;
    }

    pub(super) fn finish(self) -> Result<HeadOutput, String> {
        match self.not_a_probability {
            None => Ok(self.output),
            Some(raw) => Err(format!(
                "its scores hold {raw} where 0 to 1 is needed; if they are logits, declare it with \
                 `score_activation` in the manifest's [output]"
            )),
        }
    }
}

/// The corners of a box around `(x, y)`.
pub(super) fn corners_around([x, y]: [f64; 2], [width, height]: [f64; 2]) -> [f64; 4] {
    let (x_reach, y_reach) = (width / 2.0, height / 2.0);
    [x - x_reach, y - y_reach, x + x_reach, y + y_reach]
}

/// The first four values of a candidate as `f64`.
pub(super) fn four(values: &[f32]) -> [f64; 4] {
    [0, 1, 2, 3].map(|index| f64::from(values[index]))
}
