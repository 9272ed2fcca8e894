//! The models that the settings describe.

use std::{path::Path, sync::Arc};

use anyhow::anyhow;
use lookdown_detect::{
    inference::{
        CandidateOptions, Model, ModelFolder, ModelLoader, ModelManifest, ModelRepository,
        OnnxOptions, RemoteDetector, RemoteOptions, RemoteServer, RepositoryOptions, onnx_loader,
    },
    metrics::DetectMetrics,
    pipeline::DefaultModels,
};

use crate::settings::{RemoteSettings, Settings, SettingsError, explain, is_installed};

/// Opens the repository without loading a model. Also returns the default models.
///
/// # Errors
/// One sentence that names the setting, for a file that is missing or cannot be used.
pub(super) fn open(
    settings: &Settings,
    metrics: &Arc<DetectMetrics>,
) -> anyhow::Result<(ModelRepository, DefaultModels)> {
    let path = settings.model.find_repository()?;
    let mut one = settings.model.find_one()?;
    let remote = settings.remote.as_ref();
    if let (None, Some(model)) = (&one, remote.and_then(|remote| remote.model.as_ref())) {
        one = Some(path.join(model));
    }
    let elsewhere = match one {
        Some(path) => {
            let manifest =
                ModelManifest::locate(&path).map_err(|error| anyhow!(explain(&error)))?;
            Some((manifest.name, path))
        }
        None => None,
    };
    let defaults = match &elsewhere {
        Some((name, _)) => DefaultModels::one(name.clone()),
        None => DefaultModels::for_device(settings.inference.device),
    };
    let called = defaults.model().to_owned();
    let options = RepositoryOptions {
        folder: ModelFolder { path, elsewhere },
        warm_up_views: settings.threads.batch_views,
        explain,
    };
    let repository = match remote {
        Some(remote) => {
            let remote = remote_options(remote, called);
            let server = RemoteServer::new(remote, Arc::clone(metrics));
            let server = Arc::new(server.map_err(|error| anyhow!(explain(&error)))?);
            let loader = remote_loader(settings, Arc::clone(&server));
            ModelRepository::new(options, loader, Arc::clone(metrics)).on(server)
        }
        None => ModelRepository::new(options, local_loader(settings)?, Arc::clone(metrics)),
    };
    Ok((repository, defaults))
}

/// Returns the loader of models that run in this process.
fn local_loader(settings: &Settings) -> Result<ModelLoader, SettingsError> {
    let library = settings.inference.find_library()?;
    let options = onnx_options(settings);
    let load = onnx_loader(library, options, settings.threads.sessions);
    Ok(Box::new(move |path| {
        warn_of_missing_sum(path);
        load(path)
    }))
}

/// Logs a warning if a model outside the installation has no sum: anyone who can write there can
/// replace it.
fn warn_of_missing_sum(model: &Path) {
    // The loader reports a manifest that cannot be read.
    let has_sum = |manifest: ModelManifest| manifest.sha256.is_some();
    if !is_installed(model) && ModelManifest::locate(model).is_ok_and(|manifest| !has_sum(manifest))
    {
        tracing::warn!(
            model = %model.display(),
            "this model is not part of the installation and its manifest has no sha256, so changes of \
             its file are not noticed: enter the sum that `lookdown model check` prints"
        );
    }
}

/// Returns the loader of models that run on an inference server.
fn remote_loader(settings: &Settings, server: Arc<RemoteServer>) -> ModelLoader {
    let options = candidate_options(settings);
    let sessions = settings.threads.sessions;
    Box::new(move |path| {
        let (first, others) = RemoteDetector::load_sessions(&server, path, options, sessions)?;
        Ok(Model::from_sessions(first, others))
    })
}

/// The inference server of the settings. `called` is the model's name in this process.
fn remote_options(remote: &RemoteSettings, called: String) -> RemoteOptions {
    RemoteOptions {
        url: remote.url.clone(),
        token: remote.token.clone(),
        model: remote.model.clone().unwrap_or_else(|| called.clone()),
        called,
        timeout: remote.timeout,
    }
}

/// The settings of the ONNX runtime.
pub(crate) fn onnx_options(settings: &Settings) -> OnnxOptions {
    let device = settings.inference.device;
    OnnxOptions {
        device,
        threads: settings.threads.per_session,
        views_per_run: (!device.is_processor()).then_some(settings.threads.batch_views),
        candidates: candidate_options(settings),
    }
}

fn candidate_options(settings: &Settings) -> CandidateOptions {
    CandidateOptions {
        score_floor: settings.inference.score_floor,
        max_detections_per_view: settings.inference.max_detections_per_view.get(),
    }
}
