//! Reading a lens: the model first, then its parameters, so that an error names the field.

use serde::{Deserialize, Deserializer, de::Error};
use serde_json::{Map, Value};

use super::LensModel;

impl<'de> Deserialize<'de> for LensModel {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let mut parameters = Map::deserialize(deserializer)?;
        let name = match parameters.remove("model") {
            Some(Value::String(name)) => name,
            Some(_) => {
                return Err(D::Error::custom(
                    "lens.model: give the model's name as text",
                ));
            }
            None => return Err(D::Error::custom("lens: missing field `model`")),
        };
        let mut track = serde_path_to_error::Track::new();
        let parameters = Value::Object(parameters);
        let parameters = serde_path_to_error::Deserializer::new(parameters, &mut track);
        let Some(lens) = Self::deserialize_named(&name, parameters) else {
            // Enough to recognize it by, not enough to fill a log.
            let name: String = name.chars().take(64).collect();
            let known = Self::NAMES.join(", ");
            let problem = format!("lens.model: {name:?} is none of {known}");
            return Err(D::Error::custom(problem));
        };
        lens.map_err(|error| match track.path().to_string() {
            path if path == "." => D::Error::custom(format!("lens: {error}")),
            path => D::Error::custom(format!("lens.{path}: {error}")),
        })
    }
}
