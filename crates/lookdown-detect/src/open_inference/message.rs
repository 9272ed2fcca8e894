//! Inference requests and responses: JSON, and the bytes of tensors after it.
//!
//! The types are written and read by both sides. `D` is the form of tensor data in the JSON:
//! unparsed text ([`serde_json::value::RawValue`]) when they are read, [`TensorValues`] when they
//! are written.

use std::{fmt, marker::PhantomData, num::TryFromIntError};

use bytes::Bytes;
use serde::{
    Deserialize, Serialize,
    de::{Deserializer, Error, MapAccess, SeqAccess, Visitor, value::MapAccessDeserializer},
    ser::{SerializeMap, Serializer},
};

use super::{
    Datatype,
    tensor_data::{LENGTH_BYTES, put_element},
};

/// The JSON of an inference request. Unknown members are an error.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct InferRequest<D> {
    /// The ID of the request; the response repeats it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub id: Option<String>,
    /// The parameters of the model and of the protocol.
    #[serde(default, skip_serializing_if = "Parameters::is_empty")]
    pub parameters: Parameters,
    /// The input tensors.
    pub inputs: Entries<Table<InputTensor<D>>>,
    /// The requested outputs; all of the model's by default.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub outputs: Option<Entries<Table<RequestedOutput>>>,
}

/// An input tensor.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct InputTensor<D> {
    /// The name.
    pub name: String,
    /// The size of each axis.
    pub shape: Entries<u32>,
    /// The name of the datatype.
    pub datatype: String,
    /// The parameters, such as `binary_data_size`.
    #[serde(default, skip_serializing_if = "Parameters::is_empty")]
    pub parameters: Parameters,
    /// The values, unless they follow the JSON as bytes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub data: Option<D>,
}

/// A requested output.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RequestedOutput {
    /// The name.
    pub name: String,
    /// The parameters, such as `binary_data`.
    #[serde(default, skip_serializing_if = "Parameters::is_empty")]
    pub parameters: Parameters,
}

/// The JSON of an inference response. Unknown members are ignored, as servers differ.
#[derive(Debug, Serialize, Deserialize)]
pub struct InferResponse<D> {
    /// The name of the model.
    #[serde(default)]
    pub model_name: String,
    /// The version of the model.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub model_version: Option<String>,
    /// The ID of the request, if it had one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub id: Option<String>,
    /// The output tensors.
    pub outputs: Entries<OutputTensor<D>>,
}

/// An output tensor.
#[derive(Debug, Serialize, Deserialize)]
pub struct OutputTensor<D> {
    /// The name.
    pub name: String,
    /// The name of the datatype.
    pub datatype: String,
    /// The size of each axis.
    pub shape: Entries<usize>,
    /// The parameters of an output whose bytes follow the JSON.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub parameters: Option<OutputParameters>,
    /// The values otherwise.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub data: Option<D>,
}

/// The parameters of an output tensor.
#[derive(Debug, Serialize, Deserialize)]
pub struct OutputParameters {
    /// The number of bytes after the JSON.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub binary_data_size: Option<usize>,
}

/// A message as it is sent.
#[derive(Debug, Clone)]
pub struct Message {
    /// The JSON, and the bytes of tensors after it.
    pub body: Bytes,
    /// The length of the JSON if bytes follow it: the header
    /// [`HEAD_LENGTH`](super::HEAD_LENGTH).
    pub head_length: Option<usize>,
}

impl Message {
    /// Writes JSON and the tensors that follow it as bytes, in their order.
    ///
    /// # Errors
    /// Returns an error if an element exceeds the length that the encoding has.
    pub fn write(head: &impl Serialize, tensors: &[TensorValues<'_>]) -> serde_json::Result<Self> {
        let mut body = serde_json::to_vec(head)?;
        let head_length = (!tensors.is_empty()).then_some(body.len());
        body.reserve_exact(tensors.iter().map(TensorValues::byte_count).sum());
        for tensor in tensors {
            tensor.put_bytes(&mut body).map_err(Error::custom)?;
        }
        Ok(Self {
            body: body.into(),
            head_length,
        })
    }

    /// Splits the message into its JSON and the bytes after it; `None` if it is shorter than its
    /// JSON should be.
    pub fn split(&self) -> Option<(Bytes, Bytes)> {
        let length = self.head_length.unwrap_or(self.body.len());
        (length <= self.body.len()).then(|| (self.body.slice(..length), self.body.slice(length..)))
    }
}

/// Parses the JSON of a request, which must be an object.
///
/// # Errors
/// Returns an error if the JSON is malformed or is not a request.
pub fn read_request<'a, D: Deserialize<'a>>(json: &'a [u8]) -> serde_json::Result<InferRequest<D>> {
    serde_json::from_slice(json).map(|Table(request)| request)
}

/// The values of a tensor, row-major.
#[derive(Debug, Clone, Serialize)]
#[serde(untagged)]
pub enum TensorValues<'a> {
    /// `FP32`.
    Floats(&'a [f32]),
    /// `INT32`.
    Integers(&'a [i32]),
    /// The elements of a `BYTES` tensor.
    Texts(Vec<&'a str>),
}

impl TensorValues<'_> {
    /// Returns the datatype.
    pub fn datatype(&self) -> Datatype {
        match self {
            Self::Floats(_) => Datatype::Fp32,
            Self::Integers(_) => Datatype::Int32,
            Self::Texts(_) => Datatype::Bytes,
        }
    }

    /// Returns the number of bytes of the values as bytes.
    pub fn byte_count(&self) -> usize {
        match self {
            Self::Floats(values) => size_of_val(*values),
            Self::Integers(values) => size_of_val(*values),
            Self::Texts(texts) => texts.iter().map(|text| LENGTH_BYTES + text.len()).sum(),
        }
    }

    /// Appends the values as bytes.
    ///
    /// # Errors
    /// Returns an error if the length of an element exceeds four bytes.
    pub fn put_bytes(&self, bytes: &mut Vec<u8>) -> Result<(), TryFromIntError> {
        match self {
            Self::Floats(values) => {
                bytes.extend(values.iter().flat_map(|value| value.to_le_bytes()));
            }
            Self::Integers(values) => {
                bytes.extend(values.iter().flat_map(|value| value.to_le_bytes()));
            }
            Self::Texts(texts) => {
                for text in texts {
                    put_element(text.as_bytes(), bytes)?;
                }
            }
        }
        Ok(())
    }
}

/// Largest number of inputs, of outputs and of axes.
pub const MAX_ENTRIES: usize = 16;

/// A list of at most [`MAX_ENTRIES`].
#[derive(Debug, Serialize)]
pub struct Entries<T>(pub Vec<T>);

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Entries<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_seq(EntriesVisitor(PhantomData))
    }
}

struct EntriesVisitor<T>(PhantomData<T>);

impl<'de, T: Deserialize<'de>> Visitor<'de> for EntriesVisitor<T> {
    type Value = Entries<T>;

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("a list")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Self::Value, A::Error> {
        let mut entries = Vec::new();
        while let Some(entry) = list.next_element()? {
            if entries.len() == MAX_ENTRIES {
                return Err(A::Error::custom(format!(
                    "more than {MAX_ENTRIES} in a list"
                )));
            }
            entries.push(entry);
        }
        Ok(Entries(entries))
    }
}

/// A struct that must be a JSON object; serde would also accept a list of its fields.
#[derive(Debug, Serialize)]
pub struct Table<T>(pub T);

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Table<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_map(TableVisitor(PhantomData))
    }
}

struct TableVisitor<T>(PhantomData<T>);

impl<'de, T: Deserialize<'de>> Visitor<'de> for TableVisitor<T> {
    type Value = Table<T>;

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("an object")
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Self::Value, A::Error> {
        T::deserialize(MapAccessDeserializer::new(map)).map(Table)
    }
}

/// Largest number of parameters of an object: all existing parameters, with room for mistakes,
/// which have a better error message.
const MAX_PARAMETERS: usize = 32;

/// Parameters in their order, without those that are `null`.
#[derive(Debug, Default, PartialEq)]
pub struct Parameters(pub Vec<(String, Parameter)>);

/// The value of a parameter.
#[derive(Debug, Clone, PartialEq)]
pub enum Parameter {
    /// `true` or `false`.
    Flag(bool),
    /// The number as text, as in a query.
    Number(String),
    /// A string.
    Text(String),
}

impl Parameters {
    /// Returns one parameter, or none.
    pub fn only(name: &str, value: Option<Parameter>) -> Self {
        Self(
            value
                .map(|value| (name.to_owned(), value))
                .into_iter()
                .collect(),
        )
    }

    /// Returns `true` if there are no parameters.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Removes and returns the parameter of this name; the last one if it is repeated.
    pub fn take(&mut self, name: &str) -> Option<Parameter> {
        let mut taken = self.0.extract_if(.., |(given, _)| given == name);
        taken.by_ref().last().map(|(_, value)| value)
    }
}

impl<'de> Deserialize<'de> for Parameters {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(ParametersVisitor)
    }
}

struct ParametersVisitor;

impl<'de> Visitor<'de> for ParametersVisitor {
    type Value = Parameters;

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("an object of parameters")
    }

    fn visit_unit<E: Error>(self) -> Result<Parameters, E> {
        Ok(Parameters::default())
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Parameters, A::Error> {
        let mut parameters = Vec::new();
        while let Some((name, value)) = map.next_entry::<String, Option<Parameter>>()? {
            if parameters.len() == MAX_PARAMETERS {
                return Err(A::Error::custom(format!(
                    "more than {MAX_PARAMETERS} parameters"
                )));
            }
            parameters.extend(value.map(|value| (name, value)));
        }
        Ok(Parameters(parameters))
    }
}

impl<'de> Deserialize<'de> for Parameter {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(ParameterVisitor)
    }
}

struct ParameterVisitor;

impl Visitor<'_> for ParameterVisitor {
    type Value = Parameter;

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("a parameter: a text, a number, true or false")
    }

    fn visit_bool<E: Error>(self, value: bool) -> Result<Parameter, E> {
        Ok(Parameter::Flag(value))
    }

    fn visit_i64<E: Error>(self, value: i64) -> Result<Parameter, E> {
        Ok(Parameter::Number(value.to_string()))
    }

    fn visit_u64<E: Error>(self, value: u64) -> Result<Parameter, E> {
        Ok(Parameter::Number(value.to_string()))
    }

    fn visit_f64<E: Error>(self, value: f64) -> Result<Parameter, E> {
        Ok(Parameter::Number(value.to_string()))
    }

    fn visit_str<E: Error>(self, value: &str) -> Result<Parameter, E> {
        Ok(Parameter::Text(value.to_owned()))
    }
}

impl Serialize for Parameters {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(Some(self.0.len()))?;
        for (name, value) in &self.0 {
            map.serialize_entry(name, value)?;
        }
        map.end()
    }
}

impl Serialize for Parameter {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Flag(flag) => serializer.serialize_bool(*flag),
            Self::Text(text) => serializer.serialize_str(text),
            Self::Number(text) => text
                .parse::<serde_json::Number>()
                .map_err(serde::ser::Error::custom)?
                .serialize(serializer),
        }
    }
}

#[cfg(test)]
mod tests {
    use serde_json::value::RawValue;

    use super::*;
    use crate::open_inference::{Datatype, TensorData};

    #[test]
    fn a_written_response_is_read_with_the_same_values() {
        let values = [0.1, -2.5];
        let tensor = TensorValues::Floats(&values);
        for as_bytes in [false, true] {
            let output = OutputTensor {
                name: "scores".to_owned(),
                datatype: tensor.datatype().to_string(),
                shape: Entries(vec![2]),
                parameters: as_bytes.then(|| OutputParameters {
                    binary_data_size: Some(tensor.byte_count()),
                }),
                data: (!as_bytes).then(|| tensor.clone()),
            };
            let response = InferResponse {
                model_name: "model".to_owned(),
                model_version: None,
                id: None,
                outputs: Entries(vec![output]),
            };
            let behind = [tensor.clone()];
            let behind = if as_bytes { &behind[..] } else { &[] };
            let message = Message::write(&response, behind).unwrap();
            assert_eq!(message.head_length.is_some(), as_bytes);

            let (json, mut behind) = message.split().unwrap();
            let read: InferResponse<&RawValue> = serde_json::from_slice(&json).unwrap();
            let output = &read.outputs.0[0];
            assert_eq!(output.datatype, Datatype::Fp32.name());
            let size = output.parameters.as_ref();
            let size = size.and_then(|parameters| parameters.binary_data_size);
            let sent = TensorData::take(output.data, size, &mut behind).unwrap();
            assert_eq!(sent.floats(2).unwrap(), values);
            assert!(behind.is_empty());
        }
    }
}
