//! The models, where they run, and the candidates of a view.
//!
//! The models.
//!
//! The inference server that runs the models, if they do not run in this process.
//!
//! The thread plan: the shares of decoding, remapping and inference in the cores. No other module
//! decides them.
//!
//! On a CPU there are as many sessions as cores, each with one thread and one view at a time.
//! Sessions do not wait for each other, while the threads of one session synchronize at every
//! layer. A batch of views takes as long as its views one by one. Measured in lab/benches/NOTES.md.
//!
//! The counts follow from the cores that this process may use:
//! [`std::thread::available_parallelism`] respects the affinity mask and the CPU quota of the
//! control group (versions 1 and 2), rounded down. Idle threads do not spin, so stages that
//! alternate may each use all cores.
//!
//! Errors of the engine in the words of the settings.

use std::{
    num::{NonZeroU64, NonZeroUsize},
    path::{Path, PathBuf},
    time::Duration,
};

use lookdown_detect::inference::{
    BearerToken, CandidateOptions, Device, InferenceError, InvalidToken, UnknownDevice,
};
use secrecy::{ExposeSecret, SecretString};
use url::Url;

use super::{
    SettingsError,
    declare::settings,
    form::{
        Form, MAX_TIMEOUT_MILLIS, Refusal, choice, count, millis, names, optional, parsed, path,
        poll_seconds, secret, share, text,
    },
    locate::{DEFAULT_LIBRARY, DEFAULT_REPOSITORY, locate},
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
    /// If it does not exist.
    pub fn find_library(&self) -> Result<PathBuf, SettingsError> {
        locate(&self.library_path, DEFAULT_LIBRARY).ok_or_else(|| {
            SettingsError::missing(
                "inference.library_path",
                "ONNX Runtime library",
                &self.library_path,
                "run `make setup`, or set LOOKDOWN__INFERENCE__LIBRARY_PATH to libonnxruntime.so",
            )
        })
    }
}

settings! {
    /// The models.
    #[derive(Debug, Clone, PartialEq)]
    pub struct ModelSettings in "model" {
        /// One model for all profiles: a model folder or an ONNX file. Empty: each profile has its
        /// own.
        path: Option<PathBuf> = None => optional(path());
        /// The folder of models, each in a folder of its name. The default folder is
        /// searched for beside the executable, in the repository that it was built in, and in
        /// `/usr/lib/lookdown`, never in the current folder.
        repository: PathBuf = DEFAULT_REPOSITORY.into() => path();
        /// Names of models to load at the start in addition to those of the profiles.
        also_load: Vec<String> = Vec::new() => names();
        /// The interval in seconds at which the files of loaded models are checked for changes. 0:
        /// never. A changed model is used once it has passed its check.
        poll_seconds: Option<NonZeroU64> = NonZeroU64::new(5) => poll_seconds();
    }
}

impl ModelSettings {
    /// Returns the folder or file of the single model for all profiles, if it is set.
    ///
    /// # Errors
    /// If it does not exist.
    pub fn find_one(&self) -> Result<Option<PathBuf>, SettingsError> {
        match &self.path {
            Some(path) if !path.exists() => Err(SettingsError::missing(
                "model.path",
                "model",
                path,
                "set LOOKDOWN__MODEL__PATH to a model folder, or leave it out",
            )),
            path => Ok(path.clone()),
        }
    }

    /// Returns the folder of models. The default folder may be missing if there is a single model
    /// for all profiles.
    ///
    /// # Errors
    /// If it does not exist.
    pub fn find_repository(&self) -> Result<PathBuf, SettingsError> {
        let is_default = self.repository == Path::new(DEFAULT_REPOSITORY);
        match locate(&self.repository, DEFAULT_REPOSITORY) {
            Some(found) => Ok(found),
            None if is_default && self.path.is_some() => Ok(self.repository.clone()),
            None => Err(SettingsError::missing(
                "model.repository",
                "folder of models",
                &self.repository,
                "set LOOKDOWN__MODEL__REPOSITORY to the folder `models` of the repository",
            )),
        }
    }
}

/// The remedy for an address that cannot be used, or that is missing.
const ADDRESS: &str = "give the address of the inference server, such as http://127.0.0.1:8000, without \
                       a password and without /v2";

/// The program that runs the models.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Backend {
    /// ONNX Runtime in this process.
    Onnx,
    /// A server of the Open Inference Protocol (KServe V2).
    V2,
}

settings! {
    /// The inference server as it is written.
    #[derive(Debug, Clone)]
    pub(super) struct RemoteKeys in "inference" {
        /// The program that runs models: `onnx` is ONNX Runtime in this process, `v2` a server of
        /// the Open Inference Protocol, also called KServe V2 (docs/open-inference-protocol.md).
        backend: Backend = Backend::Onnx => choice(&[("onnx", Backend::Onnx), ("v2", Backend::V2)]);
        /// The address of that server, `http://` or `https://`.
        url: Option<Url> = None => optional(address());
        /// The token for that server, if it needs one, sent as `Authorization: Bearer …`. It is
        /// better kept in the variable than in a file.
        bearer_token: Option<SecretString> = None => secret("token");
        /// The name of the model on that server. Its manifest is `model.path`, or the folder of
        /// that name in `model.repository`. Empty: the name in the manifest at `model.path`.
        model: Option<String> = None => optional(text("a name", |_| true));
        /// The longest time for one request to that server.
        timeout as "timeout_millis": Duration = Duration::from_secs(10) => millis(1..=MAX_TIMEOUT_MILLIS);
    }
}

/// An inference server.
#[derive(Debug, Clone, PartialEq)]
pub struct RemoteSettings {
    /// Its address, without `/v2`.
    pub url: Url,
    /// The token that it needs.
    pub token: Option<BearerToken>,
    /// The name of the model on it; by default the name in its manifest.
    pub model: Option<String>,
    /// The longest time for one request to it.
    pub timeout: Duration,
}

impl RemoteKeys {
    /// The server; `None` when models run in this process.
    pub(super) fn checked(
        self,
        model: &ModelSettings,
    ) -> Result<Option<RemoteSettings>, SettingsError> {
        if self.backend == Backend::Onnx {
            return self.refuse_unused().map(|()| None);
        }
        if self.model.is_none() && model.path.is_none() {
            return Err(SettingsError::value(
                "inference.model",
                "empty",
                "give the name of the server's model, whose manifest is in the folder of that name in \
                 model.repository, or set model.path to its manifest",
            ));
        }
        let url = self.url;
        let token = self.bearer_token.map(|token| token.expose_secret().parse());
        Ok(Some(RemoteSettings {
            url: url.ok_or_else(|| SettingsError::value("inference.url", "empty", ADDRESS))?,
            token: token.transpose().map_err(|error: InvalidToken| {
                SettingsError::hidden("inference.bearer_token", error)
            })?,
            model: self.model,
            timeout: self.timeout,
        }))
    }

    fn refuse_unused(self) -> Result<(), SettingsError> {
        let remedy = "it has an effect with inference.backend = \"v2\" only: set that too, or \
                              leave it out";
        if let Some(url) = self.url {
            return Err(SettingsError::value("inference.url", url, remedy));
        }
        if let Some(model) = self.model {
            return Err(SettingsError::value("inference.model", model, remedy));
        }
        self.bearer_token.map_or(Ok(()), |_| {
            Err(SettingsError::hidden("inference.bearer_token", remedy))
        })
    }
}

/// The server's address. One with a password is refused: addresses are shown.
fn address() -> Form<Url> {
    parsed(
        "URL",
        |text| {
            let url = text.parse::<Url>().ok().filter(|url| {
                let is_http = matches!(url.scheme(), "http" | "https");
                let is_plain = url.query().is_none() && url.fragment().is_none();
                let is_open = url.username().is_empty() && url.password().is_none();
                is_http && is_plain && is_open
            });
            url.ok_or_else(|| {
                // A password in it is not repeated.
                if text.contains('@') {
                    Refusal::Hidden(ADDRESS.to_owned())
                } else {
                    Refusal::Shown(ADDRESS.to_owned())
                }
            })
        },
        Url::to_string,
    )
}

/// Two sessions: one uploads and renders while the other one computes.
const SESSIONS_ELSEWHERE: NonZeroUsize = NonZeroUsize::new(2).unwrap();
/// Views in one run on a GPU or another server.
const BATCH_VIEWS_ELSEWHERE: NonZeroUsize = NonZeroUsize::new(8).unwrap();

settings! {
    /// The use of the cores as it is written.
    #[derive(Debug, Clone)]
    pub(super) struct ThreadKeys in "inference" {
        /// The sessions of each model, which run side by side. 0: on a CPU one for each core that
        /// the machine or the container's CPU limit gives, on another device or server two.
        sessions: Option<NonZeroUsize> = None => count();
        /// The threads of each session. 0: one; where `inference.sessions` is set, their share of
        /// the cores.
        threads: Option<NonZeroUsize> = None => count();
        /// The most views in one run of the network, of one or several frames. 0: one on a CPU,
        /// where more is not faster, eight on another device or server. On another device every
        /// run has as many: black views take the place of missing ones.
        max_batch_views: Option<NonZeroUsize> = None => count();
    }
}

impl ThreadKeys {
    /// The plan for this process.
    pub(super) fn plan(&self, device: Device, is_remote: bool) -> ThreadPlan {
        let cores = std::thread::available_parallelism().unwrap_or(NonZeroUsize::MIN);
        ThreadPlan::new(cores, Computing::new(device, is_remote), self)
    }
}

/// The processor that runs the models.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Computing {
    /// The cores of this process.
    Here,
    /// A GPU or another server: the CPU only sends views and receives boxes.
    Elsewhere,
}

impl Computing {
    fn new(device: Device, is_remote: bool) -> Self {
        if device.is_processor() && !is_remote {
            Self::Here
        } else {
            Self::Elsewhere
        }
    }
}

/// The numbers of threads of each stage, and of views in a batch.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ThreadPlan {
    /// Frames processed at once; each is decoded and merged on one thread. One more than there are
    /// cores, so that inference always has a next frame.
    pub frame_workers: NonZeroUsize,
    /// Threads that build tables, and render batches of several views, for all frames together.
    pub remapping: NonZeroUsize,
    /// Sessions of each model, which run in parallel.
    pub sessions: NonZeroUsize,
    /// Threads of each session.
    pub per_session: NonZeroUsize,
    /// Largest number of views in one batch.
    pub batch_views: NonZeroUsize,
}

impl ThreadPlan {
    fn new(cores: NonZeroUsize, computing: Computing, keys: &ThreadKeys) -> Self {
        let share = |count: NonZeroUsize| {
            NonZeroUsize::new(cores.get() / count.get()).unwrap_or(NonZeroUsize::MIN)
        };
        let (sessions, per_session) = (keys.sessions, keys.threads);
        let (sessions, per_session, batch_views) = match computing {
            Computing::Here => (
                sessions.unwrap_or_else(|| per_session.map_or(cores, share)),
                per_session.unwrap_or_else(|| sessions.map_or(NonZeroUsize::MIN, share)),
                NonZeroUsize::MIN,
            ),
            Computing::Elsewhere => (
                sessions.unwrap_or(SESSIONS_ELSEWHERE),
                per_session.unwrap_or(NonZeroUsize::MIN),
                BATCH_VIEWS_ELSEWHERE,
            ),
        };
        Self {
            frame_workers: cores.saturating_add(1),
            remapping: cores,
            sessions,
            per_session,
            batch_views: keys.max_batch_views.unwrap_or(batch_views),
        }
    }
}

/// Returns the text of an error of the engine, with the setting that it depends on and the remedy.
pub fn explain(error: &InferenceError) -> String {
    match error {
        InferenceError::Runtime { .. } => {
            format!("inference.library_path: {error}, which `make setup` fetches")
        }
        InferenceError::NoProvider { .. } => {
            format!("inference.device and inference.library_path: {error}")
        }
        InferenceError::NoDevice { .. } => format!("inference.device: {error}"),
        InferenceError::Unreadable { .. } => format!(
            "{error}; the repository has the default models, and `make models` fetches others"
        ),
        InferenceError::NoManifest { network, .. } => format!(
            "{error}: write it with `lookdown model check --write-manifest {}`",
            network.display()
        ),
        InferenceError::Remote { .. } | InferenceError::RemoteModel { .. } => {
            format!("inference.url: {error}")
        }
        InferenceError::RemoteDenied { .. } => format!("inference.bearer_token: {error}"),
        InferenceError::Unusable { .. }
        | InferenceError::RemoteBusy { .. }
        | InferenceError::Run(_) => error.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use lookdown_detect::inference::{Device, OpenVinoDevice};

    use super::*;

    /// Sessions, and threads in each, on eight cores.
    fn plan(device: Device, is_remote: bool, sessions: usize, threads: usize) -> (usize, usize) {
        let keys = ThreadKeys {
            sessions: NonZeroUsize::new(sessions),
            threads: NonZeroUsize::new(threads),
            ..ThreadKeys::default()
        };
        let computing = Computing::new(device, is_remote);
        let plan = ThreadPlan::new(NonZeroUsize::new(8).unwrap(), computing, &keys);
        (plan.sessions.get(), plan.per_session.get())
    }

    #[test]
    fn each_core_has_a_session_of_its_own_by_default() {
        assert_eq!(plan(Device::Cpu, false, 0, 0), (8, 1));
        assert_eq!(plan(Device::Cpu, false, 2, 0), (2, 4));
        assert_eq!(plan(Device::Cpu, false, 0, 3), (2, 3));
        assert_eq!(plan(Device::Cpu, false, 5, 4), (5, 4));
        assert_eq!(plan(Device::Cpu, false, 16, 0), (16, 1));
    }

    #[test]
    fn a_gpu_and_another_server_use_two_sessions() {
        assert_eq!(plan(Device::Cuda(0), false, 0, 0), (2, 1));
        assert_eq!(plan(Device::TensorRt(0), false, 1, 2), (1, 2));
        assert_eq!(plan(Device::Cpu, true, 0, 0), (2, 1));
        let eight_cores = NonZeroUsize::new(8).unwrap();
        let plan = ThreadPlan::new(eight_cores, Computing::Elsewhere, &ThreadKeys::default());
        assert_eq!(plan.batch_views.get(), 8);
    }

    #[test]
    fn one_core_is_enough() {
        let plan = ThreadPlan::new(NonZeroUsize::MIN, Computing::Here, &ThreadKeys::default());
        assert_eq!((plan.sessions.get(), plan.per_session.get()), (1, 1));
        assert_eq!((plan.remapping.get(), plan.frame_workers.get()), (1, 2));
    }

    #[test]
    fn an_error_of_the_engine_names_the_setting_and_the_remedy() {
        let (path, url) = (|| "/here".into(), || "http://here".to_owned());
        let detail = || "some reason".to_owned();
        for (error, parts) in [
            (
                InferenceError::Runtime {
                    path: path(),
                    detail: detail(),
                },
                [
                    "inference.library_path: ",
                    "/here: some reason; ",
                    "`make setup`",
                ],
            ),
            (
                InferenceError::NoProvider {
                    device: Device::Cuda(0),
                    path: path(),
                },
                [
                    "inference.device",
                    "inference.library_path: cuda:0 ",
                    "onnxruntime-gpu",
                ],
            ),
            (
                InferenceError::NoProvider {
                    device: Device::OpenVino(OpenVinoDevice::Gpu),
                    path: path(),
                },
                [
                    "inference.device",
                    "inference.library_path: openvino:gpu ",
                    "onnxruntime-openvino",
                ],
            ),
            (
                InferenceError::NoDevice {
                    device: Device::Cuda(1),
                    detail: detail(),
                },
                ["inference.device: cuda:1 ", "some reason", "use cpu"],
            ),
            (
                InferenceError::Unreadable {
                    path: path(),
                    detail: detail(),
                },
                ["model: /here ", "some reason; ", "`make models`"],
            ),
            (
                InferenceError::NoManifest {
                    path: path(),
                    network: "/own/network.onnx".into(),
                },
                [
                    "model: /here ",
                    "/own/network.onnx: write it ",
                    "`lookdown model check --write-manifest /own/network.onnx`",
                ],
            ),
            (
                InferenceError::Remote {
                    url: url(),
                    detail: detail(),
                },
                ["inference.url: ", "http://here", "some reason"],
            ),
            (
                InferenceError::RemoteModel {
                    model: "m".to_owned(),
                    problem: detail(),
                },
                ["inference.url: ", "model m", "some reason"],
            ),
            (
                InferenceError::RemoteDenied {
                    url: url(),
                    detail: detail(),
                },
                ["inference.bearer_token: ", "http://here", "use the token"],
            ),
        ] {
            let text = explain(&error);
            for part in parts {
                assert!(text.contains(part), "{text}: {part}");
            }
        }
    }
}
