//! `lookdown tune`: measures which sessions, threads and batches are fastest on this machine.

mod trial;

use std::{
    io::{self, Write},
    num::NonZeroUsize,
    process::ExitCode,
};

use anyhow::Context;
use clap::Args;
use lookdown_detect::{inference::Device, parameters::Profile};

use self::trial::{Choice, Trial};
use super::{SettingsFile, parameters::one_of};
use crate::cli::output::UNWRITABLE;
use crate::settings::Settings;

/// Minimum speed-up over the present settings. A smaller one may be due to chance.
const WORTH_WHILE: f64 = 1.03;
/// Number of comparisons between the best choice and the present one.
const TURNS: usize = 5;

/// Arguments of `lookdown tune`.
#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// Tune for this profile's model
    #[arg(long, value_name = "NAME", default_value_t, value_parser = one_of::<Profile>())]
    profile: Profile,
    #[command(flatten)]
    settings_file: SettingsFile,
}

/// Runs the command.
pub(super) fn run(arguments: &Arguments) -> anyhow::Result<ExitCode> {
    let settings = arguments.settings_file.load()?;
    let profile = arguments.profile;
    let present = Choice {
        sessions: settings.threads.sessions,
        threads: settings.threads.per_session,
        batch_views: settings.threads.batch_views,
    };
    let mut out = io::stdout().lock();
    let mut say = |line: String| writeln!(out, "{line}").context(UNWRITABLE);
    say("sessions  threads  batch  views/s".to_owned())?;
    let mut best = (present, 0.0);
    for choice in choices(&settings) {
        let rate = Trial::prepare(&settings, profile, choice)?.views_per_second()?;
        say(row(choice, rate))?;
        if rate > best.1 {
            best = (choice, rate);
        }
    }
    let (best, gain) = confirmed(&settings, profile, present, best.0)?;
    if gain < WORTH_WHILE {
        say("\nNo choice is faster than the present settings.".to_owned())?;
        return Ok(ExitCode::SUCCESS);
    }
    say(format!(
        "\n{gain:.2} times as fast as the present settings, measured alternately:\n\n{}",
        toml(best)
    ))?;
    Ok(ExitCode::SUCCESS)
}

/// All divisions of the cores in powers of two, each with several batch sizes.
fn choices(settings: &Settings) -> Vec<Choice> {
    let cores = settings.threads.remapping.get();
    let (shares, batches): (Vec<(usize, usize)>, &[usize]) = match settings.inference.device {
        Device::Cpu => {
            let threads = std::iter::successors(Some(1), |threads| Some(threads * 2));
            let shares = threads
                .take_while(|threads| *threads <= cores)
                .map(|threads| (cores / threads, threads));
            (shares.collect(), &[1, 4, 8])
        }
        Device::Cuda(_) | Device::TensorRt(_) => (vec![(1, 1), (2, 1), (3, 1)], &[1, 4, 8, 16, 32]),
    };
    let choices = shares.into_iter().flat_map(|(sessions, threads)| {
        batches.iter().filter_map(move |&batch_views| {
            Some(Choice {
                sessions: NonZeroUsize::new(sessions)?,
                threads: NonZeroUsize::new(threads)?,
                batch_views: NonZeroUsize::new(batch_views)?,
            })
        })
    });
    choices.collect()
}

/// The speed-up of the best choice over the present one, measured alternately.
fn confirmed(
    settings: &Settings,
    profile: Profile,
    present: Choice,
    best: Choice,
) -> anyhow::Result<(Choice, f64)> {
    if best == present {
        return Ok((best, 1.0));
    }
    let [best_trial, present_trial] =
        [best, present].map(|choice| Trial::prepare(settings, profile, choice));
    let (best_trial, present_trial) = (best_trial?, present_trial?);
    let mut gains = Vec::with_capacity(TURNS);
    for _ in 0..TURNS {
        gains.push(best_trial.views_per_second()? / present_trial.views_per_second()?);
    }
    gains.sort_by(f64::total_cmp);
    Ok((best, gains[TURNS / 2]))
}

fn row(choice: Choice, rate: f64) -> String {
    let Choice {
        sessions,
        threads,
        batch_views,
    } = choice;
    format!("{sessions:8}  {threads:7}  {batch_views:5}  {rate:7.1}")
}

/// The choice as part of the settings file.
fn toml(choice: Choice) -> String {
    format!(
        "[inference]\nsessions = {}\nthreads = {}\nmax_batch_views = {}",
        choice.sessions, choice.threads, choice.batch_views
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_choice_uses_all_cores_and_includes_the_present_one() {
        let settings = crate::settings::load(None, []).unwrap();
        let choices = choices(&settings);
        let cores = settings.threads.remapping.get();
        assert!(choices.iter().all(|choice| {
            let used = choice.sessions.get() * choice.threads.get();
            used <= cores && used > cores / 2
        }));
        assert!(choices.contains(&Choice {
            sessions: settings.threads.sessions,
            threads: settings.threads.per_session,
            batch_views: settings.threads.batch_views,
        }));
    }

    #[test]
    fn the_choice_is_printed_as_loadable_settings() {
        let three = NonZeroUsize::new(3).unwrap();
        let text = toml(Choice {
            sessions: three,
            threads: NonZeroUsize::MIN,
            batch_views: three,
        });
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("tuned.toml");
        std::fs::write(&file, text).unwrap();
        let settings = crate::settings::load(Some(&file), []).unwrap();
        assert_eq!(settings.threads.sessions, three);
        assert_eq!(settings.threads.batch_views, three);
    }
}
