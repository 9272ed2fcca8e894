//! The variants to evaluate: groups of parameters that share an inference per image.

use anyhow::{Context, bail};

use super::Arguments;
use crate::{
    detection::Refinement,
    pipeline::{DetectParameters, ParameterError, Profile},
};

/// The rows of the paper's table: its method with its three refinements, and the detector on the
/// fisheye frame itself (`Omni`).
const PAPER: [(Profile, &[Refinement]); 2] = [
    (
        Profile::Paper,
        &[
            Refinement::Nms,
            Refinement::SoftNmsLinear,
            Refinement::SoftNmsGaussian,
        ],
    ),
    (Profile::Direct, &[Refinement::Nms]),
];

/// One group per profile.
pub(super) fn groups(arguments: &Arguments) -> Result<Vec<Vec<DetectParameters>>, ParameterError> {
    if arguments.paper {
        let groups = PAPER.iter().map(|(profile, refinements)| {
            let names = refinements.iter().map(|refinement| refinement.name());
            group(arguments, profile.name(), names)
        });
        return groups.collect();
    }
    let default = [Profile::default().name().to_owned()];
    let profiles = match &arguments.profile[..] {
        [] => &default,
        given => given,
    };
    let groups = profiles.iter().map(|profile| {
        if arguments.refine.is_empty() {
            group(arguments, profile, Refinement::ALL.map(Refinement::name))
        } else {
            group(
                arguments,
                profile,
                arguments.refine.iter().map(String::as_str),
            )
        }
    });
    groups.collect()
}

/// The profile of a sweep with NMS, whose parameters the sweep varies.
pub(super) fn base_of_sweep(arguments: &Arguments) -> anyhow::Result<DetectParameters> {
    let profile = match &arguments.profile[..] {
        [] => Profile::Paper.name(),
        [one] => one,
        _ => bail!("--sweep: takes one --profile"),
    };
    let mut group = group(arguments, profile, [Refinement::Nms.name()])?;
    group.pop().context("--sweep: no refinement")
}

fn group<'a>(
    arguments: &Arguments,
    profile: &str,
    refinements: impl IntoIterator<Item = &'a str>,
) -> Result<Vec<DetectParameters>, ParameterError> {
    let parse = |refinement| {
        let given = [
            ("profile", Some(profile)),
            ("refine", Some(refinement)),
            ("model", arguments.model.as_deref()),
            ("score_threshold", Some(arguments.score_threshold.as_str())),
            ("iou_threshold", arguments.iou_threshold.as_deref()),
            ("sigma", arguments.sigma.as_deref()),
        ];
        let pairs = given
            .into_iter()
            .filter_map(|(name, value)| Some((name, value?)));
        // The threshold is always among the pairs, so the default is never used.
        DetectParameters::parse(pairs, 0.0)
    };
    refinements.into_iter().map(parse).collect()
}
