//! Which outputs a request wants, and how.

use super::{
    request::refuse_others,
    request_head::{OutputHead, Parameter, Parameters},
    tensor::misfit,
};
use crate::{
    api::problem::{Problem, ProblemKind},
    quoted::Quoted,
};

/// Makes all outputs come as bytes.
const ALL_BINARY: &str = "binary_data_output";
/// Says of one output whether it comes as bytes.
const BINARY: &str = "binary_data";

/// Which outputs a request wants, and how.
pub(super) struct Wanted {
    /// Whether outputs of which nothing else is said come as bytes behind the JSON.
    all_binary: bool,
    /// Names, and whether they are to come as bytes; all outputs when there are none.
    named: Vec<(String, Option<bool>)>,
}

impl Wanted {
    /// Takes the parameter that speaks of all outputs out of a request's.
    pub(super) fn read(
        parameters: &mut Parameters,
        outputs: impl Iterator<Item = OutputHead>,
    ) -> Result<Self, Problem> {
        let all_binary = flag(parameters, ALL_BINARY).map_err(|wrong| {
            Problem::of_parameter(ProblemKind::InvalidParameter, ALL_BINARY, &wrong)
        })?;
        let mut named: Vec<(String, Option<bool>)> = Vec::new();
        for OutputHead {
            name,
            mut parameters,
        } in outputs
        {
            let binary = flag(&mut parameters, BINARY);
            let binary = binary.map_err(|wrong| misfit(&name, &format!("{BINARY}: {wrong}")))?;
            refuse_others(&name, &parameters, BINARY)?;
            if named.iter().any(|(given, _)| *given == name) {
                return Err(misfit(&name, "it is asked for twice: ask once"));
            }
            named.push((name, binary));
        }
        Ok(Self {
            all_binary: all_binary.unwrap_or(false),
            named,
        })
    }

    /// Refuses names that are not among those of a model's outputs.
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
            &format!("there is no such output: there are {outputs}"),
        ))
    }

    /// Whether an output is wanted, and then whether it is to come as bytes.
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
