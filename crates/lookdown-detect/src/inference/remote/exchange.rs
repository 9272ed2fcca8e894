//! Inference requests with views, and their responses.

use lookdown_common::text::{Quoted, one_line};
use serde::ser::Error;
use serde_json::value::RawValue;

use crate::open_inference::{
    BINARY_OUTPUT, BINARY_SIZE, Datatype, TensorData, TensorValues, element_count,
    message::{
        Entries, InferRequest, InferResponse, InputTensor, Message, Parameter, Parameters,
        RequestedOutput, Table,
    },
};

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

/// An output with readable numbers: of type `FP32`.
#[derive(Debug, PartialEq)]
pub(super) struct Output {
    pub(super) name: String,
    pub(super) shape: Vec<usize>,
    pub(super) values: Vec<f32>,
}

impl Question<'_> {
    /// Returns the message of the request.
    pub(super) fn message(&self) -> serde_json::Result<Message> {
        let values = TensorValues::Floats(self.values);
        let flag = self.as_bytes.then_some(Parameter::Flag(true));
        let outputs = self.outputs.iter().map(|name| RequestedOutput {
            name: name.clone(),
            parameters: Parameters::only(BINARY_OUTPUT, flag.clone()),
        });
        let size = Parameter::Number(values.byte_count().to_string());
        let sides = self.shape.iter().map(|&side| u32::try_from(side));
        let input = InputTensor {
            name: self.input.to_owned(),
            shape: Entries(sides.collect::<Result<_, _>>().map_err(Error::custom)?),
            datatype: values.datatype().to_string(),
            parameters: Parameters::only(BINARY_SIZE, self.as_bytes.then_some(size)),
            data: (!self.as_bytes).then(|| values.clone()),
        };
        let head = InferRequest {
            id: None,
            parameters: Parameters::default(),
            inputs: Entries(vec![Table(input)]),
            outputs: Some(Entries(outputs.map(Table).collect())),
        };
        let behind = [values];
        Message::write(&head, if self.as_bytes { &behind } else { &[] })
    }
}

impl Output {
    /// Returns the outputs of a response with readable numbers.
    ///
    /// # Errors
    /// Description of the error.
    pub(super) fn all(message: &Message) -> Result<Vec<Self>, String> {
        let (json, mut behind) = message
            .split()
            .ok_or("its response is shorter than its declared length")?;
        let head: InferResponse<&RawValue> = serde_json::from_slice(&json)
            .map_err(|error| format!("its response cannot be read: {}", one_line(&error)))?;
        let mut outputs = Vec::new();
        for output in head.outputs.0 {
            let name = output.name;
            let wrong = |wrong| format!("its output {}: {wrong}", Quoted(&name));
            let size = output
                .parameters
                .and_then(|parameters| parameters.binary_data_size);
            // Some servers send an empty list beside the bytes.
            let data = output.data.filter(|_| size.is_none());
            let data = TensorData::take(data, size, &mut behind);
            // Heads read only floats, but a model may have further outputs.
            if output.datatype != Datatype::Fp32.name() {
                if size.is_some() {
                    data.map_err(wrong)?;
                }
                continue;
            }
            let count = element_count(output.shape.0.iter().copied());
            let count = count.ok_or("its response contains an impossible shape")?;
            let values = data.and_then(|data| data.floats(count)).map_err(wrong)?;
            outputs.push(Self {
                name,
                shape: output.shape.0,
                values,
            });
        }
        Ok(outputs)
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use bytes::Bytes;
    use rustix::time::{ClockId, clock_gettime};
    use serde_json::{Value, json};

    use super::*;

    /// The largest permitted factor between the times of a response and of one of an eighth of it.
    const MAX_RATIO: f64 = 16.0;
    /// Shorter times are noise.
    const LEAST: Duration = Duration::from_millis(1);

    fn question(as_bytes: bool) -> (Bytes, Option<usize>) {
        let question = Question {
            input: "images",
            shape: &[1, 3, 1, 1],
            values: &[0.1, 1.0, -2.5],
            outputs: &["boxes".to_owned()],
            as_bytes,
        };
        let message = question.message().unwrap();
        (message.body, message.head_length)
    }

    fn read(body: Vec<u8>, head_length: usize) -> Result<Vec<Output>, String> {
        Output::all(&Message {
            body: body.into(),
            head_length: Some(head_length),
        })
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
        let sent = TensorData::Binary(Bytes::copy_from_slice(behind));
        assert_eq!(sent.floats(3).unwrap(), [0.1, 1.0, -2.5]);
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
        let answer = read(body, head.len()).unwrap();
        let names: Vec<_> = answer.iter().map(|output| output.name.as_str()).collect();
        assert_eq!(names, ["boxes", "scores"]);
        assert!(
            answer[0].values[0].is_nan(),
            "NaN is passed on to the heads"
        );
        assert_eq!(answer[1].values, [0.5, 1.0]);
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
                "8 bytes are left",
            ),
            (output(size(4), json!(null)), &[0; 4], "needs 2"),
            (output(json!({}), json!([1])), &[], "needs 2"),
            (output(json!(null), json!(null)), &[], "neither data"),
            (json!({ "error": "no" }), &[], "cannot be read"),
        ] {
            let head = head.to_string();
            let body = [head.as_bytes(), behind].concat();
            let message = read(body, head.len()).unwrap_err();
            assert!(message.contains(part), "{message}");
        }
        assert!(read(b"{}".to_vec(), 3).unwrap_err().contains("shorter"));
    }

    /// Returns the time of the processor that this thread has used, which other programs do not
    /// change.
    fn processor_time() -> Duration {
        Duration::try_from(clock_gettime(ClockId::ThreadCPUTime)).unwrap()
    }

    #[test]
    fn reading_time_grows_linearly_with_a_response() {
        let heads = [
            "<>",
            r#"{"outputs":[<>1]}"#,
            r#"{"<>":1,"outputs":[]}"#,
            r#"{"outputs":[{"name":"<>","datatype":"FP32","shape":[1],"data":[1,2]}]}"#,
            r#"{"outputs":[{"name":"a","datatype":"FP32","shape":[<>1],"data":[1]}]}"#,
            r#"{"outputs":[{"name":"a","datatype":"FP32","shape":[9],"data":[<>1]}]}"#,
            r#"{"outputs":[{"name":"a","datatype":"FP32","shape":[100000],"data":[<>1]}]}"#,
            r#"{"outputs":[{"name":"a","datatype":"FP32","shape":[1],"parameters":{<>"a":1}}]}"#,
        ];
        let fillers = [
            "a",
            "1",
            "1,",
            "[",
            "[1],",
            "{\"a\":",
            "\"a\":1,",
            "{},",
            "\\u0041",
            "{\"name\":\"a\",\"datatype\":\"X\",\"shape\":[]},",
            "\"binary_data_size\":1,",
        ];
        for (head, filler) in heads
            .iter()
            .flat_map(|head| fillers.map(|filler| (head, filler)))
        {
            let time = |bytes: usize| {
                let head = head.replace("<>", &filler.repeat(bytes / filler.len()));
                let length = head.len();
                let body = [head.as_bytes(), &vec![0; bytes]].concat();
                let began = processor_time();
                // Most are invalid.
                let _ = read(body, length);
                processor_time().saturating_sub(began)
            };
            let ratio = || {
                let (small, large) = (time(1 << 15).max(LEAST), time(1 << 18));
                large.as_secs_f64() / small.as_secs_f64()
            };
            let least = (0..8).map(|_| ratio()).find(|ratio| *ratio <= MAX_RATIO);
            assert!(least.is_some(), "{filler:?} in {head:?}");
        }
    }
}
