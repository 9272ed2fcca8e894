//! Tensors as they are sent: a name, a shape, and one frame or many numbers.

use bytes::Bytes;

use super::shown;
use crate::{
    api::problem::{Problem, ProblemKind},
    open_inference::{Datatype, binary_data, json_data},
};

/// An input as it was sent.
#[derive(Debug, PartialEq)]
pub(super) struct Tensor {
    pub(super) name: String,
    pub(super) shape: Vec<usize>,
    pub(super) values: Values,
}

/// What a tensor holds.
#[derive(Debug, PartialEq)]
pub(super) enum Values {
    /// The one element of a tensor of `BYTES`.
    Frame(Bytes),
    /// Finite numbers, row-major.
    Numbers(Vec<f32>),
}

/// A tensor's values as they were sent.
pub(super) enum Sent<'a> {
    /// In the JSON.
    Json(&'a str),
    /// Behind the JSON.
    Binary(Bytes),
}

impl Tensor {
    /// Reads the values of a tensor; the sentence says what is wrong with them.
    pub(super) fn read(
        name: String,
        datatype: &str,
        shape: &[u32],
        sent: Sent<'_>,
    ) -> Result<Self, Problem> {
        let values = read(datatype, shape, sent);
        let values = values.map_err(|wrong| misfit(&name, &wrong))?;
        let shape = shape.iter().map(|side| *side as usize).collect();
        Ok(Self {
            name,
            shape,
            values,
        })
    }
}

fn read(datatype: &str, shape: &[u32], sent: Sent<'_>) -> Result<Values, String> {
    let known = Datatype::named(datatype).filter(|datatype| *datatype != Datatype::Int32);
    let datatype = known.ok_or_else(|| {
        let datatype = shown(datatype);
        format!("its datatype is {datatype:?}: BYTES, FP32 and UINT8 are read")
    })?;
    let mut sides = shape.iter().map(|side| *side as usize);
    let count = sides.try_fold(1_usize, usize::checked_mul);
    let count =
        count.ok_or_else(|| format!("its shape {shape:?} has more elements than memory"))?;
    let values = match (datatype, sent) {
        (Datatype::Bytes, _) if count != 1 => {
            return Err(format!(
                "its shape is {shape:?}: one frame is taken at a time, [1]"
            ));
        }
        (Datatype::Bytes, Sent::Json(text)) => Values::Frame(json_data::only_bytes(text)?),
        (Datatype::Bytes, Sent::Binary(bytes)) => Values::Frame(binary_data::only_element(&bytes)?),
        (_, Sent::Json(text)) => Values::Numbers(json_data::numbers(text, datatype, count)?),
        (_, Sent::Binary(bytes)) => Values::Numbers(binary_data::numbers(&bytes, datatype, count)?),
    };
    Ok(values)
}

/// What the sender of a tensor that cannot be used is told.
pub(super) fn misfit(name: &str, wrong: &str) -> Problem {
    let name = shown(name);
    Problem::new(ProblemKind::InvalidTensor, format!("{name}: {wrong}"))
}
