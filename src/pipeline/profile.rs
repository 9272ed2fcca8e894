//! Profiles: named trade-offs between cost and accuracy.

use crate::{
    detection::Refinement,
    geometry::{BackProjection, FieldOfViewReading, ViewPlan},
};

/// What a frame is looked at with.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, Hash, Default, serde::Serialize, serde::Deserialize,
)]
#[serde(rename_all = "snake_case")]
pub enum Profile {
    /// The paper's 128 views with corner back-projection and Soft-NMS.
    Paper,
    /// 13 wide views.
    Fast,
    /// 24 views, wide near the nadir and narrow at the rim.
    #[default]
    Balanced,
    /// 56 views with more overlap at every distance.
    Quality,
    /// No views: the detector on the fisheye frame itself (the paper's "Omni" row).
    Direct,
}

impl Profile {
    /// Every profile, cheapest last but one: the order in which they are listed to users.
    pub const ALL: [Self; 5] = [
        Self::Paper,
        Self::Fast,
        Self::Balanced,
        Self::Quality,
        Self::Direct,
    ];

    /// The name, as in requests and reports.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Paper => "paper",
            Self::Fast => "fast",
            Self::Balanced => "balanced",
            Self::Quality => "quality",
            Self::Direct => "direct",
        }
    }

    /// The profile of that name.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|profile| profile.name() == name)
    }

    /// The view plan; `None` for [`Profile::Direct`]. `paper_reading` says how the paper's field
    /// of view is read.
    #[must_use]
    pub fn view_plan(self, paper_reading: FieldOfViewReading) -> Option<ViewPlan> {
        match self {
            Self::Paper => Some(ViewPlan::paper(paper_reading)),
            Self::Fast => Some(ViewPlan::thirteen_wide()),
            Self::Balanced => Some(ViewPlan::balanced()),
            Self::Quality => Some(ViewPlan::quality()),
            Self::Direct => None,
        }
    }

    /// How boxes are taken back to the frame.
    #[must_use]
    pub fn back_projection(self) -> BackProjection {
        match self {
            Self::Paper => BackProjection::CornerHull,
            _ => BackProjection::TiltedEllipse,
        }
    }

    /// The refinement used when a request names none.
    #[must_use]
    pub fn default_refinement(self) -> Refinement {
        match self {
            Self::Paper => Refinement::SoftNmsGaussian,
            Self::Direct => Refinement::Nms,
            Self::Fast | Self::Balanced | Self::Quality => Refinement::Fusion,
        }
    }
}
