//! Networks on another server, as they are asked for and checked.

use std::time::Duration;

use url::Url;

use super::{
    SettingsError,
    check::{MAX_TIMEOUT_MILLIS, choice, millis},
    raw::{RawInference, RawModel},
    unshown::Unshown,
};
use crate::inference::{BearerToken, NoToken};

/// The backend that runs networks here.
pub(super) const ONNX: &str = "onnx";
/// The backend that has a server of the Open Inference Protocol (KServe V2) run them.
const V2: &str = "v2";

/// What is shown instead of something secret.
const HIDDEN: &str = "***";

/// A server that networks run on.
#[derive(Debug, Clone, PartialEq)]
pub struct RemoteSettings {
    /// Its address, without `/v2`.
    pub url: Url,
    /// What it wants to see.
    pub token: Option<BearerToken>,
    /// What the model is called there; by default as its manifest calls it.
    pub model: Option<String>,
    /// Longest that one request to it may take.
    pub patience: Duration,
}

impl RemoteSettings {
    /// What is asked for; `None` when networks run here.
    pub(super) fn checked(
        raw: &RawInference,
        model: &RawModel,
    ) -> Result<Option<Self>, SettingsError> {
        let backends = [(ONNX, false), (V2, true)];
        let is_remote = choice("inference.backend", &raw.backend, &backends)?;
        let patience = millis(
            "inference.timeout_millis",
            raw.timeout_millis,
            1..=MAX_TIMEOUT_MILLIS,
        )?;
        if !is_remote {
            let hidden = if raw.bearer_token.0.is_empty() {
                ""
            } else {
                HIDDEN
            };
            let all = [
                ("inference.url", raw.url.as_str()),
                ("inference.bearer_token", hidden),
                ("inference.model", &raw.model),
            ];
            let unused = all.into_iter().find(|(_, value)| !value.is_empty());
            return unused.map_or(Ok(None), |(key, value)| {
                let remedy =
                    "it is of use with inference.backend = \"v2\": set that too, or leave it out";
                Err(refused(key, value, remedy))
            });
        }
        if raw.model.is_empty() && model.path.is_empty() {
            let remedy = "give the name of the server's model, whose manifest is in the folder of that \
                          name in model.repository, or set model.path to its manifest";
            return Err(refused("inference.model", &raw.model, remedy));
        }
        Ok(Some(Self {
            url: address(&raw.url)?,
            token: token(&raw.bearer_token)?,
            model: (!raw.model.is_empty()).then(|| raw.model.clone()),
            patience,
        }))
    }
}

/// The server's address. One with a password is refused: addresses are shown.
fn address(told: &str) -> Result<Url, SettingsError> {
    let remedy = "give the address of the inference server, such as http://127.0.0.1:8000, without a \
                  password and without /v2";
    let url = told.parse::<Url>().ok().filter(|url| {
        let is_http = matches!(url.scheme(), "http" | "https");
        let is_plain = url.query().is_none() && url.fragment().is_none();
        let is_open = url.username().is_empty() && url.password().is_none();
        is_http && is_plain && is_open
    });
    // A password in it is not repeated.
    let shown = if told.contains('@') { HIDDEN } else { told };
    url.ok_or_else(|| refused("inference.url", shown, remedy))
}

fn token(written: &Unshown) -> Result<Option<BearerToken>, SettingsError> {
    let Unshown(written) = written;
    let token = (!written.is_empty()).then(|| written.parse()).transpose();
    token.map_err(|remedy: NoToken| refused("inference.bearer_token", HIDDEN, &remedy.to_string()))
}

fn refused(key: &str, value: &str, remedy: &str) -> SettingsError {
    SettingsError::Value {
        key: key.to_owned(),
        value: format!("{value:?}"),
        remedy: remedy.to_owned(),
    }
}
