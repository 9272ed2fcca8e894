//! The variants to evaluate: groups of parameters that share an inference per image.

use lookdown_detect::{
    detection::Refinement,
    parameters::{DetectParameters, ParameterError, Profile},
};
use strum::VariantArray;

use super::Arguments;

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
        let groups = PAPER.iter();
        let groups = groups.map(|(profile, refinements)| group(arguments, *profile, refinements));
        return groups.collect();
    }
    let profiles = match &arguments.profile[..] {
        [] => &[Profile::default()],
        given => given,
    };
    let refinements = match &arguments.refine[..] {
        [] => Refinement::VARIANTS,
        given => given,
    };
    let groups = profiles.iter();
    let groups = groups.map(|profile| group(arguments, *profile, refinements));
    groups.collect()
}

fn group(
    arguments: &Arguments,
    profile: Profile,
    refinements: &[Refinement],
) -> Result<Vec<DetectParameters>, ParameterError> {
    let parse = |refinement: &Refinement| {
        let given = [
            ("profile", Some(profile.name())),
            ("refine", Some(refinement.name())),
            ("model", arguments.model.as_deref()),
            ("score_threshold", Some(arguments.score_threshold.as_str())),
            ("iou_threshold", arguments.iou_threshold.as_deref()),
            ("sigma", arguments.sigma.as_deref()),
        ];
        let pairs = given.into_iter();
        DetectParameters::parse(pairs.filter_map(|(name, value)| Some((name, value?))))
    };
    refinements.iter().map(parse).collect()
}
