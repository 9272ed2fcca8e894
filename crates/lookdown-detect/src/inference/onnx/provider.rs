//! Sessions on the configured device.

use std::{num::NonZeroUsize, path::Path};

use ort::{
    environment::Environment,
    ep::{
        CUDA, ExecutionProvider, ExecutionProviderDispatch, OpenVINO, TensorRT,
        cuda::ConvAlgorithmSearch,
    },
    session::{Session, builder::SessionBuilder},
};

use super::{OnnxOptions, first_line};
use crate::inference::{Device, InferenceError};

/// Builder of sessions.
pub(super) struct Builder(SessionBuilder);

impl Builder {
    pub(super) fn commit(mut self, model: &[u8]) -> Result<Session, ort::Error> {
        self.0.commit_from_memory(model)
    }
}

/// Returns a builder of sessions on the options' device, without a fallback to another device.
pub(super) fn builder(
    environment: &Environment,
    library: &Path,
    options: &OnnxOptions,
) -> Result<Builder, InferenceError> {
    let device = options.device;
    let (providers, available) = providers(device, options.threads);
    if !available {
        return Err(InferenceError::NoProvider {
            device,
            path: library.to_owned(),
        });
    }
    let failed = |error: ort::Error| InferenceError::Run(first_line(&error));
    let builder = Session::builder(environment)
        .map_err(failed)?
        .with_intra_threads(options.threads.get())
        .map_err(|error| failed(error.into()))?
        // Idle pool threads must not spin: spinning takes CPU time from decoding and remapping.
        .with_intra_op_spinning(false)
        .map_err(|error| failed(error.into()))?
        .with_execution_providers(providers)
        .map_err(|error| InferenceError::NoDevice {
            device,
            detail: first_line(&error.into()),
        })?;
    Ok(Builder(builder))
}

/// The device's execution providers in order of preference, and true if the library has them. The
/// CPU is always the last choice, for operators without GPU code.
fn providers(device: Device, threads: NonZeroUsize) -> (Vec<ExecutionProviderDispatch>, bool) {
    let cuda = |number| {
        CUDA::default()
            .with_device_id(number)
            // The default measures all algorithms for each new size of a batch, about a second each
            // time, and the number of crops changes from frame to frame.
            .with_conv_algorithm_search(ConvAlgorithmSearch::Heuristic)
            .build()
            .error_on_failure()
    };
    match device {
        Device::Cpu => (Vec::new(), true),
        Device::Cuda(number) => (vec![cuda(number)], has::<CUDA>()),
        Device::TensorRt(number) => {
            let tensor_rt = TensorRT::default().with_device_id(number).build();
            let providers = vec![tensor_rt.error_on_failure(), cuda(number)];
            (providers, has::<TensorRT>() && has::<CUDA>())
        }
        Device::OpenVino(kind) => {
            let open_vino = OpenVINO::default()
                .with_device_type(<&str>::from(kind).to_uppercase())
                .with_num_threads(threads.get())
                .with_num_streams(1)
                .build();
            (vec![open_vino.error_on_failure()], has::<OpenVINO>())
        }
    }
}

/// Returns true if the library was built with this provider.
fn has<P: ExecutionProvider>() -> bool {
    P::is_available().unwrap_or(false)
}
