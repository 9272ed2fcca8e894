//! The requested outputs of an inference request and their encoding.

use lookdown_common::text::Quoted;
use lookdown_detect::open_inference::{
    BINARY_OUTPUT,
    message::RequestedOutput,
    parameters::{Parameter, Parameters},
};

use super::tensor::{misfit, refuse_others};
use crate::api::http::problem::{Problem, ProblemKind};

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
