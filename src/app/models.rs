//! The models that the settings describe.

use std::path::Path;

use crate::{
    inference::{
        Detector, Device, Model, ModelFolder, ModelLoader, ModelManifest, ModelRepository,
        OnnxDetector, OnnxOptions, RepositoryOptions, is_fetched,
    },
    pipeline::DefaultModels,
    settings::{Settings, SettingsError},
};

/// The repository, none of its models loaded, and which of them answer by default.
///
/// # Errors
/// One sentence that names the setting: a file that is missing or cannot be used.
pub(super) fn open(settings: &Settings) -> anyhow::Result<(ModelRepository, DefaultModels)> {
    let loader = loader(settings)?;
    let path = settings.model.find_repository()?;
    let one = settings.model.find_one()?;
    let elsewhere = match one {
        Some(path) => Some((ModelManifest::locate(&path)?.name, path)),
        None => None,
    };
    let defaults = match &elsewhere {
        Some((name, _)) => DefaultModels::One(name.clone()),
        None => per_profile(&path, settings.inference.device),
    };
    let options = RepositoryOptions {
        folder: ModelFolder { path, elsewhere },
        warm_up_views: settings.inference.max_batch_views,
        kept: defaults
            .names()
            .into_iter()
            .map(ToOwned::to_owned)
            .collect(),
    };
    Ok((ModelRepository::new(options, loader), defaults))
}

/// Makes models as the settings say.
fn loader(settings: &Settings) -> Result<ModelLoader, SettingsError> {
    let library = settings.inference.find_library()?;
    let options = onnx_options(settings);
    let sessions = settings.threads.sessions;
    Ok(Box::new(move |path| {
        let (first, others) = OnnxDetector::load_sessions(&library, path, &options, sessions)?;
        let others = others
            .into_iter()
            .map(|session| Box::new(session) as Box<dyn Detector>);
        Ok(Model::of_sessions(Box::new(first), others.collect()))
    }))
}

/// How the settings want networks to be run.
pub(crate) fn onnx_options(settings: &Settings) -> OnnxOptions {
    OnnxOptions {
        device: settings.inference.device,
        threads: settings.threads.per_session,
        score_floor: settings.inference.score_floor,
        max_detections_per_view: settings.inference.max_detections_per_view.get(),
    }
}

fn per_profile(folder: &Path, device: Device) -> DefaultModels {
    let defaults = DefaultModels::per_profile(device, |name| is_fetched(&folder.join(name)));
    if let DefaultModels::PerProfile { missing, .. } = &defaults {
        for name in missing {
            tracing::warn!("{name} is not there, so another model stands in: run `make setup`");
        }
    }
    defaults
}
