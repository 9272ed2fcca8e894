//! `lookdown model list` and `lookdown model fetch`

use std::{
    io::{self, Write},
    path::Path,
    process::ExitCode,
};

use anyhow::{Context, anyhow, bail};
use clap::Args;
use lookdown_detect::inference::{
    FetchError, ModelManifest, ModelSource, Sha256Sum, fetch_upstream, fetch_weights, model_names,
};

use super::check::check_model;
use crate::{
    cli::{complete, output::UNWRITABLE, settings_file::SettingsFile},
    settings::{Settings, explain},
};

const MEBIBYTE: f64 = 1_048_576.0;

/// Arguments of `lookdown model fetch`.
#[derive(Debug, Args)]
pub(in super::super) struct Arguments {
    /// Name of a model in the repository
    #[arg(value_name = "NAME", add = complete::of_model())]
    name: String,
    /// Place of converted models: NAME/model.onnx below a folder or an address. `make models`
    /// converts models. For a model with `[upstream]` in its model.toml, a mirror of the published
    /// file: NAME/FILE [default: the address in `[upstream]`]
    #[arg(long, value_name = "URL|FOLDER")]
    from: Option<ModelSource>,
    /// SHA-256 of the published file that you trust, for a model whose model.toml has none
    #[arg(long, value_name = "SUM")]
    accept_sha256: Option<Sha256Sum>,
    #[command(flatten)]
    settings_file: SettingsFile,
}

/// Lists the models of the repository.
pub(super) fn list(settings_file: &SettingsFile) -> anyhow::Result<ExitCode> {
    let settings = settings_file.load()?;
    let folder = settings.model.find_repository()?;
    let mut out = io::stdout().lock();
    for name in model_names(&folder) {
        let manifest = ModelManifest::locate(&folder.join(&name));
        let line = match &manifest {
            Ok(manifest) => {
                let licence = manifest.licence.as_deref().unwrap_or("-");
                let size = size(&manifest.onnx);
                let command = match (&manifest.upstream, &size) {
                    (Some(_), None) => format!("  (lookdown model fetch {name})"),
                    _ => String::new(),
                };
                let size = size.as_deref().unwrap_or("missing");
                format!("{size:>10}  {licence}{command}")
            }
            Err(error) => format!("{:>10}  {}", "invalid", explain(error)),
        };
        writeln!(out, "{name:<40}{line}").context(UNWRITABLE)?;
    }
    Ok(ExitCode::SUCCESS)
}

/// Fetches the weights of a model. Checks a model from its published file on a sample.
pub(super) fn run(arguments: &Arguments) -> anyhow::Result<ExitCode> {
    let settings = arguments.settings_file.load()?;
    let manifest = manifest(&settings, &arguments.name)?;
    let (name, file) = (&manifest.name, manifest.onnx.display());
    let (from, accepted) = (arguments.from.as_ref(), arguments.accept_sha256.as_ref());
    let installed = match (&manifest.upstream, from, accepted) {
        (Some(upstream), ..) => {
            let installed = fetch_upstream(&manifest, upstream, from, accepted)
                .map_err(|error| with_remedy(&error))?;
            let cut = if installed.is_cut { ", cut" } else { "" };
            let sum = installed.published_sha256;
            format!(
                "{} bytes in {file} (SHA-256 of the published file: {sum}{cut})",
                installed.bytes
            )
        }
        (None, _, Some(_)) => bail!(
            "--accept-sha256: the model.toml of {name} has no [upstream]: enter the sum as sha256 \
             in that file"
        ),
        (None, Some(from), None) => {
            let bytes = fetch_weights(&manifest, from).map_err(|error| with_remedy(&error))?;
            format!("{bytes} bytes in {file}")
        }
        (None, None, None) => bail!(
            "the model.toml of {name} has no [upstream]: give a place of converted models with \
             --from, or run `make models`"
        ),
    };
    writeln!(io::stdout(), "{name}: {installed}").context(UNWRITABLE)?;
    if manifest.upstream.is_none() {
        return Ok(ExitCode::SUCCESS);
    }
    check_model(settings, &manifest.onnx, None, None)
        .with_context(|| format!("{name} is installed, but its check fails"))
}

fn manifest(settings: &Settings, name: &str) -> anyhow::Result<ModelManifest> {
    let folder = settings.model.find_repository()?;
    let known = model_names(&folder);
    if !known.iter().any(|known| known == name) {
        let (folder, known) = (folder.display(), known.join(", "));
        bail!("there is no model {name:?} in {folder} (model.repository): use one of {known}");
    }
    ModelManifest::locate(&folder.join(name)).map_err(|error| anyhow!(explain(&error)))
}

/// Adds the remedy that the command line offers.
fn with_remedy(error: &FetchError) -> anyhow::Error {
    const CONVERT: &str = "`make models` makes the models without [upstream]";
    match error {
        FetchError::Unreadable { .. } => {
            anyhow!("{error}: check the network and --from; {CONVERT}")
        }
        FetchError::WrongSum { .. } => anyhow!("{error}; {CONVERT}"),
        FetchError::UnknownSum { found, .. } => {
            anyhow!("{error}: if you trust this file, add --accept-sha256 {found}")
        }
        FetchError::NotAccepted { .. } => anyhow!("--accept-sha256: {error}"),
        FetchError::TooLarge { .. } => anyhow!("{error}: check the address, or --from"),
        FetchError::NoSum { .. }
        | FetchError::Archive { .. }
        | FetchError::Unusable { .. }
        | FetchError::Unwritable { .. } => anyhow!("{error}"),
    }
}

/// The size of a file. `None` if it is missing.
fn size(file: &Path) -> Option<String> {
    #[expect(clippy::cast_precision_loss, reason = "far below 2^52 bytes")]
    let mebibytes = |bytes: u64| bytes as f64 / MEBIBYTE;
    let metadata = file.metadata().ok()?;
    Some(format!("{:.1} MiB", mebibytes(metadata.len())))
}
