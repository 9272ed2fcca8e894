//! The models, where they run, and the candidates of a view.
//!
//! The models.
//!
//! The inference server that runs the models, if they do not run in this process.

use std::{
    num::{NonZeroU64, NonZeroUsize},
    path::{Path, PathBuf},
    time::Duration,
};

use lookdown_detect::inference::{
    BearerToken, CandidateOptions, Device, InvalidToken, UnknownDevice,
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
