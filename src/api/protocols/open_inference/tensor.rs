//! Input tensors: a name, a shape, and frames or numbers.

use bytes::Bytes;
use lookdown_common::text::{Quoted, shortened};
use lookdown_detect::{
    fairness::BudgetShare,
    open_inference::{Datatype, TensorData, element_count, parameters::Parameters},
};

use crate::api::http::{
    problem::{Problem, ProblemKind},
    request_body::{Held, UploadBudget},
};

/// An input tensor.
pub(super) struct Tensor {
    pub(super) name: String,
    pub(super) shape: Vec<usize>,
    pub(super) values: Values,
}

/// Largest number of frames in a request.
pub(super) const MAX_FRAMES: usize = 16;
/// The prefix of the parameters of tensors in the shared memory of the server's machine.
const SHARED_MEMORY: &str = "shared_memory";

/// The values of a tensor, with their share of the memory budget.
pub(super) enum Values {
    /// The elements of a `BYTES` tensor, at least one.
    Frames(Vec<Bytes>),
    /// Finite numbers, row-major.
    Numbers(Held<Vec<f32>>),
}

impl Tensor {
    /// Reads the values of a tensor within the memory budget; otherwise the error sentence states
    /// the fault.
    pub(super) fn read(
        name: String,
        datatype: &str,
        shape: &[u32],
        sent: TensorData<'_>,
        budget: &UploadBudget,
    ) -> Result<Self, Problem> {
        let (datatype, count) = elements(datatype, shape).map_err(|wrong| misfit(&name, &wrong))?;
        let room = budget.take(sent.unpacked_bytes(datatype, count))?;
        let values = unpacked(sent, datatype, count, room);
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
    let count = element_count(shape.iter().map(|side| *side as usize));
    let count =
        count.ok_or_else(|| format!("its shape {shape:?} has more elements than memory"))?;
    if datatype == Datatype::Bytes && !(1..=MAX_FRAMES).contains(&count) {
        return Err(format!(
            "its shape is {shape:?}: send [1] to [{MAX_FRAMES}], the number of frames"
        ));
    }
    Ok((datatype, count))
}

/// Reads the values of a tensor, which use the memory of `room`.
fn unpacked(
    sent: TensorData<'_>,
    datatype: Datatype,
    count: usize,
    room: BudgetShare,
) -> Result<Values, String> {
    Ok(match datatype {
        Datatype::Bytes => Values::Frames(Held::new(sent.elements(count)?, room).into_elements()),
        _ => Values::Numbers(Held::new(sent.numbers(datatype, count)?, room)),
    })
}

/// Returns the problem of an unusable tensor.
pub(super) fn misfit(name: &str, wrong: &str) -> Problem {
    Problem::of_parameter(ProblemKind::InvalidTensor, shortened(name), wrong)
}

/// Refuses the parameters of a tensor that are left when the `known` one is taken.
pub(super) fn refuse_others(
    tensor: &str,
    parameters: &Parameters,
    known: &str,
) -> Result<(), Problem> {
    let Some((name, _)) = parameters.0.first() else {
        return Ok(());
    };
    let wrong = if name.starts_with(SHARED_MEMORY) {
        "shared memory is not supported: send tensors in the body".to_owned()
    } else {
        let name = Quoted(name);
        format!("there is no tensor parameter {name}: use {known}")
    };
    Err(misfit(tensor, &wrong))
}
