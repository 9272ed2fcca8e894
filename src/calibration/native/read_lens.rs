//! Reading a lens: the model first, then its fields, so that an error names the field.

use serde::{
    Deserialize, Deserializer,
    de::{DeserializeOwned, Error},
};
use serde_json::{Map, Value};

use super::NativeLens;

const MODELS: [&str; 14] = [
    "equidistant",
    "equisolid",
    "stereographic",
    "orthographic",
    "rectilinear",
    "radial_polynomial",
    "kannala_brandt",
    "ucm",
    "eucm",
    "mei",
    "double_sphere",
    "ocam",
    "fov",
    "f_theta",
];

impl<'de> Deserialize<'de> for NativeLens {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let mut fields = Map::deserialize(deserializer)?;
        let model = match fields.remove("model") {
            Some(Value::String(model)) => model,
            Some(_) => {
                return Err(D::Error::custom(
                    "lens.model: give the model's name as text",
                ));
            }
            None => return Err(D::Error::custom("lens: missing field `model`")),
        };
        let lens = match model.as_str() {
            "equidistant" => read(fields).map(Self::Equidistant),
            "equisolid" => read(fields).map(Self::Equisolid),
            "stereographic" => read(fields).map(Self::Stereographic),
            "orthographic" => read(fields).map(Self::Orthographic),
            "rectilinear" => read(fields).map(Self::Rectilinear),
            "radial_polynomial" => read(fields).map(Self::RadialPolynomial),
            "kannala_brandt" => read(fields).map(Self::KannalaBrandt),
            "ucm" => read(fields).map(Self::Ucm),
            "eucm" => read(fields).map(Self::Eucm),
            "mei" => read(fields).map(Self::Mei),
            "double_sphere" => read(fields).map(Self::DoubleSphere),
            "ocam" => read(fields).map(Self::Ocam),
            "fov" => read(fields).map(Self::Fov),
            "f_theta" => read(fields).map(Self::FTheta),
            unknown => {
                // Enough to recognise it by, not enough to fill a log.
                let unknown: String = unknown.chars().take(64).collect();
                let known = MODELS.join(", ");
                Err(format!("lens.model: {unknown:?} is none of {known}"))
            }
        };
        lens.map_err(D::Error::custom)
    }
}

/// The fields of one model.
fn read<Fields: DeserializeOwned>(fields: Map<String, Value>) -> Result<Fields, String> {
    serde_path_to_error::deserialize(Value::Object(fields)).map_err(|error| {
        match error.path().to_string() {
            path if path == "." => format!("lens: {}", error.inner()),
            path => format!("lens.{path}: {}", error.inner()),
        }
    })
}
