//! Input tensors: a name and frames.
//!
//! The requested outputs of an inference request and their encoding.

use bytes::Bytes;
use lookdown_common::text::{Quoted, shortened};
use lookdown_detect::open_inference::{
    BINARY_OUTPUT, Datatype, TensorData, element_count,
    message::{Parameter, Parameters, RequestedOutput},
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

/// The request parameter that selects bytes for all outputs.
const ALL_BINARY: &str = "binary_data_output";

/// The requested outputs and their encoding.
pub(super) struct Wanted {
    /// `true` if outputs without a parameter of their own are sent as bytes after the JSON.
    all_binary: bool,
    /// Output names with their own choice of bytes; empty for all outputs.
    named: Vec<(String, Option<bool>)>,
}

impl Wanted {
    /// Takes the parameter for all outputs out of those of a request.
    pub(super) fn read(
        parameters: &mut Parameters,
        outputs: impl Iterator<Item = RequestedOutput>,
    ) -> Result<Self, Problem> {
        let all_binary = flag(parameters, ALL_BINARY).map_err(|wrong| {
            Problem::for_parameter(ProblemKind::InvalidParameter, ALL_BINARY, &wrong)
        })?;
        let mut named: Vec<(String, Option<bool>)> = Vec::new();
        for RequestedOutput {
            name,
            mut parameters,
        } in outputs
        {
            let binary = flag(&mut parameters, BINARY_OUTPUT);
            let binary =
                binary.map_err(|wrong| misfit(&name, &format!("{BINARY_OUTPUT}: {wrong}")))?;
            refuse_others(&name, &parameters, BINARY_OUTPUT)?;
            if named.iter().any(|(given, _)| *given == name) {
                return Err(misfit(&name, "it is requested twice: request it once"));
            }
            named.push((name, binary));
        }
        Ok(Self {
            all_binary: all_binary.unwrap_or(false),
            named,
        })
    }

    /// Refuses names that the model's outputs do not have.
    pub(super) fn check(&self, outputs: &[&str]) -> Result<(), Problem> {
        let unknown = self
            .named
            .iter()
            .find(|(name, _)| !outputs.contains(&name.as_str()));
        let Some((name, _)) = unknown else {
            return Ok(());
        };
        let outputs = outputs.join(", ");
        Err(misfit(
            name,
            &format!("there is no such output: the outputs are {outputs}"),
        ))
    }

    /// Returns `None` if an output is not requested, otherwise `true` if it is sent as bytes.
    pub(super) fn how(&self, output: &str) -> Option<bool> {
        if self.named.is_empty() {
            return Some(self.all_binary);
        }
        let mut named = self.named.iter();
        let (_, binary) = named.find(|(name, _)| name == output)?;
        Some(binary.unwrap_or(self.all_binary))
    }
}

fn flag(parameters: &mut Parameters, name: &str) -> Result<Option<bool>, String> {
    match parameters.take(name) {
        None => Ok(None),
        Some(Parameter::Flag(value)) => Ok(Some(value)),
        Some(Parameter::Number(other) | Parameter::Text(other)) => {
            Err(format!("{} is not true or false", Quoted(&other)))
        }
    }
}
