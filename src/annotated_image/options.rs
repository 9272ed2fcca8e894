//! The drawings and the size of an annotated image: the table of parameters, and the checked
//! values.

use std::str::FromStr;

use lookdown_detect::{
    parameter_table,
    parameters::{
        GivenParameters, Interface, ParameterDefault, ParameterError, ParameterKind, ParameterSpec,
    },
};
use strum::{EnumString, VariantArray, VariantNames};

const NO_LAYER: &str = "none";
const INTERFACES: &[Interface] = &[Interface::Http, Interface::CommandLine];

parameter_table! {
    /// The parameters of an annotated image.
    const TABLE;

    DRAW = ParameterSpec {
        name: "draw",
        kind: ParameterKind::Choices {
            names: <Layer as VariantNames>::VARIANTS,
            none: NO_LAYER,
        },
        default: ParameterDefault::Value("oriented,scores"),
        help: "Layers that are drawn into an annotated image, separated by commas. `blur` and \
               `silhouette` conceal the persons of the report, below the other layers.",
        example: None,
        interfaces: INTERFACES,
    };
    // More than a screen shows, and small enough that drawing costs no more than decoding.
    WIDTH = ParameterSpec {
        name: "width",
        kind: ParameterKind::Whole { min: 64, max: 8192 },
        default: ParameterDefault::Value("2048"),
        help: "Maximum width of an annotated image, pixels. A narrower frame is not enlarged.",
        example: Some("640"),
        interfaces: INTERFACES,
    };
    // Hardly distinguishable from the original.
    QUALITY = ParameterSpec {
        name: "quality",
        kind: ParameterKind::Whole { min: 1, max: 100 },
        default: ParameterDefault::Value("88"),
        help: "Quality of a JPEG.",
        example: None,
        interfaces: INTERFACES,
    };
}

/// Something that can be drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, EnumString, VariantArray, VariantNames)]
#[strum(serialize_all = "snake_case")]
pub enum Layer {
    /// The area of each person is blurred.
    Blur,
    /// The area of each person is filled with one color.
    Silhouette,
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
    /// The time at which the frame was captured, or else at which it arrived.
    Timestamp,
}

/// The drawings and the size of an annotated image.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct AnnotationOptions {
    /// The layers, each once.
    pub layers: Vec<Layer>,
    /// Maximum width in pixels. A narrower frame is not enlarged.
    pub width: u32,
    /// Quality of a JPEG, 1 to 100.
    pub quality: u8,
}

impl AnnotationOptions {
    /// The specifications, in the order in which they are listed to users.
    pub const TABLE: &'static [ParameterSpec] = TABLE;

    /// Checks `(name, value)` pairs.
    ///
    /// # Errors
    /// [`ParameterError`] for an unknown or repeated name and for a value out of range.
    pub fn parse<'a>(
        pairs: impl IntoIterator<Item = (&'a str, &'a str)>,
    ) -> Result<Self, ParameterError> {
        let given = GivenParameters::read(TABLE, pairs)?;
        let Layers(layers) = given.value(&DRAW)?;
        Ok(Self {
            layers,
            width: given.value(&WIDTH)?,
            quality: given.value(&QUALITY)?,
        })
    }
}

/// The value of `draw`.
struct Layers(Vec<Layer>);

impl FromStr for Layers {
    type Err = strum::ParseError;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let mut layers = Vec::new();
        if text == NO_LAYER {
            return Ok(Self(layers));
        }
        for name in text.split(',') {
            let layer = name.parse()?;
            if !layers.contains(&layer) {
                layers.push(layer);
            }
        }
        Ok(Self(layers))
    }
}

#[cfg(test)]
mod tests {
    use lookdown_detect::parameters::ParameterFault;

    use super::*;

    #[test]
    fn every_layer_is_read_by_its_name_once() {
        let names = <Layer as VariantNames>::VARIANTS.join(",") + ",boxes";
        let pairs = [("draw", &*names), ("width", "640"), ("quality", "100")];
        let options = AnnotationOptions::parse(pairs).unwrap();
        assert_eq!(options.layers, <Layer as VariantArray>::VARIANTS);
        assert_eq!((options.width, options.quality), (640, 100));
    }

    #[test]
    fn defaults_are_those_of_the_table() {
        let default = AnnotationOptions::parse([]).unwrap();
        assert_eq!(default.layers, [Layer::Oriented, Layer::Scores]);
        assert_eq!((default.width, default.quality), (2048, 88));
        let none = AnnotationOptions::parse([("draw", "none")]).unwrap();
        assert!(none.layers.is_empty());
    }

    #[test]
    fn values_out_of_range_are_refused_by_name() {
        for (name, value) in [
            ("draw", "hats"),
            ("draw", ""),
            ("draw", "none,boxes"),
            ("width", "63"),
            ("width", "8193"),
            ("width", "-1"),
            ("quality", "0"),
            ("quality", "101"),
            ("quality", "1000"),
            ("quality", "high"),
        ] {
            let error = AnnotationOptions::parse([(name, value)]).unwrap_err();
            assert_eq!(error.name, name, "{value:?}");
            assert_eq!(error.fault, ParameterFault::BadValue);
        }
        let error = AnnotationOptions::parse([("draw", "hats")]).unwrap_err();
        assert_eq!(
            error.to_string(),
            "draw: \"hats\" is not none or a comma-separated list of blur, silhouette, boxes, oriented, scores, \
             zones, views, timestamp"
        );
    }
}
