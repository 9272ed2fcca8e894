//! What a picture shows and how large it is, from parameters by name.

use std::ops::RangeInclusive;

use crate::pipeline::{ParameterError, shown, whole_number};

/// Widths that may be asked for, pixels.
const WIDTHS: RangeInclusive<u32> = 64..=8192;
const QUALITIES: RangeInclusive<u8> = 1..=100;
/// Hardly to be told from the original.
const DEFAULT_QUALITY: u8 = 88;
const NOTHING: &str = "none";

/// Something that can be drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Layer {
    /// Axis-parallel boxes.
    Boxes,
    /// Boxes turned along the persons.
    Oriented,
    /// The score of each person.
    Scores,
    /// The borders of the zones of the frame's calibration, with their names.
    Zones,
    /// The borders of the views through which the frame was seen.
    Views,
    /// When the frame was taken, or came when nobody said that.
    Timestamp,
}

/// What a picture shows and how large it is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PictureOptions {
    /// What is drawn.
    pub layers: Vec<Layer>,
    /// Width in pixels, 2048 if none is given; a frame that is no wider stays as it is.
    pub width: Option<u32>,
    /// Quality of a JPEG, 1 to 100.
    pub quality: u8,
}

impl Layer {
    /// Everything that can be drawn.
    pub const ALL: [Self; 6] = [
        Self::Boxes,
        Self::Oriented,
        Self::Scores,
        Self::Zones,
        Self::Views,
        Self::Timestamp,
    ];

    /// The name in requests.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Boxes => "boxes",
            Self::Oriented => "oriented",
            Self::Scores => "scores",
            Self::Zones => "zones",
            Self::Views => "views",
            Self::Timestamp => "timestamp",
        }
    }
}

impl Default for PictureOptions {
    fn default() -> Self {
        Self {
            layers: vec![Layer::Oriented, Layer::Scores],
            width: None,
            quality: DEFAULT_QUALITY,
        }
    }
}

impl PictureOptions {
    /// The names of the options.
    pub const NAMES: [&'static str; 3] = ["draw", "width", "quality"];

    /// Reads the values of [`PictureOptions::NAMES`].
    ///
    /// # Errors
    /// [`ParameterError`] for a value that is no such value or out of range.
    pub fn parse([draw, width, quality]: [Option<&str>; 3]) -> Result<Self, ParameterError> {
        let default = Self::default();
        Ok(Self {
            layers: draw.map_or(Ok(default.layers), parse_layers)?,
            width: width
                .map(|value| whole_number("width", value, WIDTHS))
                .transpose()?,
            quality: quality.map_or(Ok(default.quality), |value| {
                whole_number("quality", value, QUALITIES)
            })?,
        })
    }
}

fn parse_layers(value: &str) -> Result<Vec<Layer>, ParameterError> {
    if value == NOTHING {
        return Ok(Vec::new());
    }
    let mut layers = Vec::new();
    for name in value.split(',') {
        let layer = Layer::ALL.into_iter().find(|layer| layer.name() == name);
        let layer = layer.ok_or_else(|| {
            let known = Layer::ALL.map(Layer::name).join(", ");
            let name = shown(name);
            ParameterError::bad_value(
                "draw",
                format!("{name:?} cannot be drawn; use {NOTHING}, or some of {known}, with commas"),
            )
        })?;
        if !layers.contains(&layer) {
            layers.push(layer);
        }
    }
    Ok(layers)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pipeline::ParameterFault;

    #[test]
    fn every_layer_is_read_by_its_name_once() {
        let names = Layer::ALL.map(Layer::name).join(",") + ",boxes";
        let options = PictureOptions::parse([Some(&names), Some("640"), Some("100")]).unwrap();
        assert_eq!(options.layers, Layer::ALL);
        assert_eq!((options.width, options.quality), (Some(640), 100));
    }

    #[test]
    fn nothing_named_is_the_default_and_none_draws_nothing() {
        let default = PictureOptions::parse([None; 3]).unwrap();
        assert_eq!(default, PictureOptions::default());
        let none = PictureOptions::parse([Some("none"), None, None]).unwrap();
        assert!(none.layers.is_empty());
    }

    #[test]
    fn values_out_of_range_are_refused_by_name() {
        for (values, name) in [
            ([Some("hats"), None, None], "draw"),
            ([Some(""), None, None], "draw"),
            ([Some("none,boxes"), None, None], "draw"),
            ([None, Some("63"), None], "width"),
            ([None, Some("8193"), None], "width"),
            ([None, Some("-1"), None], "width"),
            ([None, None, Some("0")], "quality"),
            ([None, None, Some("101")], "quality"),
            ([None, None, Some("1000")], "quality"),
            ([None, None, Some("high")], "quality"),
        ] {
            let error = PictureOptions::parse(values).unwrap_err();
            assert_eq!(error.name, name, "{values:?}");
            assert_eq!(error.fault, ParameterFault::BadValue);
        }
    }
}
