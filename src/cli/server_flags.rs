//! The flags of the companions for the server that they are clients of.

use std::time::Duration;

use anyhow::{Context, anyhow, bail};
use clap::Args;
use lookdown_common::{ServerClient, ServerEntry, read_body};
use serde::de::DeserializeOwned;
use url::Url;

/// Longest time for an answer.
const TIMEOUT: Duration = Duration::from_secs(30);
/// Largest answer that is read, bytes.
const MAX_BYTES: usize = 16 << 20;

/// The server of a companion.
#[derive(Debug, Args)]
pub(super) struct ServerFlags {
    /// The URL of the server (`upstream.url`) [default: port 8080 on this machine]
    #[arg(long, value_name = "URL")]
    server: Option<String>,
    /// A file with the API key for the server (`upstream.api_key_file`)
    #[arg(long, value_name = "FILE")]
    api_key_file: Option<String>,
    /// A PEM file with the authorities of the server's certificate (`upstream.authorities`)
    /// [default: those of the system]
    #[arg(long, value_name = "FILE")]
    authorities: Option<String>,
}

impl ServerFlags {
    /// Creates a client of the server of the flags alone.
    pub(super) fn client(&self) -> anyhow::Result<ServerClient> {
        let entry = ServerEntry {
            url: self.server.clone(),
            api_key_file: self.api_key_file.as_ref().map(Into::into),
            authorities: self.authorities.as_ref().map(Into::into),
        };
        Ok(ServerClient::new(&entry.check()?)?)
    }

    /// Returns the settings that the flags give.
    pub(super) fn settings(&self) -> Vec<(String, String)> {
        given(&[
            ("upstream.url", self.server.as_deref()),
            ("upstream.api_key_file", self.api_key_file.as_deref()),
            ("upstream.authorities", self.authorities.as_deref()),
        ])
    }
}

/// Returns the keys and values of flags that are given.
pub(super) fn given(flags: &[(&str, Option<&str>)]) -> Vec<(String, String)> {
    let given = flags
        .iter()
        .filter_map(|(key, value)| Some((*key, (*value)?)));
    given
        .map(|(key, value)| (key.to_owned(), value.to_owned()))
        .collect()
}

/// Reads JSON from a server. An error says that there are no `what`.
pub(super) async fn read_json<T: DeserializeOwned>(
    client: &ServerClient,
    url: Url,
    what: &str,
) -> anyhow::Result<T> {
    let sent = client.send(client.get(url).timeout(TIMEOUT)).await;
    let response = sent.map_err(|error| anyhow!(client.failure(&error)))?;
    if !response.status().is_success() {
        bail!(client.refusal(response).await);
    }
    let body = read_body(response, MAX_BYTES).await?;
    serde_json::from_slice(&body)
        .with_context(|| format!("{} has sent no {what}", client.address()))
}
