//! Input tensors: a name, a shape, and one frame or many numbers.

use bytes::Bytes;

use crate::{
    api::{
        problem::{Problem, ProblemKind},
        upload::{Held, UploadBudget},
    },
    fairness::BudgetShare,
    open_inference::{Datatype, binary_data, json_data},
    quoted::{Quoted, shortened},
};

/// An input tensor.
pub(super) struct Tensor {
    pub(super) name: String,
    pub(super) shape: Vec<usize>,
    pub(super) values: Values,
}

/// The values of a tensor, with their share of the memory budget.
pub(super) enum Values {
    /// The single element of a `BYTES` tensor.
    Frame(Bytes),
    /// Finite numbers, row-major.
    Numbers(Held<Vec<f32>>),
}

/// The values of a tensor as the client sent them.
pub(super) enum Sent<'a> {
    /// In the JSON.
    Json(&'a str),
    /// After the JSON.
    Binary(Bytes),
}

impl Tensor {
    /// Reads the values of a tensor within the memory budget; otherwise the error sentence states
    /// the fault.
    pub(super) fn read(
        name: String,
        datatype: &str,
        shape: &[u32],
        sent: Sent<'_>,
        budget: &UploadBudget,
    ) -> Result<Self, Problem> {
        let (datatype, count) = elements(datatype, shape).map_err(|wrong| misfit(&name, &wrong))?;
        let room = budget.take(sent.unpacked_bytes(datatype, count))?;
        let values = sent.values(datatype, count, room);
        let values = values.map_err(|wrong| misfit(&name, &wrong))?;
        let shape = shape.iter().map(|side| *side as usize).collect();
        Ok(Self {
            name,
            shape,
            values,
        })
    }
}

/// Returns the datatype and the number of elements of a tensor.
fn elements(datatype: &str, shape: &[u32]) -> Result<(Datatype, usize), String> {
    let known = datatype.parse().ok();
    let known = known.filter(|datatype| *datatype != Datatype::Int32);
    let datatype = known.ok_or_else(|| {
        let datatype = Quoted(datatype);
        format!("its datatype is {datatype}: send BYTES, FP32 or UINT8")
    })?;
    let mut sides = shape.iter().map(|side| *side as usize);
    let count = sides.try_fold(1_usize, usize::checked_mul);
    let count =
        count.ok_or_else(|| format!("its shape {shape:?} has more elements than memory"))?;
    if datatype == Datatype::Bytes && count != 1 {
        return Err(format!(
            "its shape is {shape:?}: send one frame at a time, [1]"
        ));
    }
    Ok((datatype, count))
}

impl Sent<'_> {
    /// Returns the largest memory that `count` elements need besides the body, in bytes, before
    /// they are read.
    fn unpacked_bytes(&self, datatype: Datatype, count: usize) -> usize {
        let numbers = |count| count * size_of::<f32>();
        match (datatype, self) {
            (Datatype::Bytes, Self::Json(text)) => json_data::bytes_at_most(text),
            // The values are a part of the body.
            (Datatype::Bytes, Self::Binary(_)) => 0,
            (_, Self::Json(text)) => numbers(json_data::numbers_at_most(text, count)),
            (_, Self::Binary(bytes)) => numbers(count.min(bytes.len())),
        }
    }

    fn values(self, datatype: Datatype, count: usize, room: BudgetShare) -> Result<Values, String> {
        Ok(match (datatype, self) {
            (Datatype::Bytes, Self::Json(text)) => {
                Values::Frame(Held::new(json_data::only_bytes(text)?, room).into_bytes())
            }
            (Datatype::Bytes, Self::Binary(bytes)) => {
                Values::Frame(binary_data::only_element(&bytes)?)
            }
            (_, Self::Json(text)) => {
                let numbers = json_data::numbers(text, datatype, count)?;
                Values::Numbers(Held::new(numbers, room))
            }
            (_, Self::Binary(bytes)) => {
                let numbers = binary_data::numbers(&bytes, datatype, count)?;
                Values::Numbers(Held::new(numbers, room))
            }
        })
    }
}

/// Returns the problem of an unusable tensor.
pub(super) fn misfit(name: &str, wrong: &str) -> Problem {
    Problem::of_parameter(ProblemKind::InvalidTensor, shortened(name), wrong)
}
