//! The parameters of an inference request: those of `/detect`, and the protocol's `timeout`.

use lookdown_detect::{
    open_inference::parameters::Parameter,
    parameters::{DetectParameters, JsonType, ParameterError},
};

/// The name of [`TIMEOUT_MILLIS`] in the protocol; its unit is microseconds.
pub(super) const TIMEOUT: &str = "timeout";
const TIMEOUT_MILLIS: &str = "timeout_millis";
const MICROS_PER_MILLI: u64 = 1000;

/// Returns the parameters of a request as names and values of `/detect`.
pub(super) fn as_texts(
    given: &[(String, Parameter)],
) -> Result<Vec<(String, String)>, ParameterError> {
    let texts = given.iter().map(|(name, value)| match name.as_str() {
        TIMEOUT => timeout(value),
        _ => as_text(name, value),
    });
    texts.collect()
}

/// Returns a parameter as text, as in a query. The value of an unknown one is omitted: its name is
/// refused.
fn as_text(name: &str, value: &Parameter) -> Result<(String, String), ParameterError> {
    let spec = DetectParameters::TABLE
        .iter()
        .find(|spec| spec.name == name);
    let text = match spec {
        Some(spec) => text_of(name, value, spec.kind.json_type())?,
        None => "",
    };
    Ok((name.to_owned(), text.to_owned()))
}

/// Converts the protocol's `timeout` to `timeout_millis`.
fn timeout(value: &Parameter) -> Result<(String, String), ParameterError> {
    let text = text_of(TIMEOUT, value, JsonType::Number)?;
    let micros: u64 = text
        .parse()
        .map_err(|_| ParameterError::is_not(TIMEOUT, text, "a whole number of microseconds"))?;
    let millis = micros.div_ceil(MICROS_PER_MILLI);
    Ok((TIMEOUT_MILLIS.to_owned(), millis.to_string()))
}

/// Returns the text of a value of a JSON type.
fn text_of<'a>(
    name: &str,
    value: &'a Parameter,
    wanted: JsonType,
) -> Result<&'a str, ParameterError> {
    match (value, wanted) {
        (Parameter::Text(text), JsonType::Text) | (Parameter::Number(text), JsonType::Number) => {
            Ok(text)
        }
        (Parameter::Flag(true), JsonType::Switch) => Ok("true"),
        (Parameter::Flag(false), JsonType::Switch) => Ok("false"),
        _ => {
            let problem = format!("{} is needed", wanted.described());
            Err(ParameterError::bad_value(name, problem))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_parameter_is_read_as_its_json_type() {
        for spec in DetectParameters::TABLE {
            let values = [
                (JsonType::Text, Parameter::Text("1".to_owned())),
                (JsonType::Number, Parameter::Number("1".to_owned())),
                (JsonType::Switch, Parameter::Flag(true)),
            ];
            for (json_type, value) in values {
                let read = as_text(spec.name, &value);
                let is_right = json_type == spec.kind.json_type();
                assert_eq!(read.is_ok(), is_right, "{}: {value:?}", spec.name);
            }
        }
    }

    #[test]
    fn timeout_in_microseconds_is_rounded_up() {
        let given = [("timeout".to_owned(), Parameter::Number("1500".to_owned()))];
        let texts = as_texts(&given).unwrap();
        assert_eq!(texts, [(TIMEOUT_MILLIS.to_owned(), "2".to_owned())]);
    }
}
