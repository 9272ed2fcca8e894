//! The pieces that every lens model is made of: [`Model`], and the macros that declare the
//! parameters of one model (`lens_parameters`) and the list of all models (`lens_models`).

use super::{ImagePlane, LensError, curve::Curve, distortion::RadialTangential, error::positive};

/// The path from the parameters in a calibration file to a checked curve.
pub(super) trait Model {
    type Curve: Curve;

    /// Returns the curve, or an error that names the first parameter outside its range.
    fn curve(&self) -> Result<Self::Curve, LensError>;

    /// Returns the distortion that follows the curve, in the normalized image plane.
    fn distortion(&self) -> Result<Option<RadialTangential>, LensError> {
        Ok(None)
    }
}

/// The default of a scale.
pub(super) fn one() -> f64 {
    1.0
}

/// Declares the struct of a model: its own parameters, and those of its image plane.
///
/// The struct has the shape of the `lens` table of native calibration files. The word after the
/// colon chooses the fields of the image plane:
/// * `Ideal`: `focal`, or `fx` and `fy`, for a curve without parameters;
/// * `Pinhole`: `fx` and `fy`;
/// * `SkewedPinhole`: `fx`, `fy` and `skew`;
/// * `Centered`: none but `cx` and `cy`; the model has a `plane` function for the rest.
macro_rules! lens_parameters {
    (
        $(#[$doc:meta])* pub struct $Model:ident: Ideal with $Curve:ident {
            limit: $limit:expr,
            radius: |$theta:ident| $radius_at:expr,
            angle: |$radius:ident| $angle_at:expr,
        }
    ) => {
        lens_parameters! {
            @struct $(#[$doc])* $Model {
                /// Focal length, pixels; stands for equal `fx` and `fy`.
                #[serde(skip_serializing_if = "Option::is_none")]
                pub focal: Option<f64>,
                /// Horizontal focal length, pixels.
                #[serde(skip_serializing_if = "Option::is_none")]
                pub fx: Option<f64>,
                /// Vertical focal length, pixels.
                #[serde(skip_serializing_if = "Option::is_none")]
                pub fy: Option<f64>,
            } {}
        }

        impl $Model {
            /// Creates the lens with these focal lengths and center.
            pub fn new([fx, fy, cx, cy]: Pinhole) -> Self {
                Self { focal: None, fx: Some(fx), fy: Some(fy), cx, cy, max_theta: None }
            }

            /// Creates the lens with one focal length (pixels) that sees up to `max_theta` radians
            /// off its axis.
            pub fn with_focal(focal: f64, cx: f64, cy: f64, max_theta: f64) -> Self {
                let max_theta = Some(max_theta);
                Self { focal: Some(focal), fx: None, fy: None, cx, cy, max_theta }
            }

            /// Returns the focal lengths and the center, unless a focal length is missing.
            pub fn pinhole(&self) -> Option<Pinhole> {
                Some([self.fx.or(self.focal)?, self.fy.or(self.focal)?, self.cx, self.cy])
            }

            pub(super) fn plane(&self) -> Result<ImagePlane, LensError> {
                let focal_lengths = (self.focal, self.fx, self.fy);
                ideal_plane(focal_lengths, self.cx, self.cy)
            }
        }

        /// The curve of the model, which has no parameters.
        #[derive(Debug, Clone, Copy, PartialEq)]
        pub struct $Curve;

        impl Model for $Model {
            type Curve = $Curve;

            fn curve(&self) -> Result<$Curve, LensError> {
                Ok($Curve)
            }
        }

        impl Curve for $Curve {
            fn limit(&self) -> f64 {
                $limit
            }

            fn radius(&self, $theta: f64) -> f64 {
                $radius_at
            }

            fn angle(&self, $radius: f64) -> f64 {
                $angle_at
            }
        }
    };
    ($(#[$doc:meta])* pub struct $Model:ident: Pinhole { $($own:tt)* }) => {
        lens_parameters! { @pinhole $(#[$doc])* $Model { $($own)* } {} {} }
    };
    ($(#[$doc:meta])* pub struct $Model:ident: SkewedPinhole { $($own:tt)* }) => {
        lens_parameters! {
            @pinhole $(#[$doc])* $Model { $($own)* } {
                /// Horizontal shift per unit of normalized `y`, pixels.
                #[serde(default)]
                pub skew: f64,
            } { skew }
        }
    };
    ($(#[$doc:meta])* pub struct $Model:ident: Centered { $($own:tt)* }) => {
        lens_parameters! { @struct $(#[$doc])* $Model { $($own)* } {} }
    };
    (
        @pinhole $(#[$doc:meta])* $Model:ident
        { $($(#[$own_doc:meta])* pub $own:ident: $Own:ty,)* } { $($after:tt)* } { $($skew:ident)? }
    ) => {
        lens_parameters! {
            @struct $(#[$doc])* $Model {
                /// Horizontal focal length, pixels.
                pub fx: f64,
                /// Vertical focal length, pixels.
                pub fy: f64,
            } {
                $($(#[$own_doc])* pub $own: $Own,)*
                $($after)*
            }
        }

        impl $Model {
            /// Creates the lens with these focal lengths, center and parameters, without skew.
            pub fn new([fx, fy, cx, cy]: Pinhole, $($own: $Own),*) -> Self {
                Self { fx, fy, cx, cy, $($own,)* $($skew: 0.0,)? max_theta: None }
            }

            /// Returns the focal lengths and the center.
            pub fn pinhole(&self) -> Pinhole {
                [self.fx, self.fy, self.cx, self.cy]
            }

            pub(super) fn plane(&self) -> Result<ImagePlane, LensError> {
                Ok(ImagePlane {
                    $($skew: self.$skew,)?
                    ..ImagePlane::new(self.fx, self.fy, self.cx, self.cy)
                })
            }
        }
    };
    (
        @struct $(#[$doc:meta])* $Model:ident { $($before:tt)* } { $($after:tt)* }
    ) => {
        $(#[$doc])*
        #[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
        #[serde(deny_unknown_fields)]
        pub struct $Model {
            $($before)*
            /// Principal point, horizontal, pixel centers.
            pub cx: f64,
            /// Principal point, vertical, pixel centers.
            pub cy: f64,
            $($after)*
            /// The largest angle from the optical axis in the lens image, radians. Without it the
            /// lens reaches as far as its model is one-to-one.
            #[serde(skip_serializing_if = "Option::is_none")]
            pub max_theta: Option<f64>,
        }
    };
}

/// Returns the image plane of an ideal lens, which has `focal`, or `fx` and `fy`.
pub(super) fn ideal_plane(
    focal_lengths: (Option<f64>, Option<f64>, Option<f64>),
    cx: f64,
    cy: f64,
) -> Result<ImagePlane, LensError> {
    let (fx, fy) = match focal_lengths {
        (Some(focal), None, None) => {
            let focal = positive("focal", focal)?;
            (focal, focal)
        }
        (None, Some(fx), Some(fy)) => (fx, fy),
        _ => {
            return Err(LensError::new("give either focal, or both fx and fy"));
        }
    };
    Ok(ImagePlane::new(fx, fy, cx, cy))
}

/// Declares the list of all models: `name: Struct`, with the name of the model in calibration
/// files.
/// Makes of it [`LensModel`](super::LensModel) and its curve.
macro_rules! lens_models {
    ($($name:ident: $Model:ident,)+) => {
        $(
            impl $Model {
                /// The model's name in calibration files.
                pub const NAME: &'static str = stringify!($name);
            }

            impl From<$Model> for LensModel {
                fn from(model: $Model) -> Self {
                    Self::$Model(model)
                }
            }
        )+

        /// A lens: its model and that model's parameters, not checked yet.
        ///
        /// It has the shape of the `lens` table of native calibration files. In the formulas of the
        /// models `theta` is the angle of a ray from the optical axis in radians. `r` is its
        /// distance from the principal point in units of the focal length, or in pixels where the
        /// model says so.
        #[derive(Debug, Clone, PartialEq, Serialize)]
        #[serde(tag = "model", rename_all = "snake_case")]
        pub enum LensModel {
            $(#[doc = concat!("The model [`", stringify!($Model), "`].")] $Model($Model),)+
        }

        impl LensModel {
            /// The names of all models, in the order in which they are listed to users.
            pub const NAMES: &'static [&'static str] = &[$($Model::NAME),+];

            /// Returns the model's name in calibration files.
            pub fn name(&self) -> &'static str {
                match self {
                    $(Self::$Model(_) => $Model::NAME,)+
                }
            }

            /// Returns the end of the lens image that the file states, radians.
            pub fn max_theta(&self) -> Option<f64> {
                match self {
                    $(Self::$Model(model) => model.max_theta,)+
                }
            }

            /// Reads the parameters of the model called `name`; `None` without such a model.
            ///
            /// # Errors
            /// Errors of the deserializer: a field of another type, a missing or an unknown field.
            pub fn deserialize_named<'de, D: Deserializer<'de>>(
                name: &str,
                parameters: D,
            ) -> Option<Result<Self, D::Error>> {
                $(if name == $Model::NAME {
                    return Some(Deserialize::deserialize(parameters).map(Self::$Model));
                })+
                None
            }

            /// Returns the checked curve of the model and the distortion that follows it.
            pub(super) fn curve(&self) -> Result<(AnyCurve, Option<RadialTangential>), LensError> {
                Ok(match self {
                    $(Self::$Model(model) => (AnyCurve::$Model(model.curve()?), model.distortion()?),)+
                })
            }

            /// Returns the image plane, whose values are not all checked yet.
            pub(super) fn plane(&self) -> Result<ImagePlane, LensError> {
                match self {
                    $(Self::$Model(model) => model.plane(),)+
                }
            }
        }

        /// The curve of one of the models.
        #[derive(Debug, Clone, PartialEq)]
        pub(super) enum AnyCurve {
            $($Model(<$Model as Model>::Curve),)+
        }

        impl AnyCurve {
            pub(super) fn model(&self) -> &'static str {
                match self {
                    $(Self::$Model(_) => $Model::NAME,)+
                }
            }
        }

        impl Curve for AnyCurve {
            fn limit(&self) -> f64 {
                match self {
                    $(Self::$Model(curve) => curve.limit(),)+
                }
            }

            fn radius(&self, theta: f64) -> f64 {
                match self {
                    $(Self::$Model(curve) => curve.radius(theta),)+
                }
            }

            fn angle(&self, radius: f64) -> f64 {
                match self {
                    $(Self::$Model(curve) => curve.angle(radius),)+
                }
            }

            fn is_polynomial(&self) -> bool {
                match self {
                    $(Self::$Model(curve) => curve.is_polynomial(),)+
                }
            }
        }
    };
}
