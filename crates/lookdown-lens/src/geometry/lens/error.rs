//! Reasons for which parameters make no lens.

/// A lens that cannot be. Parameters are named as in calibration files.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum LensError {
    /// A parameter is NaN or infinite.
    #[error("{name} is {value}: a finite number is needed")]
    NotFinite {
        /// The parameter.
        name: &'static str,
        /// Its value.
        value: f64,
    },
    /// A focal length or a scale is zero or negative.
    #[error("{name} is {value}: it must be greater than 0")]
    NotPositive {
        /// The parameter.
        name: &'static str,
        /// Its value.
        value: f64,
    },
    /// Both or none of two exclusive ways to give one parameter were used.
    #[error("give either {choice}")]
    EitherOr {
        /// The two ways, in words.
        choice: &'static str,
    },
    /// A parameter lies outside the range in which its model is defined.
    #[error("{name} is {value}: this {model} parameter must be {range}")]
    OutOfRange {
        /// The lens model's name.
        model: &'static str,
        /// The parameter.
        name: &'static str,
        /// Its value.
        value: f64,
        /// The values that are accepted, in words.
        range: &'static str,
    },
    /// The affine part flattens or mirrors the image.
    #[error(
        "the affine part [[{fx}, {skew}], [{row_skew}, {fy}]] flattens or mirrors the image: its \
         off-diagonal terms must be small against its diagonal"
    )]
    NotOrienting {
        /// Horizontal pixels per unit of `x`.
        fx: f64,
        /// Horizontal pixels per unit of `y`.
        skew: f64,
        /// Vertical pixels per unit of `x`.
        row_skew: f64,
        /// Vertical pixels per unit of `y`.
        fy: f64,
    },
    /// The radius does not grow with the angle at the optical axis, or at once beyond all bounds.
    #[error(
        "the lens curve of {model} does not rise at the optical axis: check the order and sign of \
         its parameters"
    )]
    NotRising {
        /// The lens model's name.
        model: &'static str,
    },
    /// A polynomial that does not start at the principal point.
    #[error("{name}[0] is {value}: the radius at the optical axis must be 0")]
    TornAtAxis {
        /// The polynomial.
        name: &'static str,
        /// The constant coefficient.
        value: f64,
    },
    /// A polynomial of absurd degree.
    #[error("{name} has {count} entries: between {least} and {most} are accepted")]
    CoefficientCount {
        /// The polynomial.
        name: &'static str,
        /// The number of entries given.
        count: usize,
        /// The fewest that are accepted.
        least: usize,
        /// The most that are accepted.
        most: usize,
    },
    /// `max_theta` lies outside the range in which the model maps one to one.
    #[error(
        "max_theta is {value} rad, but this {model} lens is one-to-one only up to {limit} rad: \
         give a value above 0 and at most that"
    )]
    MaxThetaOutOfRange {
        /// The lens model's name.
        model: &'static str,
        /// The value given.
        value: f64,
        /// The largest value the model allows, rounded down.
        limit: f64,
    },
    /// The fitted curve falls again before `max_theta`.
    #[error(
        "max_theta is {value} rad, but the curve of this {model} lens turns back at {limit} rad: \
         check its coefficients, or give at most that"
    )]
    TurnsBack {
        /// The lens model's name.
        model: &'static str,
        /// The value given.
        value: f64,
        /// The first angle at which the curve no longer rises, rounded down.
        limit: f64,
    },
}
