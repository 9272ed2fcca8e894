//! A parsed inference request: its inputs, its requested outputs and its parameters.
//!
//! Decompression of the body of an inference request, `Content-Encoding: gzip` or `deflate`, within
//! the limits of a body.

use std::io::{ErrorKind, Read};

use axum::http::{HeaderMap, header::CONTENT_ENCODING};
use bytes::Bytes;
use flate2::read::{MultiGzDecoder, ZlibDecoder};
use lookdown_common::text::{Quoted, shortened};
use lookdown_detect::open_inference::{
    BINARY_SIZE, HEAD_LENGTH, TensorData,
    message::{InputTensor, Message, Parameter, Parameters, Table, read_request},
};
use serde_json::value::RawValue;

use super::tensor::{Tensor, Wanted, misfit, refuse_others};
use crate::api::http::{
    problem::{Problem, ProblemKind},
    request_body::{Held, UploadBudget},
};

/// Longest ID of a request, characters.
pub(super) const MAX_ID_CHARS: usize = 256;
/// Longest description of a JSON error, characters: it may quote the request.
const MAX_MESSAGE_CHARS: usize = 300;

/// An inference request.
pub(super) struct InferRequest {
    pub(super) id: Option<String>,
    /// The parameters except those of the protocol.
    pub(super) parameters: Vec<(String, Parameter)>,
    pub(super) inputs: Vec<Tensor>,
    pub(super) wanted: Wanted,
}

impl InferRequest {
    /// Reads a request: JSON, or as many bytes of JSON as `Inference-Header-Content-Length` states,
    /// followed by the bytes of tensors. Unpacked tensors have their own share of the budget.
    pub(super) fn read(
        headers: &HeaderMap,
        body: &Bytes,
        budget: &UploadBudget,
    ) -> Result<Self, Problem> {
        let (json, mut behind) = split(headers, body)?;
        let mut head = read_request(&json).map_err(|error| {
            let message: String = error.to_string().chars().take(MAX_MESSAGE_CHARS).collect();
            malformed(&format!(
                "the JSON of the request cannot be used: {message}"
            ))
        })?;
        let inputs = head.inputs.0.into_iter();
        let inputs = inputs.map(|Table(input)| read_input(input, &mut behind, budget));
        let inputs = inputs.collect::<Result<Vec<_>, _>>()?;
        if !behind.is_empty() {
            let spare = behind.len();
            return Err(malformed(&format!(
                "{spare} bytes follow that belong to no input: {BINARY_SIZE} states the number of each input"
            )));
        }
        if let Some(id) = &head.id
            && id.chars().count() > MAX_ID_CHARS
        {
            let fault = format!("it has more than {MAX_ID_CHARS} characters");
            let problem = Problem::for_parameter(ProblemKind::InvalidParameter, "id", &fault);
            return Err(problem);
        }
        let outputs = head.outputs.map_or_else(Vec::new, |outputs| outputs.0);
        let outputs = outputs.into_iter().map(|Table(output)| output);
        let wanted = Wanted::read(&mut head.parameters, outputs)?;
        Ok(Self {
            id: head.id,
            parameters: head.parameters.0,
            inputs,
            wanted,
        })
    }

    /// Returns the only input of a model.
    pub(super) fn only_input(&mut self, name: &str) -> Result<Tensor, Problem> {
        let mut inputs = self.inputs.drain(..);
        match (inputs.next(), inputs.next()) {
            (Some(only), None) if only.name == name => Ok(only),
            (None, _) => Err(misfit("inputs", &format!("{name} is missing"))),
            (Some(other), None) => {
                let wrong = format!("there is no such input: the only input is {name}");
                Err(misfit(&other.name, &wrong))
            }
            (Some(_), Some(_)) => Err(misfit(
                "inputs",
                &format!("{name} is the only input: send it once"),
            )),
        }
    }
}

/// Splits a body into its JSON and the bytes after it.
fn split(headers: &HeaderMap, body: &Bytes) -> Result<(Bytes, Bytes), Problem> {
    let Some(stated) = headers.get(HEAD_LENGTH) else {
        return Ok((body.clone(), Bytes::new()));
    };
    let length = stated.to_str().ok().and_then(|stated| stated.parse().ok());
    let message = length.map(|length| Message {
        body: body.clone(),
        head_length: Some(length),
    });
    message.and_then(|message| message.split()).ok_or_else(|| {
        let (stated, sent) = (String::from_utf8_lossy(stated.as_bytes()), body.len());
        let stated = Quoted(&stated);
        malformed(&format!(
            "{HEAD_LENGTH} is {stated}, and the body has {sent} bytes: it must be the length of the JSON \
             in it"
        ))
    })
}

/// Reads an input, whose values may be the next bytes after the JSON.
fn read_input(
    mut input: InputTensor<&RawValue>,
    behind: &mut Bytes,
    budget: &UploadBudget,
) -> Result<Tensor, Problem> {
    if input.name.is_empty() {
        let wrong = "an input has no name: send the name that the metadata of the model have";
        return Err(misfit("inputs", wrong));
    }
    let size = binary_size(&input.name, &mut input.parameters)?;
    let sent = TensorData::take(input.data, size, behind);
    let sent = sent.map_err(|wrong| misfit(&input.name, &wrong))?;
    Tensor::read(input.name, &input.datatype, &input.shape.0, sent, budget)
}

fn binary_size(tensor: &str, parameters: &mut Parameters) -> Result<Option<usize>, Problem> {
    let size = match parameters.take(BINARY_SIZE) {
        Some(Parameter::Number(number)) => number.parse().map(Some).map_err(|_| number),
        Some(other) => Err(format!("{other:?}")),
        None => Ok(None),
    };
    let size = size.map_err(|stated| {
        let wrong = format!(
            "its {BINARY_SIZE} is {}: give a number of bytes",
            shortened(&stated)
        );
        misfit(tensor, &wrong)
    })?;
    refuse_others(tensor, parameters, BINARY_SIZE)?;
    Ok(size)
}

pub(super) fn malformed(detail: &str) -> Problem {
    Problem::new(ProblemKind::MalformedRequest, detail)
}

/// The number of bytes that are decompressed at a time.
const CHUNK_BYTES: usize = 64 * 1024;

/// Returns the body without its encoding. A decompressed body has its own share of the budget, and
/// at most `max_bytes`.
pub(super) fn decompressed(
    headers: &HeaderMap,
    body: Bytes,
    max_bytes: usize,
    budget: &UploadBudget,
) -> Result<Bytes, Problem> {
    let Some(encoding) = headers.get(CONTENT_ENCODING) else {
        return Ok(body);
    };
    match encoding.as_bytes().to_ascii_lowercase().as_slice() {
        b"identity" => Ok(body),
        b"gzip" => read(MultiGzDecoder::new(&*body), max_bytes, budget),
        b"deflate" => read(ZlibDecoder::new(&*body), max_bytes, budget),
        other => {
            let other = String::from_utf8_lossy(other);
            let other = Quoted(&other);
            Err(malformed(&format!(
                "Content-Encoding is {other}: send gzip, deflate or no compression"
            )))
        }
    }
}

fn read(mut decoder: impl Read, max_bytes: usize, budget: &UploadBudget) -> Result<Bytes, Problem> {
    let mut bytes = Vec::new();
    let mut chunk = vec![0; CHUNK_BYTES];
    let mut share = budget.take(0)?;
    loop {
        let length = match decoder.read(&mut chunk) {
            Ok(0) => break,
            Ok(length) => length,
            Err(error) if error.kind() == ErrorKind::Interrupted => continue,
            Err(error) => {
                return Err(malformed(&format!(
                    "the body cannot be decompressed ({error}): send it as Content-Encoding states"
                )));
            }
        };
        if bytes.len() + length > max_bytes {
            let detail = format!(
                "the decompressed body is larger than {max_bytes} bytes: send smaller images or \
                 raise server.max_body_bytes"
            );
            return Err(Problem::new(ProblemKind::BodyTooLarge, detail));
        }
        share.merge(budget.take(length)?);
        bytes.extend_from_slice(&chunk[..length]);
    }
    Ok(Held::new(Bytes::from(bytes), share).into_bytes())
}
