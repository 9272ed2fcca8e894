//! The inference server that runs the models, if they do not run in this process.

use std::time::Duration;

use lookdown_detect::inference::{BearerToken, InvalidToken};
use secrecy::{ExposeSecret, SecretString};
use url::Url;

use super::{
    ModelSettings, SettingsError,
    declare::settings,
    form::{Form, MAX_TIMEOUT_MILLIS, Refusal, choice, millis, optional, parsed, secret, text},
};

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
            token: token
                .transpose()
                .map_err(|error: InvalidToken| SettingsError::Hidden {
                    key: "inference.bearer_token",
                    problem: error.to_string(),
                })?,
            model: self.model,
            timeout: self.timeout,
        }))
    }

    fn refuse_unused(self) -> Result<(), SettingsError> {
        const REMEDY: &str = "has an effect with inference.backend = \"v2\" only: set that too, or \
                              leave it out";
        if let Some(url) = self.url {
            return Err(SettingsError::value(
                "inference.url",
                url,
                format!("it {REMEDY}"),
            ));
        }
        if let Some(model) = self.model {
            return Err(SettingsError::value(
                "inference.model",
                model,
                format!("it {REMEDY}"),
            ));
        }
        self.bearer_token.map_or(Ok(()), |_| {
            Err(SettingsError::Hidden {
                key: "inference.bearer_token",
                problem: format!("it {REMEDY}"),
            })
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
