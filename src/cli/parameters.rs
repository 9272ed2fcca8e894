//! Request parameters as flags: the same names, checked by the same code.

use clap::Args;

use crate::pipeline::{DetectParameters, ParameterError};

/// The parameters that every detection takes, but the calibration.
#[derive(Debug, Args)]
pub(super) struct ParameterFlags {
    /// The name under which results are kept [default: the calibration's ID]
    #[arg(long, value_name = "NAME")]
    camera: Option<String>,
    /// How thoroughly to look: `paper`, `fast`, `balanced`, `quality` or `direct`
    /// [default: balanced]
    #[arg(long, value_name = "NAME")]
    profile: Option<String>,
    /// How overlapping boxes become persons: `nms`, `soft_nms_linear`, `soft_nms_gaussian` or
    /// `fusion`
    /// [default: the profile's]
    #[arg(long, value_name = "NAME")]
    refine: Option<String>,
    /// Look with this model [default: the profile's]
    #[arg(long, value_name = "NAME")]
    model: Option<String>,
    /// Leave out persons with a lower score, 0 to 1 [default: 0.3]
    #[arg(long, value_name = "SCORE", allow_hyphen_values = true)]
    score_threshold: Option<String>,
    /// Boxes that overlap at least this much are the same person, 0 to 1 [default: the
    /// refinement's]
    #[arg(long, value_name = "IOU", allow_hyphen_values = true)]
    iou_threshold: Option<String>,
    /// Width of Gaussian Soft-NMS, above 0 [default: 0.3]
    #[arg(long, value_name = "NUMBER", allow_hyphen_values = true)]
    sigma: Option<String>,
    /// Most persons in a report, best first [default: 1000]
    #[arg(long, value_name = "COUNT", allow_hyphen_values = true)]
    max_detections: Option<String>,
    /// When the picture was taken (RFC 3339)
    #[arg(long, value_name = "TIME")]
    captured_at: Option<String>,
}

impl ParameterFlags {
    /// The checked parameters.
    ///
    /// # Errors
    /// [`ParameterError`] when a value cannot be used.
    pub(super) fn check(
        &self,
        calibration: Option<&str>,
        default_score_threshold: f64,
    ) -> Result<DetectParameters, ParameterError> {
        let given = [
            ("calibration", calibration),
            ("camera", self.camera.as_deref()),
            ("profile", self.profile.as_deref()),
            ("refine", self.refine.as_deref()),
            ("model", self.model.as_deref()),
            ("score_threshold", self.score_threshold.as_deref()),
            ("iou_threshold", self.iou_threshold.as_deref()),
            ("sigma", self.sigma.as_deref()),
            ("max_detections", self.max_detections.as_deref()),
            ("captured_at", self.captured_at.as_deref()),
        ];
        let pairs = given
            .into_iter()
            .filter_map(|(name, value)| Some((name, value?)));
        DetectParameters::parse(pairs, default_score_threshold)
    }
}
