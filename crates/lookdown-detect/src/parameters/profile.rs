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
    PartialOrd,
    Ord,
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
    /// Eight wide views, up to eight narrow ones at the rim where the wide ones show a possible
    /// person, up to 12 upright crops of the frame, and one of its part below the camera; by models
    /// in INT8 where the CPU has instructions for them.
    #[default]
    Balanced,
    /// The views and crops of [`Balanced`](Self::Balanced), and a mirrored copy of each crop, which
    /// places boxes better.
    Quality,
    /// No views: the detector on the fisheye frame itself (the paper's "Omni" row).
    Direct,
}

impl Profile {
    /// Returns the name, as in requests and reports.
    pub fn name(self) -> &'static str {
        self.into()
    }

    /// Returns the view plan; `None` for [`Profile::Direct`].
    pub fn view_plan(self) -> Option<ViewPlan> {
        match self {
            Self::Paper => Some(ViewPlan::paper(FieldOfViewReading::default())),
            Self::Fast => Some(ViewPlan::fast()),
            Self::Balanced | Self::Quality => Some(ViewPlan::balanced()),
            Self::Direct => None,
        }
    }

    /// Returns true if a pass through upright crops follows the views of the plan.
    pub fn has_crops(self) -> bool {
        self.max_crops() > 0
    }

    /// Returns the maximum number of upright crops around possible persons, 0 without such crops.
    pub(crate) fn max_crops(self) -> usize {
        match self {
            Self::Fast => 5,
            Self::Balanced | Self::Quality => 12,
            Self::Paper | Self::Direct => 0,
        }
    }

    /// Returns true if a crop shows what is below the camera, where the views of the plan cut
    /// people off.
    pub(crate) fn has_nadir_crop(self) -> bool {
        matches!(self, Self::Balanced | Self::Quality)
    }

    /// Returns true if each crop has a mirrored copy, which shares its vote.
    pub(crate) fn mirrors_crops(self) -> bool {
        self == Self::Quality
    }

    /// Returns the maximum number of inputs of the network in the pass through upright crops.
    pub(crate) fn max_crop_inputs(self) -> usize {
        let crops = self.max_crops() + usize::from(self.has_nadir_crop());
        crops * (1 + usize::from(self.mirrors_crops()))
    }

    /// Returns the method that projects boxes back to the frame.
    pub fn back_projection(self) -> BackProjection {
        match self {
            Self::Paper => BackProjection::CornerHull,
            _ => BackProjection::TiltedEllipse,
        }
    }

    /// Returns the constants for the default models.
    pub fn tuning(self) -> Tuning {
        let (even_odds, crop_vote) = match self {
            Self::Fast => (0.26, 1.0),
            Self::Balanced | Self::Quality => (0.26, 0.7),
            Self::Paper | Self::Direct => (0.25, 1.0),
        };
        Tuning {
            even_odds,
            odds_power: 3.0,
            crop_fill: 0.3,
            crop_vote,
        }
    }

    /// Returns the refinement for requests without one.
    pub fn default_refinement(self) -> Refinement {
        match self {
            Self::Paper => Refinement::SoftNmsGaussian,
            Self::Direct => Refinement::Nms,
            Self::Fast | Self::Balanced | Self::Quality => Refinement::Fusion,
        }
    }
}

/// The constants of a profile that fit it to our own networks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tuning {
    /// The score merged by fusion at which a person is as likely as not, above 0 and below 1.
    /// `docs/lab/results.md` has the error of the number of persons with the profiles' own values.
    pub even_odds: f64,
    /// The power of the odds of a merged score, relative to those of `even_odds`, 0.1 to 20. One
    /// value serves all profiles with their own models, on photographs and on rendered frames.
    pub odds_power: f64,
    /// The share of a crop's side that the larger side of a person's box fills, 0.05 to 0.9.
    pub crop_fill: f64,
    /// The factor for scores from crops, in which persons lean by up to 45° and more, above 0 and
    /// at most 1. Where many upright views see a person, they give better scores, and crops give
    /// better extents.
    pub crop_vote: f64,
}
