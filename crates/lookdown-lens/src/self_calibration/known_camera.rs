//! The values of a camera that the user knows before a fit.

use std::str::FromStr;

use crate::geometry::lens::{Equidistant, Equisolid, LensModel, Orthographic, Stereographic};

/// The values of a camera that the user knows. A fit keeps them.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct KnownCamera {
    /// The projection of the lens.
    pub lens: Option<IdealLens>,
    /// The field of view of the lens circle.
    pub field_of_view: Option<FieldOfView>,
    /// True for a camera on a ceiling. If false, a camera that may be on a wall is refused.
    pub is_on_ceiling: bool,
}

/// Lenses with one parameter, the focal length `f`.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, strum::Display, strum::EnumString, strum::VariantNames,
)]
#[strum(serialize_all = "snake_case")]
pub enum IdealLens {
    /// `r = f theta`.
    Equidistant,
    /// `r = 2 f sin(theta / 2)`.
    Equisolid,
    /// `r = 2 f tan(theta / 2)`.
    Stereographic,
    /// `r = f sin(theta)`.
    Orthographic,
}

impl IdealLens {
    /// Returns the lens with a focal length and a center in pixels, up to an angle in radians.
    pub fn with(self, focal: f64, cx: f64, cy: f64, max_theta: f64) -> LensModel {
        match self {
            Self::Equidistant => Equidistant::with_focal(focal, cx, cy, max_theta).into(),
            Self::Equisolid => Equisolid::with_focal(focal, cx, cy, max_theta).into(),
            Self::Stereographic => Stereographic::with_focal(focal, cx, cy, max_theta).into(),
            Self::Orthographic => Orthographic::with_focal(focal, cx, cy, max_theta).into(),
        }
    }

    /// The first coefficient of the odd polynomial: the second term of the Taylor series of
    /// `r / f`.
    pub(super) fn k1(self) -> f64 {
        match self {
            Self::Equidistant => 0.0,
            Self::Equisolid => -1.0 / 24.0,
            Self::Stereographic => 1.0 / 12.0,
            Self::Orthographic => -1.0 / 6.0,
        }
    }
}

/// The field of view of a lens circle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FieldOfView {
    degrees: f64,
}

/// A field of view that no lens circle has.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error(
    "give {} to {} degrees",
    FieldOfView::MIN_DEGREES,
    FieldOfView::MAX_DEGREES
)]
pub struct FieldOfViewError;

impl FieldOfView {
    /// The smallest field of view of a fisheye.
    pub const MIN_DEGREES: f64 = 60.0;
    /// The largest one.
    pub const MAX_DEGREES: f64 = 300.0;
    /// Half a sphere, as many data sheets say.
    pub const HEMISPHERE: Self = Self { degrees: 180.0 };

    /// Checks a field of view in degrees.
    ///
    /// # Errors
    /// [`FieldOfViewError`] below [`Self::MIN_DEGREES`] and above [`Self::MAX_DEGREES`].
    pub fn from_degrees(degrees: f64) -> Result<Self, FieldOfViewError> {
        let is_plausible = (Self::MIN_DEGREES..=Self::MAX_DEGREES).contains(&degrees);
        is_plausible
            .then_some(Self { degrees })
            .ok_or(FieldOfViewError)
    }

    /// Returns the field of view in degrees.
    pub fn degrees(self) -> f64 {
        self.degrees
    }

    /// Returns the angle between the axis and the circle, radians.
    pub fn max_theta(self) -> f64 {
        self.degrees.to_radians() / 2.0
    }
}

impl FromStr for FieldOfView {
    type Err = FieldOfViewError;

    /// Parses degrees.
    fn from_str(text: &str) -> Result<Self, FieldOfViewError> {
        Self::from_degrees(text.parse().map_err(|_| FieldOfViewError)?)
    }
}
