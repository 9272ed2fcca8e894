//! Request parameters as flags: the same names in kebab-case and the same checks, from the tables
//! of their specifications.

use std::{path::Path, str::FromStr, sync::Arc};

use anyhow::Context;
use clap::{
    Arg, ArgMatches, Args, Command, FromArgMatches,
    builder::{PossibleValuesParser, TypedValueParser},
};
use lookdown_calibration::{Calibration, CalibrationId};
use lookdown_detect::{
    parameters::{
        DetectParameters, Interface, ParameterDefault, ParameterError, ParameterKind, ParameterSpec,
    },
    pipeline::CalibrationLookup,
};
use strum::VariantNames;

use crate::{
    annotated_image::AnnotationOptions, app::open_calibrations, cli::complete, settings::Settings,
};

/// The flag that the flags of an annotated image need.
const ANNOTATE: &str = "annotate";

/// The parameters of a table that are given as flags.
#[derive(Debug, Default, PartialEq)]
pub(super) struct Flags<const IS_ANNOTATION: bool>(Given);

/// The parameters that every detection takes, but the calibration.
pub(super) type ParameterFlags = Flags<false>;

/// The parameters of the annotated image that `--annotate` writes.
pub(super) type AnnotationFlags = Flags<true>;

/// Names and values of parameters.
type Given = Vec<(&'static str, String)>;

impl ParameterFlags {
    /// Checks the parameters.
    ///
    /// # Errors
    /// [`ParameterError`] when a value cannot be used.
    pub(super) fn check(
        &self,
        calibration: Option<&str>,
    ) -> Result<DetectParameters, ParameterError> {
        let calibration = calibration.map(|id| ("calibration", id));
        DetectParameters::parse(pairs(&self.0).chain(calibration))
    }

    /// Like [`Self::check`], with another default of a parameter.
    ///
    /// # Errors
    /// [`ParameterError`] when a value cannot be used.
    pub(super) fn check_or(
        &self,
        calibration: Option<&str>,
        (name, value): (&'static str, &str),
    ) -> Result<DetectParameters, ParameterError> {
        let mut given = self.0.clone();
        if given.iter().all(|(other, _)| *other != name) {
            given.push((name, value.to_owned()));
        }
        Self(given).check(calibration)
    }
}

impl AnnotationFlags {
    /// Checks the parameters.
    ///
    /// # Errors
    /// [`ParameterError`] when a value cannot be used.
    pub(super) fn check(&self) -> Result<AnnotationOptions, ParameterError> {
        AnnotationOptions::parse(pairs(&self.0))
    }
}

impl<const IS_ANNOTATION: bool> Flags<IS_ANNOTATION> {
    fn offered() -> impl Iterator<Item = &'static ParameterSpec> {
        offered(if IS_ANNOTATION {
            AnnotationOptions::TABLE
        } else {
            DetectParameters::TABLE
        })
    }
}

impl<const IS_ANNOTATION: bool> Args for Flags<IS_ANNOTATION> {
    fn augment_args(command: Command) -> Command {
        let flag = |spec| {
            let flag = flag(spec);
            if IS_ANNOTATION {
                flag.requires(ANNOTATE)
            } else {
                flag
            }
        };
        command.args(Self::offered().map(flag))
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

impl<const IS_ANNOTATION: bool> FromArgMatches for Flags<IS_ANNOTATION> {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let given = Self::offered().filter_map(|spec| {
            let values: Vec<_> = matches.get_many::<String>(spec.name)?.cloned().collect();
            Some((spec.name, values.join(",")))
        });
        Ok(Self(given.collect()))
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}

/// Reads the calibration of `--calibration`: a file, or the ID of one in the calibration folder.
pub(super) fn named_calibration(
    named: &str,
    settings: &Settings,
) -> anyhow::Result<Arc<Calibration>> {
    let path = Path::new(named);
    if path.is_file() {
        return Ok(Arc::new(Calibration::read(path)?));
    }
    let strange = || format!("--calibration: {named:?} is neither a file nor a calibration's ID");
    let id: CalibrationId = named.parse().with_context(strange)?;
    open_calibrations(settings)?.get(&id)?.with_context(|| {
        format!("--calibration: there is no calibration {named:?} in calibrations.path")
    })
}

/// Parses the names of an enum, and lists them in the help and in completions.
pub(super) fn one_of<T>() -> impl TypedValueParser<Value = T>
where
    T: FromStr<Err = strum::ParseError> + VariantNames + Clone + Send + Sync + 'static,
{
    PossibleValuesParser::new(T::VARIANTS).try_map(|name| name.parse::<T>())
}

fn offered(table: &'static [ParameterSpec]) -> impl Iterator<Item = &'static ParameterSpec> {
    let table = table.iter();
    table.filter(|spec| spec.is_offered_by(Interface::CommandLine))
}

fn flag(spec: &ParameterSpec) -> Arg {
    let summary = spec.help.split_once(". ");
    let summary = summary.map_or(spec.help.trim_end_matches('.'), |(summary, _)| summary);
    let default = match spec.default {
        ParameterDefault::Value(default) | ParameterDefault::Described(default) => {
            format!(" [default: {default}]")
        }
        ParameterDefault::None => String::new(),
    };
    let mut flag = Arg::new(spec.name)
        .long(spec.name.replace('_', "-"))
        .allow_hyphen_values(true)
        .help(format!("{summary}{default}"))
        .long_help(format!("{}{default}", spec.help));
    if spec.name == DetectParameters::MODEL {
        flag = flag.add(complete::model_completer());
    }
    match spec.kind {
        ParameterKind::Choice(names) => flag
            .value_name("NAME")
            .value_parser(PossibleValuesParser::new(names)),
        ParameterKind::Choices { names, none } => {
            let names = names.iter().copied().chain([none]);
            flag.value_name("NAME,NAME")
                .value_delimiter(',')
                .value_parser(PossibleValuesParser::new(names))
        }
        ParameterKind::Text | ParameterKind::Name { .. } | ParameterKind::Pattern { .. } => {
            flag.value_name("NAME")
        }
        ParameterKind::Switch => flag
            .value_name("BOOL")
            .value_parser(PossibleValuesParser::new(["true", "false"])),
        ParameterKind::Whole { .. } | ParameterKind::Fraction | ParameterKind::Positive => {
            flag.value_name("NUMBER")
        }
        ParameterKind::Time => flag.value_name("TIME"),
    }
}

fn pairs<'a>(given: &'a [(&'static str, String)]) -> impl Iterator<Item = (&'a str, &'a str)> {
    given.iter().map(|(name, value)| (*name, value.as_str()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parsed<F: Args>(words: &[String]) -> Result<F, clap::Error> {
        let annotate = Arg::new(ANNOTATE).long(ANNOTATE);
        let command = F::augment_args(Command::new("lookdown").arg(annotate));
        let words = ["lookdown".to_owned()].into_iter().chain(words.to_vec());
        F::from_arg_matches(&command.try_get_matches_from(words)?)
    }

    /// A value that the parameter takes.
    fn value_of(spec: &ParameterSpec) -> &'static str {
        match spec.kind {
            ParameterKind::Choice(names) => names[0],
            ParameterKind::Choices { none, .. } => none,
            ParameterKind::Switch => "true",
            ParameterKind::Whole { .. } => "64",
            ParameterKind::Fraction | ParameterKind::Positive => "0.25",
            _ => spec.example.unwrap_or_default(),
        }
    }

    fn words(table: &'static [ParameterSpec]) -> (Vec<String>, Given) {
        let given: Given = offered(table)
            .map(|spec| (spec.name, value_of(spec).to_owned()))
            .collect();
        let words = given
            .iter()
            .flat_map(|(name, value)| [format!("--{}", name.replace('_', "-")), value.clone()]);
        (words.collect(), given)
    }

    #[test]
    fn every_offered_parameter_is_a_flag_in_kebab_case() {
        let (flags, expected) = words(DetectParameters::TABLE);
        let read = parsed::<ParameterFlags>(&flags).unwrap();
        assert_eq!(read.0, expected);
        assert!(read.check(Some("lobby")).is_ok());

        let (mut flags, expected) = words(AnnotationOptions::TABLE);
        flags.extend(["--annotate", "out.jpg"].map(ToOwned::to_owned));
        let read = parsed::<AnnotationFlags>(&flags).unwrap();
        assert_eq!(read.0, expected);
        assert!(read.check().is_ok());
    }

    #[test]
    fn unknown_choices_are_refused_with_the_possible_values() {
        for (name, values) in [("--profile", "paper, fast"), ("--refine", "nms, soft_nms")] {
            let words = [name.to_owned(), "best".to_owned()];
            let error = parsed::<ParameterFlags>(&words).unwrap_err().to_string();
            let expected = format!("[possible values: {values}");
            assert!(error.contains(&expected), "{error}");
        }
    }

    #[test]
    fn layers_are_given_as_one_comma_separated_value() {
        let words = ["--draw", "boxes,views", "--annotate", "out.jpg"].map(ToOwned::to_owned);
        let read = parsed::<AnnotationFlags>(&words).unwrap();
        assert_eq!(read.0, [("draw", "boxes,views".to_owned())]);
    }
}
