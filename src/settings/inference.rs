//! ONNX Runtime and the candidates of a view.

use std::{num::NonZeroUsize, path::PathBuf, time::Duration};

use lookdown_detect::inference::{CandidateOptions, Device, UnknownDevice};

use super::{
    SettingsError,
    declare::settings,
    form::{Form, Refusal, count, millis, parsed, path, share},
    locate::{DEFAULT_LIBRARY, locate},
};

/// A second: a server whose batches take longer to fill has no traffic to fill them.
const MAX_QUEUE_DELAY_MILLIS: u64 = 1_000;

settings! {
    /// ONNX Runtime and the candidates of a view.
    #[derive(Debug, Clone, PartialEq)]
    pub struct InferenceSettings in "inference" {
        /// The longest time that a view waits for others to fill its batch. 0: none.
        max_queue_delay as "max_queue_delay_millis": Duration = Duration::ZERO
            => millis(0..=MAX_QUEUE_DELAY_MILLIS);
        /// The ONNX Runtime library. The default path is searched for beside the executable, in
        /// the repository that it was built in, and in `/usr/lib/lookdown`, never in the current
        /// folder.
        library_path: PathBuf = DEFAULT_LIBRARY.into() => path();
        /// The device that runs models: `cpu`, an NVIDIA GPU by its number as `cuda:0` or
        /// `tensorrt:0`, or a device of Intel as `openvino:gpu`, `openvino:npu` or `openvino:cpu`.
        /// For all but `cpu`, `inference.library_path` must be the `libonnxruntime.so` of the
        /// package `onnxruntime-gpu` or `onnxruntime-openvino`. `tensorrt`, `openvino:gpu` and
        /// `openvino:npu` are experimental: they have not been tested.
        device: Device = Device::Cpu => device();
        /// The least score of a candidate. Candidates below it are dropped first of all.
        score_floor: f64 = CandidateOptions::DEFAULT.score_floor => share();
        /// The most candidates kept of one view, best first.
        max_detections_per_view: NonZeroUsize = NonZeroUsize::new(CandidateOptions::DEFAULT.max_detections_per_view).unwrap_or(NonZeroUsize::MIN)
            => count();
    }
}

fn device() -> Form<Device> {
    let parse = |name: &str| name.parse();
    parsed(
        "`cpu`, `cuda:N`, `tensorrt:N`, `openvino:cpu`, `openvino:gpu` or `openvino:npu`",
        move |name| parse(name).map_err(|error: UnknownDevice| Refusal::Shown(error.to_string())),
        Device::to_string,
    )
}

impl InferenceSettings {
    /// Returns the path of the ONNX Runtime library.
    ///
    /// # Errors
    /// [`SettingsError::Missing`] when it does not exist.
    pub fn find_library(&self) -> Result<PathBuf, SettingsError> {
        locate(&self.library_path, DEFAULT_LIBRARY).ok_or_else(|| SettingsError::Missing {
            key: "inference.library_path",
            what: "ONNX Runtime library",
            path: self.library_path.clone(),
            remedy: "run `make setup`, or set LOOKDOWN__INFERENCE__LIBRARY_PATH to \
                     libonnxruntime.so"
                .to_owned(),
        })
    }
}
