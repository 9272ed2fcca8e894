//! SSD.

mod anchors;

use serde::Deserialize;

use super::{
    Decoder,
    candidate_collector::{CandidateCollector, corners_around, four},
    outputs::boxes_and_scores,
    score::ClassActivation,
    shape::{Axis, Batch, check_positive},
    tensor::{Output, OutputShape, TensorView},
};

pub use anchors::AnchorGenerator;

/// SSD with the box coder of Faster R-CNN: encodings `[views, anchors, 4]`
/// (`t_y, t_x, t_h, t_w`) and class scores `[views, anchors, classes]`.
///
/// For an anchor `(c_y, c_x, h, w)` and scale factors `(s_y, s_x, s_h, s_w)`, the box has the
/// centre `(c_x + w t_x / s_x, c_y + h t_y / s_y)` and the size `(w e^(t_w / s_w), h e^(t_h /
/// s_h))`.
///
/// Sources: Liu et al., "SSD: Single Shot `MultiBox` Detector", 2016, section 2.2; Ren et al.,
/// "Faster R-CNN", 2015, equation 2; `faster_rcnn_box_coder.py` of the TensorFlow object
/// detection API.
///
/// ```toml
/// [output]
/// head = "ssd"
/// person_class = 1               # TensorFlow's COCO classes, 0 is the background
/// score_activation = "sigmoid"   # default; or "softmax", "none"
/// scale_factors = [10.0, 10.0, 5.0, 5.0]   # default
/// # boxes = "…", scores = "…"    # if the shapes are ambiguous
/// # anchors = [[c_y, c_x, h, w], …]        # as shares of the view, or:
/// # [output.anchor_generator] …            # see its defaults
/// ```
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SsdHead {
    /// Index of the person among the classes.
    pub person_class: u16,
    /// Activation applied to the class scores.
    #[serde(default)]
    pub score_activation: ClassActivation,
    /// Divisors of `t_y, t_x, t_h, t_w`.
    #[serde(default = "default_scale_factors")]
    pub scale_factors: [f64; 4],
    /// The output with the encodings. Default: the one whose last axis is 4.
    #[serde(default)]
    pub boxes: Option<String>,
    /// The output with the class scores. Default: the other one with three axes.
    #[serde(default)]
    pub scores: Option<String>,
    /// The anchors as `c_y, c_x, h, w`, each as a share of the view. Excludes `anchor_generator`.
    #[serde(default)]
    pub anchors: Option<Vec<[f64; 4]>>,
    /// Parameters of the anchor generation if `anchors` is not given.
    #[serde(default)]
    pub anchor_generator: Option<AnchorGenerator>,
}

fn default_scale_factors() -> [f64; 4] {
    [10.0, 10.0, 5.0, 5.0]
}

impl SsdHead {
    /// The anchors in pixels.
    fn pixel_anchors(&self, batch: &Batch) -> Result<Vec<[f64; 4]>, String> {
        let [width, height] = [batch.width, batch.height].map(f64::from);
        match (&self.anchors, &self.anchor_generator) {
            (Some(_), Some(_)) => Err(
                "the manifest's [output] has both `anchors` and `anchor_generator`; remove one"
                    .to_owned(),
            ),
            (Some(anchors), None) => Ok(anchors
                .iter()
                .map(|&[c_y, c_x, h, w]| [c_y * height, c_x * width, h * height, w * width])
                .collect()),
            (None, Some(generator)) => generator.generate(batch),
            (None, None) => AnchorGenerator::default().generate(batch),
        }
    }

    fn select<'o, T: Output>(
        &self,
        outputs: &'o [T],
        anchors: usize,
        batch: &Batch,
    ) -> Result<[&'o T; 2], String> {
        check_positive("scale_factors", &self.scale_factors)?;
        let names = [self.boxes.as_deref(), self.scores.as_deref()];
        let [boxes, scores] = boxes_and_scores(outputs, names)?;
        let classes = Axis::AtLeast(usize::from(self.person_class) + 1, "classes");
        let anchors = Axis::Exactly(anchors);
        batch.require(&[
            (boxes, &[Axis::Views, anchors, Axis::Exactly(4)]),
            (scores, &[Axis::Views, anchors, classes]),
        ])?;
        Ok([boxes, scores])
    }

    fn corners(&self, encoding: &[f32], [c_y, c_x, h, w]: [f64; 4]) -> [f64; 4] {
        let [t_y, t_x, t_h, t_w] = four(encoding);
        let [s_y, s_x, s_h, s_w] = self.scale_factors;
        let center = [c_x + w * t_x / s_x, c_y + h * t_y / s_y];
        corners_around(center, [w * (t_w / s_w).exp(), h * (t_h / s_h).exp()])
    }
}

impl Decoder for SsdHead {
    fn check(&self, outputs: &[OutputShape<'_>], batch: &Batch) -> Result<(), String> {
        let anchors = self.pixel_anchors(batch)?.len();
        self.select(outputs, anchors, batch).map(drop)
    }

    fn decode(
        &self,
        outputs: &[TensorView<'_>],
        batch: &Batch,
        finds: &mut CandidateCollector,
    ) -> Result<(), String> {
        let anchors = self.pixel_anchors(batch)?;
        let [boxes, scores] = self.select(outputs, anchors.len(), batch)?;
        let person = usize::from(self.person_class);
        let classes = scores.shape[2];
        for (view, (boxes, scores)) in boxes.views().zip(scores.views()).enumerate() {
            let candidates = boxes.chunks_exact(4).zip(scores.chunks_exact(classes));
            for ((encoding, scores), &anchor) in candidates.zip(&anchors) {
                let score = self.score_activation.score(scores, person, finds.floor);
                finds.offer(view, score, || self.corners(encoding, anchor));
            }
        }
        Ok(())
    }
}
