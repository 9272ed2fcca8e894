//! `lookdown model list`

use std::{
    io::{self, Write},
    path::Path,
    process::ExitCode,
};

use anyhow::Context;
use lookdown_detect::inference::{ModelManifest, model_names};

use crate::{
    cli::{progress::UNWRITABLE, server_flags::SettingsFile},
    settings::explain,
};

const MEBIBYTE: f64 = 1_048_576.0;

/// Lists the models of the repository.
pub(super) fn run(settings_file: &SettingsFile) -> anyhow::Result<ExitCode> {
    let settings = settings_file.load()?;
    let folder = settings.model.find_repository()?;
    let mut out = io::stdout().lock();
    for name in model_names(&folder) {
        let manifest = ModelManifest::locate(&folder.join(&name));
        let line = match &manifest {
            Ok(manifest) => {
                let license = manifest.license.as_deref().unwrap_or("-");
                let size = size(&manifest.onnx);
                let size = size.as_deref().unwrap_or("missing");
                format!("{size:>10}  {license}")
            }
            Err(error) => format!("{:>10}  {}", "invalid", explain(error)),
        };
        writeln!(out, "{name:<40}{line}").context(UNWRITABLE)?;
    }
    Ok(ExitCode::SUCCESS)
}

/// The size of a file. `None` if it is missing.
fn size(file: &Path) -> Option<String> {
    let mebibytes = |bytes: u64| bytes as f64 / MEBIBYTE;
    let metadata = file.metadata().ok()?;
    Some(format!("{:.1} MiB", mebibytes(metadata.len())))
}
