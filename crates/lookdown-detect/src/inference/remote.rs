//! Detectors whose network runs on another machine, on any server of the Open Inference Protocol
//! (KServe V2) over HTTP. Views are sent as tensors, as bytes behind the JSON where the server
//! supports that, otherwise within the JSON. The head in the model's manifest decodes the outputs
//! locally.

mod breaker;
mod connection;
mod exchange;
mod options;
mod server;
mod token;
mod understood;

use std::{num::NonZeroUsize, path::Path, sync::Arc};

use self::{
    exchange::{Answer, Question},
    understood::RemoteModel,
};
use super::{
    CandidateOptions, Detector, HeadOutput, InferenceError, ModelManifest,
    heads::TensorView,
    staging::{Staged, Staging},
};
use lookdown_imaging::{NetworkInput, ViewBatch};

pub use options::RemoteOptions;
pub use server::RemoteServer;
pub use token::{BearerToken, InvalidToken};

/// A model on an inference server.
pub struct RemoteDetector {
    server: Arc<RemoteServer>,
    understood: Arc<RemoteModel>,
    staging: Staging,
    options: CandidateOptions,
}

impl RemoteDetector {
    /// Fetches the metadata of the server's model and checks it against the manifest at `model` (a
    /// folder or a `model.toml`; no ONNX file is needed). Returns `count` sessions that send in
    /// parallel: the first one and the others. Blocks.
    ///
    /// # Errors
    /// [`InferenceError`] when the server cannot be reached or the model cannot be used.
    pub fn load_sessions(
        server: &Arc<RemoteServer>,
        model: &Path,
        options: CandidateOptions,
        count: NonZeroUsize,
    ) -> Result<(Self, Vec<Self>), InferenceError> {
        let manifest = ModelManifest::locate(model)?;
        let understood = Arc::new(RemoteModel::ask(server, manifest)?);
        let session = || Self {
            server: Arc::clone(server),
            understood: Arc::clone(&understood),
            staging: Staging::new(&understood.signature, None),
            options,
        };
        let others = (1..count.get()).map(|_| session()).collect();
        Ok((session(), others))
    }
}

impl Detector for RemoteDetector {
    fn name(&self) -> &str {
        &self.understood.manifest.name
    }

    fn revision(&self) -> &str {
        &self.understood.revision
    }

    fn input(&self) -> &NetworkInput {
        &self.understood.input
    }

    fn views_per_run(&self) -> Option<NonZeroUsize> {
        self.understood.signature.views_per_run
    }

    fn detect(&mut self, batch: &ViewBatch) -> Result<HeadOutput, InferenceError> {
        let Self {
            server,
            understood,
            staging,
            options,
        } = self;
        let input = &understood.input;
        staging.run_pieces(batch, input, options.max_detections_per_view, |staged| {
            run(server, understood, staged, options.score_floor)
        })
    }
}

/// Sends one inference request.
fn run(
    server: &RemoteServer,
    understood: &RemoteModel,
    staged: &Staged<'_>,
    score_floor: f64,
) -> Result<HeadOutput, InferenceError> {
    let question = Question {
        input: staged.name,
        shape: &staged.shape,
        values: staged.values,
        outputs: &understood.outputs,
        as_bytes: understood.as_bytes,
    };
    let Answer { outputs } = server.infer(&understood.name_there, &question)?;
    let tensors: Vec<_> = outputs
        .iter()
        .map(|output| TensorView {
            name: &output.name,
            shape: &output.shape,
            values: &output.values,
        })
        .collect();
    let head = &understood.manifest.output;
    head.decode(&tensors, staged.shape[0], &understood.input, score_floor)
}

#[cfg(test)]
mod tests;
