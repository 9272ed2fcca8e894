//! The options of an inference server.

use std::time::Duration;

use url::Url;

use super::token::BearerToken;

/// Settings of the inference server.
#[derive(Debug, Clone, PartialEq)]
pub struct RemoteOptions {
    /// The server's address, without `/v2`.
    pub url: Url,
    /// Token sent with every request, if any.
    pub token: Option<BearerToken>,
    /// Name on the server of the model whose readiness represents the server's.
    pub model: String,
    /// Manifest name of the model that is called `model` on the server. Other names are the same in
    /// both.
    pub called: String,
    /// Timeout of one inference request.
    pub timeout: Duration,
}
