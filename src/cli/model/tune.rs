//! `lookdown model tune`

mod manifest_entry;
mod trial;

use std::{
    io::{self, Write},
    path::PathBuf,
    process::ExitCode,
};

use anyhow::{Context, anyhow, bail};
use clap::Args;
use lookdown_common::{files, replace_file};
use lookdown_detect::{
    inference::{MANIFEST, MANIFEST_MAX_BYTES, ModelManifest},
    parameters::{Profile, Tuning},
};
use lookdown_eval::DataSet;
use strum::VariantArray;
use toml_edit::DocumentMut;

use self::{
    manifest_entry::set,
    trial::{Figures, Trial},
};
use crate::{
    cli::{eval::TruthFlags, output::UNWRITABLE, parameters::one_of, settings_file::SettingsFile},
    settings::explain,
};

/// Shares of a crop's side that are compared, beside the profile's own.
const CROP_FILLS: [f64; 3] = [0.2, 0.4, 0.5];
/// Factors for scores from crops that are compared, beside the profile's own.
const CROP_VOTES: [f64; 4] = [0.5, 0.7, 0.85, 1.0];
/// Average precision by which another value must be better than the profile's own. Smaller gains
/// are within the uncertainty of sets of some hundred persons.
const LEAST_GAIN: f64 = 0.005;

/// Arguments of `lookdown model tune`.
#[derive(Debug, Args)]
pub(in super::super) struct Arguments {
    /// A model folder (with a model.toml)
    #[arg(value_name = "FOLDER")]
    model: PathBuf,
    #[command(flatten)]
    truth: TruthFlags,
    /// Profile to tune; may be repeated [default: fast, balanced and quality]
    #[arg(long, value_name = "NAME", value_parser = one_of::<Profile>())]
    profile: Vec<Profile>,
    /// Print the figures, and leave model.toml as it is
    #[arg(long)]
    dry_run: bool,
    #[command(flatten)]
    settings_file: SettingsFile,
}

/// Runs the subcommand.
pub(super) fn run(arguments: &Arguments) -> anyhow::Result<ExitCode> {
    let path = arguments.model.join(MANIFEST);
    let text = files::read_text(&path, MANIFEST_MAX_BYTES).with_context(|| {
        format!(
            "{} cannot be read: write it with `lookdown model check --write-manifest`",
            path.display()
        )
    })?;
    let mut manifest: DocumentMut = text
        .parse()
        .with_context(|| format!("{} is not valid", path.display()))?;
    let model =
        ModelManifest::locate(&arguments.model).map_err(|error| anyhow!(explain(&error)))?;
    let data_set = arguments.truth.open(&arguments.settings_file)?;
    let trial = Trial::new(
        arguments.settings_file.load()?,
        &model.onnx,
        manifest.clone(),
    )?;
    let profiles = match &arguments.profile[..] {
        [] => Profile::VARIANTS,
        given => given,
    };
    let is_asked = |profile: &Profile| !arguments.profile.is_empty() || profile.has_crops();
    let mut out = io::stdout().lock();
    for profile in profiles.iter().copied().filter(is_asked) {
        let tuned = tune(&trial, &data_set, profile, &mut out)?;
        set(&mut manifest, profile, &tuned)?;
        if !arguments.dry_run {
            replace_file(&path, manifest.to_string().as_bytes())
                .with_context(|| format!("{} cannot be written", path.display()))?;
            writeln!(out, "{profile}: written to {}", path.display()).context(UNWRITABLE)?;
        }
    }
    Ok(ExitCode::SUCCESS)
}

/// Compares the values of a profile, one constant after the other, and calibrates the scores.
fn tune(
    trial: &Trial,
    data_set: &DataSet,
    profile: Profile,
    out: &mut impl Write,
) -> anyhow::Result<Tuning> {
    let measured = |tuning: Tuning, out: &mut dyn Write| -> anyhow::Result<Figures> {
        let figures = trial.measure(data_set, profile, &tuning)?;
        writeln!(out, "{profile}: {figures}").context(UNWRITABLE)?;
        Ok(figures)
    };
    let own = measured(profile.tuning(), out)?;
    let mut best = own;
    if profile.has_crops() {
        for crop_fill in CROP_FILLS {
            let tuning = Tuning {
                crop_fill,
                ..own.tuning
            };
            best = better(best, measured(tuning, out)?, own.precision());
        }
        let fill = best.tuning;
        for crop_vote in CROP_VOTES
            .into_iter()
            .filter(|vote| *vote != fill.crop_vote)
        {
            let tuning = Tuning { crop_vote, ..fill };
            best = better(best, measured(tuning, out)?, own.precision());
        }
    }
    let Some(fit) = best.fit else {
        bail!(
            "{profile}: the scores cannot be calibrated, because no detection is right, or none is \
             wrong: use a data set with more persons, and a model that finds them"
        );
    };
    let tuning = rounded(best.tuning.recalibrated(fit.even_odds, fit.power));
    let after = measured(tuning, out)?;
    writeln!(
        out,
        "{profile}: number of persons wrong by {:.2} instead of {:.2} an image",
        after.count_error, own.count_error
    )
    .context(UNWRITABLE)?;
    Ok(tuning)
}

/// Returns the better of two measurements. Another one than the profile's own must be better than
/// it by [`LEAST_GAIN`].
fn better(best: Figures, other: Figures, own: f64) -> Figures {
    let gains = other.precision() >= own + LEAST_GAIN && other.precision() > best.precision();
    if gains { other } else { best }
}

/// Rounds to what a manifest shows, within what it may have.
fn rounded(tuning: Tuning) -> Tuning {
    let round = |value: f64| (value * 1000.0).round() / 1000.0;
    let rounded = Tuning {
        even_odds: round(tuning.even_odds),
        odds_power: round(tuning.odds_power),
        ..tuning
    };
    rounded.clamped()
}
