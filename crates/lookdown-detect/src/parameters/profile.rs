//! Profiles: named trade-offs between cost and accuracy.

use lookdown_lens::geometry::{BackProjection, FieldOfViewReading, ViewPlan};
use strum::{Display, EnumString, IntoStaticStr, VariantArray};

use crate::detection::Refinement;

/// A profile: the views, models and refinement used for a frame.
#[derive(
    Debug,
    Clone,
    Copy,
    PartialEq,
    Eq,
    Hash,
    Default,
    serde::Serialize,
    serde::Deserialize,
    Display,
    EnumString,
    IntoStaticStr,
    VariantArray,
    strum::VariantNames,
)]
#[serde(rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
pub enum Profile {
    /// The paper's 128 views with corner back-projection and Soft-NMS.
    Paper,
    /// Five wide views and up to 5 upright crops of the frame; on a CPU by a model in INT8.
    Fast,
    /// 18 views, wide around the nadir and narrow at the rim, and up to 12 upright crops of the
    /// frame; by models in INT8 where the CPU has instructions for them.
    #[default]
    Balanced,
    /// 24 views and up to 16 upright crops of the frame; by models in INT8 where the CPU has
    /// instructions for them.
    Quality,
    /// No views: the detector on the fisheye frame itself (the paper's "Omni" row).
    Direct,
}

impl Profile {
    /// Returns the name, as in requests and reports.
    #[must_use]
    pub fn name(self) -> &'static str {
        self.into()
    }

    /// Returns the view plan; `None` for [`Profile::Direct`].
    #[must_use]
    pub fn view_plan(self) -> Option<ViewPlan> {
        match self {
            Self::Paper => Some(ViewPlan::paper(FieldOfViewReading::default())),
            Self::Fast => Some(ViewPlan::fast()),
            Self::Balanced => Some(ViewPlan::balanced()),
            Self::Quality => Some(ViewPlan::quality()),
            Self::Direct => None,
        }
    }

    /// Returns the pass through upright crops that follows the views of the plan, if any.
    pub(crate) fn crop_pass(self) -> Option<CropPass> {
        let (max_crops, vote) = match self {
            Self::Fast => (5, 1.0),
            Self::Balanced => (12, 0.7),
            Self::Quality => (16, 0.7),
            Self::Paper | Self::Direct => return None,
        };
        Some(CropPass {
            max_crops,
            fill: 0.3,
            vote,
        })
    }

    /// Returns the maximum number of network inputs of the passes after the views of the plan.
    pub(crate) fn max_second_pass_views(self) -> usize {
        self.crop_pass().map_or(0, |crops| crops.max_crops)
    }

    /// Returns the method that projects boxes back to the frame.
    #[must_use]
    pub fn back_projection(self) -> BackProjection {
        match self {
            Self::Paper => BackProjection::CornerHull,
            _ => BackProjection::TiltedEllipse,
        }
    }

    /// Returns the score at which a person merged by fusion is as likely as not. `docs/lab/results.md`
    /// has the error of the number of persons and of the probabilities with these values.
    pub(crate) fn even_odds_score(self) -> f64 {
        match self {
            Self::Fast | Self::Quality => 0.26,
            Self::Balanced | Self::Paper | Self::Direct => 0.25,
        }
    }

    /// Returns the refinement for requests without one.
    #[must_use]
    pub fn default_refinement(self) -> Refinement {
        match self {
            Self::Paper => Refinement::SoftNmsGaussian,
            Self::Direct => Refinement::Nms,
            Self::Fast | Self::Balanced | Self::Quality => Refinement::Fusion,
        }
    }
}

/// A second pass through upright crops of the frame around possible persons.
pub(crate) struct CropPass {
    /// The maximum number of crops.
    pub(crate) max_crops: usize,
    /// The share of a crop's side that the larger side of a person's box fills.
    pub(crate) fill: f64,
    /// The factor for scores from crops, in which persons lean by up to 45° and more. Where many
    /// upright views see a person, they give better scores, and crops give better extents.
    pub(crate) vote: f64,
}
