//! Inference requests and responses in their wire format.

use serde::{Deserialize, Serialize};
use serde_json::value::RawValue;

use crate::open_inference::{Datatype, binary_data, json_data};

/// An inference request with views for a model.
pub(super) struct Question<'a> {
    pub(super) input: &'a str,
    pub(super) shape: &'a [usize],
    pub(super) values: &'a [f32],
    /// Names of the requested outputs.
    pub(super) outputs: &'a [String],
    /// True to transfer tensors as bytes.
    pub(super) as_bytes: bool,
}

/// The outputs with readable numbers: those of type `FP32`.
#[derive(Debug, PartialEq)]
pub(super) struct Answer {
    pub(super) outputs: Vec<Output>,
}

#[derive(Debug, PartialEq)]
pub(super) struct Output {
    pub(super) name: String,
    pub(super) shape: Vec<usize>,
    pub(super) values: Vec<f32>,
}

#[derive(Serialize)]
struct QuestionHead<'a> {
    inputs: [InputHead<'a>; 1],
    outputs: Vec<WantedHead<'a>>,
}

#[derive(Serialize)]
struct InputHead<'a> {
    name: &'a str,
    shape: &'a [usize],
    datatype: Datatype,
    #[serde(skip_serializing_if = "Option::is_none")]
    parameters: Option<BinarySize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    data: Option<&'a [f32]>,
}

#[derive(Serialize)]
struct WantedHead<'a> {
    name: &'a str,
    #[serde(skip_serializing_if = "Option::is_none")]
    parameters: Option<Binary>,
}

#[derive(Serialize)]
struct Binary {
    binary_data: bool,
}

#[derive(Serialize)]
struct BinarySize {
    binary_data_size: usize,
}

#[derive(Deserialize)]
struct AnswerHead<'a> {
    #[serde(borrow)]
    outputs: Vec<OutputHead<'a>>,
}

#[derive(Deserialize)]
struct OutputHead<'a> {
    name: String,
    shape: Vec<usize>,
    datatype: String,
    #[serde(default)]
    parameters: Option<OutputParameters>,
    #[serde(borrow, default)]
    data: Option<&'a RawValue>,
}

#[derive(Deserialize)]
struct OutputParameters {
    binary_data_size: Option<usize>,
}

impl Question<'_> {
    /// The body of the request, and the length of its JSON if bytes follow.
    pub(super) fn body(&self) -> serde_json::Result<(Vec<u8>, Option<usize>)> {
        let wanted = self.outputs.iter().map(|name| WantedHead {
            name,
            parameters: self.as_bytes.then_some(Binary { binary_data: true }),
        });
        let head = QuestionHead {
            inputs: [InputHead {
                name: self.input,
                shape: self.shape,
                datatype: Datatype::Fp32,
                parameters: self.as_bytes.then_some(BinarySize {
                    binary_data_size: size_of_val(self.values),
                }),
                data: (!self.as_bytes).then_some(self.values),
            }],
            outputs: wanted.collect(),
        };
        let mut body = serde_json::to_vec(&head)?;
        if !self.as_bytes {
            return Ok((body, None));
        }
        let length = body.len();
        body.reserve_exact(size_of_val(self.values));
        body.extend(self.values.iter().flat_map(|value| value.to_le_bytes()));
        Ok((body, Some(length)))
    }
}

impl Answer {
    /// Parses a response. `head_length` is the length of its JSON if bytes follow.
    ///
    /// # Errors
    /// Description of the error.
    pub(super) fn read(body: &[u8], head_length: Option<usize>) -> Result<Self, String> {
        let (json, mut behind) = body
            .split_at_checked(head_length.unwrap_or(body.len()))
            .ok_or("its response is shorter than its declared length")?;
        let head: AnswerHead = serde_json::from_slice(json)
            .map_err(|error| format!("its response cannot be read: {error}"))?;
        let mut outputs = Vec::new();
        for output in head.outputs {
            let size = output
                .parameters
                .and_then(|parameters| parameters.binary_data_size);
            let bytes = behind.split_at_checked(size.unwrap_or(0));
            let (bytes, rest) = bytes.ok_or("its response is shorter than its outputs declare")?;
            behind = rest;
            // Heads read only floats, but a model may have further outputs.
            if output.datatype != Datatype::Fp32.name() {
                continue;
            }
            let mut sides = output.shape.iter();
            let count = sides.try_fold(1_usize, |count, &side| count.checked_mul(side));
            let count = count.ok_or("its response contains an impossible shape")?;
            let values = match (output.data, size) {
                (_, Some(_)) => binary_data::floats(bytes, count),
                (Some(data), None) => json_data::numbers(data.get(), Datatype::Fp32, count),
                (None, None) => Err("it has no data".to_owned()),
            };
            let name = output.name;
            let values = values.map_err(|wrong| format!("its output {name:?}: {wrong}"))?;
            outputs.push(Output {
                name,
                shape: output.shape,
                values,
            });
        }
        Ok(Self { outputs })
    }
}

#[cfg(test)]
mod tests {
    use serde_json::{Value, json};

    use super::*;

    fn question(as_bytes: bool) -> (Vec<u8>, Option<usize>) {
        let question = Question {
            input: "images",
            shape: &[1, 3, 1, 1],
            values: &[0.1, 1.0, -2.5],
            outputs: &["boxes".to_owned()],
            as_bytes,
        };
        question.body().unwrap()
    }

    #[test]
    fn views_sent_as_numbers_are_parsed_unchanged() {
        let (body, head_length) = question(false);
        assert_eq!(head_length, None);
        let written: Value = serde_json::from_slice(&body).unwrap();
        let input = json!({ "name": "images", "shape": [1, 3, 1, 1], "datatype": "FP32", "data": [0.1, 1.0, -2.5] });
        assert_eq!(
            written,
            json!({ "inputs": [input], "outputs": [{ "name": "boxes" }] })
        );
    }

    #[test]
    fn views_are_sent_as_bytes_behind_the_json() {
        let (body, head_length) = question(true);
        let (head, behind) = body.split_at(head_length.unwrap());
        let written: Value = serde_json::from_slice(head).unwrap();
        let input = &written["inputs"][0];
        assert_eq!(input["parameters"], json!({ "binary_data_size": 12 }));
        assert!(input["data"].is_null());
        assert_eq!(
            written["outputs"][0]["parameters"],
            json!({ "binary_data": true })
        );
        assert_eq!(binary_data::floats(behind, 3).unwrap(), [0.1, 1.0, -2.5]);
    }

    #[test]
    fn responses_are_parsed_from_bytes_and_from_lists() {
        let head = json!({ "model_name": "m", "outputs": [
            { "name": "ids", "datatype": "INT64", "shape": [1], "parameters": { "binary_data_size": 8 } },
            { "name": "boxes", "datatype": "FP32", "shape": [1, 2], "parameters": { "binary_data_size": 8 } },
            { "name": "scores", "datatype": "FP32", "shape": [1, 2], "data": [[0.5, 1]] },
        ] });
        let head = head.to_string();
        let numbers = [f32::NAN.to_le_bytes(), 2.0_f32.to_le_bytes()].concat();
        let body = [head.as_bytes(), &[9; 8], &numbers].concat();
        let answer = Answer::read(&body, Some(head.len())).unwrap();
        let names: Vec<_> = answer
            .outputs
            .iter()
            .map(|output| output.name.as_str())
            .collect();
        assert_eq!(names, ["boxes", "scores"]);
        assert!(
            answer.outputs[0].values[0].is_nan(),
            "NaN is passed on to the heads"
        );
        assert_eq!(answer.outputs[1].values, [0.5, 1.0]);
    }

    #[test]
    fn inconsistent_responses_are_reported() {
        let output = |parameters: Value, data: Value| {
            json!({ "outputs": [{ "name": "boxes", "datatype": "FP32", "shape": [2],
                "parameters": parameters, "data": data }] })
        };
        let size = |size: usize| json!({ "binary_data_size": size });
        for (head, behind, part) in [
            (
                output(size(9), json!(null)),
                &[0; 8][..],
                "shorter than its outputs",
            ),
            (output(size(4), json!(null)), &[0; 4], "needs 2"),
            (output(json!({}), json!([1])), &[], "needs 2"),
            (output(json!(null), json!(null)), &[], "no data"),
            (json!({ "error": "no" }), &[], "cannot be read"),
        ] {
            let head = head.to_string();
            let body = [head.as_bytes(), behind].concat();
            let message = Answer::read(&body, Some(head.len())).unwrap_err();
            assert!(message.contains(part), "{message}");
        }
        assert!(
            Answer::read(b"{}", Some(3))
                .unwrap_err()
                .contains("shorter")
        );
    }
}
