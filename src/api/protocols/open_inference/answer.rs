//! Inference responses: JSON with the tensors inside or as bytes after it.

use axum::{
    http::{HeaderName, HeaderValue, header::CONTENT_TYPE},
    response::{AppendHeaders, IntoResponse, Response},
};
use bytes::Bytes;
use lookdown_detect::open_inference::{
    HEAD_LENGTH, TensorValues,
    bounded_json::Entries,
    message::{InferResponse, Message, OutputParameters, OutputTensor},
};

use super::{
    own_metadata::{FRAME_MODEL, FRAME_MODEL_VERSION},
    tensor::Wanted,
};
use crate::api::http::problem::Problem;

/// An inference response.
pub(super) struct InferAnswer {
    message: Message,
    /// The headers about a report.
    pub(super) report_headers: Vec<(HeaderName, HeaderValue)>,
}

/// An output tensor.
pub(super) struct Output {
    pub(super) name: &'static str,
    pub(super) shape: Vec<usize>,
    pub(super) values: OutputValues,
}

/// The values of an output, row-major.
pub(super) enum OutputValues {
    Floats(Vec<f32>),
    Integers(Vec<i32>),
    /// The elements of a `BYTES` tensor.
    Texts(Vec<Bytes>),
}

impl OutputValues {
    fn as_tensor(&self) -> Result<TensorValues<'_>, Problem> {
        Ok(match self {
            Self::Floats(values) => TensorValues::Floats(values),
            Self::Integers(values) => TensorValues::Integers(values),
            Self::Texts(texts) => {
                let texts = texts.iter().map(|text| str::from_utf8(text));
                let texts = texts.collect::<Result<_, _>>();
                TensorValues::Texts(texts.map_err(Problem::internal)?)
            }
        })
    }
}

impl InferAnswer {
    /// Writes the requested outputs; `id` is that of the request.
    pub(super) fn write(
        id: Option<String>,
        outputs: &[Output],
        wanted: &Wanted,
    ) -> Result<Self, Problem> {
        let mut behind = Vec::new();
        let mut written = Vec::with_capacity(outputs.len());
        for output in outputs {
            let Some(binary) = wanted.how(output.name) else {
                continue;
            };
            let values = output.values.as_tensor()?;
            if binary {
                behind.push(values.clone());
            }
            written.push(OutputTensor {
                name: output.name.to_owned(),
                datatype: values.datatype().to_string(),
                shape: Entries(output.shape.clone()),
                parameters: binary.then(|| OutputParameters {
                    binary_data_size: Some(values.byte_count()),
                }),
                data: (!binary).then_some(values),
            });
        }
        let response = InferResponse {
            model_name: FRAME_MODEL.to_owned(),
            model_version: Some(FRAME_MODEL_VERSION.to_owned()),
            id,
            outputs: Entries(written),
        };
        let message = Message::write(&response, &behind).map_err(Problem::internal)?;
        Ok(Self {
            message,
            report_headers: Vec::new(),
        })
    }
}

impl IntoResponse for InferAnswer {
    fn into_response(self) -> Response {
        let Message { body, head_length } = self.message;
        let media_type = match head_length {
            Some(_) => "application/octet-stream",
            None => "application/json",
        };
        let mut response = (AppendHeaders(self.report_headers), body).into_response();
        let headers = response.headers_mut();
        headers.insert(CONTENT_TYPE, HeaderValue::from_static(media_type));
        if let Some(length) = head_length {
            headers.insert(
                HeaderName::from_static(HEAD_LENGTH),
                HeaderValue::from(length),
            );
        }
        response
    }
}
