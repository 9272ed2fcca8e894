//! The flags `--config` and `--set`: the source of the settings.

use std::path::PathBuf;

use clap::Args;

use crate::{
    settings::{self, Settings},
    telemetry,
};

/// The source of the settings.
#[derive(Debug, Args)]
pub(super) struct SettingsFile {
    /// Settings file (TOML); variables such as `LOOKDOWN__SERVER__LISTEN` override it
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// A setting, such as `limits.max_frames_in_flight=8`, which overrides its variable and the
    /// file; may be repeated
    #[arg(long = "set", value_name = "KEY=VALUE", value_parser = override_of)]
    overrides: Vec<(String, String)>,
}

/// Parses `KEY=VALUE`.
fn override_of(text: &str) -> Result<(String, String), String> {
    let (key, value) = text
        .split_once('=')
        .ok_or("give a key and a value, such as server.listen=0.0.0.0:8080")?;
    Ok((key.to_owned(), value.to_owned()))
}

impl SettingsFile {
    /// Loads and validates the settings, and starts logging as they say.
    pub(super) fn load(&self) -> anyhow::Result<Settings> {
        self.load_with(&[])
    }

    /// [`SettingsFile::load`], with values of other flags, each with its key.
    pub(super) fn load_with(&self, flags: &[(String, String)]) -> anyhow::Result<Settings> {
        let overrides = [&self.overrides[..], flags].concat();
        let file = self.config.as_deref();
        let settings = settings::load_with(file, settings::environment(), &overrides)?;
        telemetry::start_logs(&settings.log)?;
        let names = settings::environment().map(|(name, _)| name);
        if let Some(warning) = settings::ignored_variables(names) {
            tracing::warn!("{warning}");
        }
        Ok(settings)
    }
}
