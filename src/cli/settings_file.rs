//! The flag `--config`: the source of the settings.

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
}

impl SettingsFile {
    /// Loads and validates the settings, and starts logging as they say.
    pub(super) fn load(&self) -> anyhow::Result<Settings> {
        let settings = settings::load(self.config.as_deref(), settings::environment())?;
        telemetry::start_logs(&settings.log)?;
        let names = settings::environment().map(|(name, _)| name);
        if let Some(warning) = settings::ignored_variables(names) {
            tracing::warn!("{warning}");
        }
        Ok(settings)
    }
}
