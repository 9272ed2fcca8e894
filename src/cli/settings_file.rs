//! The flags `--config` and `--set`: the source of the settings.

use std::path::{Path, PathBuf};

use clap::Args;
use lookdown_common::ConfigError;

use crate::{
    settings::{self, Settings, SettingsError},
    telemetry,
};

/// The source of the settings.
#[derive(Debug, Clone, Args)]
pub(super) struct SettingsFile {
    /// Settings file (TOML); variables such as `LOOKDOWN__SERVER__LISTEN` override it
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// A setting, such as `limits.max_frames_in_flight=8`, which overrides its variable and the
    /// file; may be repeated
    #[arg(long = "set", value_name = "KEY=VALUE", value_parser = override_of)]
    overrides: Vec<(String, String)>,
}

/// Settings that can be read again.
#[derive(Clone)]
pub(super) struct SettingsSource {
    file: Option<PathBuf>,
    overrides: Vec<(String, String)>,
}

/// Parses `KEY=VALUE`.
fn override_of(text: &str) -> Result<(String, String), String> {
    let (key, value) = text
        .split_once('=')
        .ok_or("give a key and a value, such as server.listen=0.0.0.0:8080")?;
    Ok((key.to_owned(), value.to_owned()))
}

/// Returns true if a text names a settings file.
pub(super) fn is_settings_file(text: &str) -> bool {
    Path::new(text)
        .extension()
        .is_some_and(|ending| ending == "toml")
}

impl SettingsFile {
    /// Loads and validates the settings, and starts logging as they say.
    pub(super) fn load(&self) -> anyhow::Result<Settings> {
        self.load_with(&[])
    }

    /// [`SettingsFile::load`], with values of other flags, each with its key.
    pub(super) fn load_with(&self, flags: &[(String, String)]) -> anyhow::Result<Settings> {
        self.source(None, flags)?.load()
    }

    /// Returns the source with a file that stands without `--config`, and with values of other
    /// flags, each with its key.
    ///
    /// # Errors
    /// If there are two files.
    pub(super) fn source(
        &self,
        file: Option<&str>,
        flags: &[(String, String)],
    ) -> anyhow::Result<SettingsSource> {
        if let (Some(config), Some(file)) = (&self.config, file) {
            anyhow::bail!(
                "--config: {} and {file} are both settings files: give one of them",
                config.display()
            );
        }
        Ok(SettingsSource {
            file: file.map(PathBuf::from).or_else(|| self.config.clone()),
            overrides: [&self.overrides[..], flags].concat(),
        })
    }
}

impl SettingsSource {
    /// Loads and validates the settings, and starts logging as they say.
    pub(super) fn load(&self) -> anyhow::Result<Settings> {
        let settings = self.read()?;
        telemetry::start_logs(&settings.log)?;
        let names = settings::environment().map(|(name, _)| name);
        if let Some(warning) = settings::ignored_variables(names) {
            tracing::warn!("{warning}");
        }
        Ok(settings)
    }

    fn read(&self) -> Result<Settings, SettingsError> {
        settings::load_with(
            self.file.as_deref(),
            settings::environment(),
            &self.overrides,
        )
    }

    /// Reads the settings again, while the log has started.
    pub(super) fn again(&self) -> Result<Settings, ConfigError> {
        self.read().map_err(|error| ConfigError(error.to_string()))
    }
}
