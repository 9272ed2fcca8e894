//! `lookdown model list` and `lookdown model fetch`

use std::{
    io::{self, Write},
    path::Path,
    process::ExitCode,
};

use anyhow::{Context, bail};
use clap::Args;
use lookdown_detect::inference::{ModelManifest, ModelSource, fetch_weights, model_names};

use crate::{
    cli::{complete, output::UNWRITABLE, settings_file::SettingsFile},
    settings::Settings,
};

const MEBIBYTE: f64 = 1_048_576.0;

/// Arguments of `lookdown model fetch`.
#[derive(Debug, Args)]
pub(in super::super) struct Arguments {
    /// Name of a model in the repository
    #[arg(value_name = "NAME", add = complete::of_model())]
    name: String,
    /// Place of converted models: NAME/model.onnx below a folder or an address. `make models`
    /// converts models
    #[arg(long, value_name = "URL|FOLDER")]
    from: ModelSource,
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
                format!("{:>10}  {licence}", size(&manifest.onnx))
            }
            Err(error) => format!("{:>10}  {error}", "invalid"),
        };
        writeln!(out, "{name:<40}{line}").context(UNWRITABLE)?;
    }
    Ok(ExitCode::SUCCESS)
}

/// Fetches the weights of a model.
pub(super) fn run(arguments: &Arguments) -> anyhow::Result<ExitCode> {
    let settings = arguments.settings_file.load()?;
    let manifest = manifest(&settings, &arguments.name)?;
    let bytes = fetch_weights(&manifest, &arguments.from)?;
    let (name, file) = (&manifest.name, manifest.onnx.display());
    writeln!(io::stdout(), "{name}: {bytes} bytes in {file}").context(UNWRITABLE)?;
    Ok(ExitCode::SUCCESS)
}

fn manifest(settings: &Settings, name: &str) -> anyhow::Result<ModelManifest> {
    let folder = settings.model.find_repository()?;
    let known = model_names(&folder);
    if !known.iter().any(|known| known == name) {
        let (folder, known) = (folder.display(), known.join(", "));
        bail!("there is no model {name:?} in {folder} (model.repository): use one of {known}");
    }
    Ok(ModelManifest::locate(&folder.join(name))?)
}

/// The size of a file, or `missing`.
fn size(file: &Path) -> String {
    #[expect(clippy::cast_precision_loss, reason = "far below 2^52 bytes")]
    let mebibytes = |bytes: u64| bytes as f64 / MEBIBYTE;
    file.metadata().map_or_else(
        |_| "missing".to_owned(),
        |metadata| format!("{:.1} MiB", mebibytes(metadata.len())),
    )
}
