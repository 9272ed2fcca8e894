//! Inference responses: JSON with the tensors inside or as bytes after it.

use axum::{
    http::{HeaderName, HeaderValue, header::CONTENT_TYPE},
    response::{AppendHeaders, IntoResponse, Response},
};
use bytes::{Bytes, BytesMut};
use serde::Serialize;
use utoipa::ToSchema;

use super::wanted::Wanted;
use crate::{
    api::http::problem::Problem,
    open_inference::{Datatype, HEAD_LENGTH, binary_data},
};

/// An inference response.
pub(super) struct InferAnswer {
    body: Bytes,
    /// The length of the JSON, if bytes follow it.
    head: Option<usize>,
    /// Additional headers, such as the durations of the stages.
    pub(super) facts: Vec<(HeaderName, HeaderValue)>,
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
    /// The single element of a `BYTES` tensor.
    Text(Bytes),
}

/// The model that responds.
pub(super) struct Answerer<'a> {
    pub(super) model: &'a str,
    pub(super) version: &'a str,
    pub(super) id: Option<&'a str>,
}

#[derive(Serialize)]
struct Head<'a> {
    model_name: &'a str,
    model_version: &'a str,
    #[serde(skip_serializing_if = "Option::is_none")]
    id: Option<&'a str>,
    outputs: Vec<HeadOutput<'a>>,
}

#[derive(Serialize)]
struct HeadOutput<'a> {
    name: &'static str,
    datatype: Datatype,
    shape: &'a [usize],
    #[serde(skip_serializing_if = "Option::is_none")]
    parameters: Option<BinarySize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    data: Option<Data<'a>>,
}

/// Parameters of an output that is sent as bytes.
#[derive(Serialize, ToSchema)]
pub(in crate::api) struct BinarySize {
    /// Number of bytes of this output after the JSON, in the order of the outputs.
    binary_data_size: usize,
}

#[derive(Serialize)]
#[serde(untagged)]
enum Data<'a> {
    Floats(&'a [f32]),
    Integers(&'a [i32]),
    Text([&'a str; 1]),
}

impl OutputValues {
    fn datatype(&self) -> Datatype {
        match self {
            Self::Floats(_) => Datatype::Fp32,
            Self::Integers(_) => Datatype::Int32,
            Self::Text(_) => Datatype::Bytes,
        }
    }

    fn bytes(&self) -> Result<Bytes, Problem> {
        Ok(match self {
            Self::Floats(values) => values
                .iter()
                .flat_map(|value| value.to_le_bytes())
                .collect(),
            Self::Integers(values) => values
                .iter()
                .flat_map(|value| value.to_le_bytes())
                .collect(),
            Self::Text(text) => binary_data::element(text)
                .ok_or_else(|| Problem::internal(anyhow::anyhow!("a report of 4 GiB")))?,
        })
    }

    fn data(&self) -> Result<Data<'_>, Problem> {
        Ok(match self {
            Self::Floats(values) => Data::Floats(values),
            Self::Integers(values) => Data::Integers(values),
            Self::Text(text) => Data::Text([str::from_utf8(text).map_err(Problem::internal)?]),
        })
    }
}

impl InferAnswer {
    /// Writes the requested outputs.
    pub(super) fn write(
        answerer: &Answerer<'_>,
        outputs: &[Output],
        wanted: &Wanted,
    ) -> Result<Self, Problem> {
        let mut behind = BytesMut::new();
        let mut is_binary = false;
        let mut heads = Vec::with_capacity(outputs.len());
        for output in outputs {
            let Some(binary) = wanted.how(output.name) else {
                continue;
            };
            let mut head = HeadOutput {
                name: output.name,
                datatype: output.values.datatype(),
                shape: &output.shape,
                parameters: None,
                data: None,
            };
            if binary {
                is_binary = true;
                let bytes = output.values.bytes()?;
                head.parameters = Some(BinarySize {
                    binary_data_size: bytes.len(),
                });
                behind.extend_from_slice(&bytes);
            } else {
                head.data = Some(output.values.data()?);
            }
            heads.push(head);
        }
        let head = Head {
            model_name: answerer.model,
            model_version: answerer.version,
            id: answerer.id,
            outputs: heads,
        };
        let mut body = serde_json::to_vec(&head).map_err(Problem::internal)?;
        let head = is_binary.then_some(body.len());
        body.extend_from_slice(&behind);
        Ok(Self {
            body: body.into(),
            head,
            facts: Vec::new(),
        })
    }
}

impl IntoResponse for InferAnswer {
    fn into_response(self) -> Response {
        let media_type = match self.head {
            Some(_) => "application/octet-stream",
            None => "application/json",
        };
        let mut response = (AppendHeaders(self.facts), self.body).into_response();
        let headers = response.headers_mut();
        headers.insert(CONTENT_TYPE, HeaderValue::from_static(media_type));
        if let Some(head) = self.head {
            headers.insert(
                HeaderName::from_static(HEAD_LENGTH),
                HeaderValue::from(head),
            );
        }
        response
    }
}
