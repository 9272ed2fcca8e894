//! Input tensors: a name and frames.

use bytes::Bytes;
use lookdown_common::text::{Quoted, shortened};
use lookdown_detect::open_inference::{
    Datatype, TensorData, element_count, parameters::Parameters,
};

use crate::api::http::{
    problem::{Problem, ProblemKind},
    request_body::{Held, UploadBudget},
};

/// An input tensor.
pub(super) struct Tensor {
    pub(super) name: String,
    /// The elements, at least one, with their share of the memory budget.
    pub(super) frames: Vec<Bytes>,
}

/// Largest number of frames in a request.
pub(super) const MAX_FRAMES: usize = 16;
/// The prefix of the parameters of tensors in the shared memory of the server's machine.
const SHARED_MEMORY: &str = "shared_memory";

impl Tensor {
    /// Reads the frames of a tensor within the memory budget; otherwise the error sentence states
    /// the fault.
    pub(super) fn read(
        name: String,
        datatype: &str,
        shape: &[u32],
        sent: TensorData<'_>,
        budget: &UploadBudget,
    ) -> Result<Self, Problem> {
        let count = frame_count(datatype, shape).map_err(|wrong| misfit(&name, &wrong))?;
        let room = budget.take(sent.unpacked_bytes())?;
        let elements = sent
            .elements(count)
            .map_err(|wrong| misfit(&name, &wrong))?;
        Ok(Self {
            name,
            frames: Held::new(elements, room).into_elements(),
        })
    }
}

/// Returns the number of elements of a tensor of `BYTES`.
fn frame_count(datatype: &str, shape: &[u32]) -> Result<usize, String> {
    if datatype != Datatype::Bytes.name() {
        let datatype = Quoted(datatype);
        return Err(format!(
            "its datatype is {datatype}: send BYTES, encoded frames"
        ));
    }
    let count = element_count(shape.iter().map(|side| *side as usize));
    let count =
        count.ok_or_else(|| format!("its shape {shape:?} has more elements than memory"))?;
    if !(1..=MAX_FRAMES).contains(&count) {
        return Err(format!(
            "its shape is {shape:?}: send [1] to [{MAX_FRAMES}], the number of frames"
        ));
    }
    Ok(count)
}

/// Returns the problem of an unusable tensor.
pub(super) fn misfit(name: &str, wrong: &str) -> Problem {
    Problem::for_parameter(ProblemKind::InvalidTensor, shortened(name), wrong)
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
