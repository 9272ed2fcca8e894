//! The source of a value of a calibration.

use serde::{Deserialize, Deserializer, Serialize, de::Error};

/// The values of a calibration that have a source.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, strum::Display,
)]
#[serde(rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
pub enum SourcedValue {
    /// The radius at all angles.
    Lens,
    /// The projection of the lens, if it has another source.
    LensModel,
    /// The angle at the circle, if it has another source.
    FieldOfView,
    /// The optical center.
    Center,
    /// The direction of up.
    WorldUp,
    /// The height above the floor.
    HeightM,
    /// The floor point below the camera on the floor of its site.
    PositionM,
    /// The rotation on the floor of its site.
    YawDeg,
}

impl SourcedValue {
    /// Returns true for a value of the lens or of the level, which a fit to frames finds together.
    pub fn is_of_lens_or_level(self) -> bool {
        match self {
            Self::Lens | Self::LensModel | Self::FieldOfView | Self::Center | Self::WorldUp => true,
            Self::HeightM | Self::PositionM | Self::YawDeg => false,
        }
    }

    /// Returns the unit of the standard deviation, to follow its number.
    pub fn unit(self) -> &'static str {
        match self {
            Self::Lens => " % of the radius",
            Self::LensModel => "",
            Self::FieldOfView | Self::WorldUp | Self::YawDeg => "°",
            Self::Center => " pixels",
            Self::HeightM | Self::PositionM => " m",
        }
    }
}

/// Kind of source.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, strum::Display, strum::EnumString,
)]
#[serde(rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
pub enum ValueSource {
    /// Measured in frames, or with a tool.
    Measured,
    /// Given by the user, from a data sheet for example.
    Given,
    /// Assumed without a measurement.
    Assumed,
    /// Derived from the people in frames.
    FromPeople,
}

/// Source and uncertainty of a value.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NativeSource {
    /// Kind of source.
    pub source: ValueSource,
    /// Standard deviation in the unit of [`SourcedValue::unit`]: finite and not negative.
    #[serde(
        default,
        skip_serializing_if = "Option::is_none",
        deserialize_with = "deviation"
    )]
    pub uncertainty: Option<f64>,
}

impl NativeSource {
    /// A value of the user.
    pub const GIVEN: Self = Self::without_deviation(ValueSource::Given);
    /// A value without a measurement.
    pub const ASSUMED: Self = Self::without_deviation(ValueSource::Assumed);

    const fn without_deviation(source: ValueSource) -> Self {
        Self {
            source,
            uncertainty: None,
        }
    }

    /// A measured value with its standard deviation, if that is known.
    pub fn measured(uncertainty: Option<f64>) -> Self {
        Self {
            source: ValueSource::Measured,
            uncertainty,
        }
    }

    /// A value from people with its standard deviation.
    pub fn from_people(uncertainty: f64) -> Self {
        Self {
            source: ValueSource::FromPeople,
            uncertainty: Some(uncertainty),
        }
    }
}

fn deviation<'de, D: Deserializer<'de>>(input: D) -> Result<Option<f64>, D::Error> {
    let value = Option::<f64>::deserialize(input)?;
    match value {
        Some(value) if !(value.is_finite() && value >= 0.0) => Err(D::Error::custom(format!(
            "uncertainty is {value}: give a standard deviation of 0 or more"
        ))),
        _ => Ok(value),
    }
}
