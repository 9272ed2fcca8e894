//! TLS, as it is written and checked.

use std::path::PathBuf;

use serde::Deserialize;

use super::{
    SettingsError,
    check::{millis, poll_seconds},
};
use crate::tls::TlsOptions;

/// A minute: nobody shakes hands for longer.
const MAX_HANDSHAKE_MILLIS: u64 = 60_000;
/// What PEM begins with: here it is a secret in the wrong place.
const PEM: &str = "-----BEGIN";

/// Table `server.tls`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub(super) struct RawTls {
    certificate: String,
    private_key: String,
    client_certificates: String,
    poll_seconds: u64,
    handshake_timeout_millis: u64,
}

impl Default for RawTls {
    fn default() -> Self {
        Self {
            certificate: String::new(),
            private_key: String::new(),
            client_certificates: String::new(),
            poll_seconds: 2,
            handshake_timeout_millis: 10_000,
        }
    }
}

impl RawTls {
    /// What is asked for; `None` for no TLS.
    pub(super) fn checked(&self) -> Result<Option<TlsOptions>, SettingsError> {
        let poll_seconds = poll_seconds("server.tls.poll_seconds", self.poll_seconds)?;
        let handshake_timeout = millis(
            "server.tls.handshake_timeout_millis",
            self.handshake_timeout_millis,
            1..=MAX_HANDSHAKE_MILLIS,
        )?;
        let certificate = file("server.tls.certificate", &self.certificate)?;
        let private_key = file("server.tls.private_key", &self.private_key)?;
        let client_certificates =
            file("server.tls.client_certificates", &self.client_certificates)?;
        let missing = |key: &str, remedy: &str| SettingsError::Value {
            key: key.to_owned(),
            value: "empty".to_owned(),
            remedy: remedy.to_owned(),
        };
        match (certificate, private_key) {
            (Some(certificate), Some(private_key)) => Ok(Some(TlsOptions {
                certificate,
                private_key,
                client_certificates,
                poll_seconds,
                handshake_timeout,
            })),
            (Some(_), None) => Err(missing(
                "server.tls.private_key",
                "give the file of the certificate's private key, or leave the certificate out",
            )),
            (None, Some(_)) => Err(missing(
                "server.tls.certificate",
                "give the file of the private key's certificate, or leave the private key out",
            )),
            (None, None) if client_certificates.is_some() => Err(missing(
                "server.tls.certificate",
                "clients show certificates over TLS only: give the server's certificate and private \
                 key, or leave client_certificates out",
            )),
            (None, None) => Ok(None),
        }
    }
}

/// The path that is written; `None` for none.
fn file(key: &str, value: &str) -> Result<Option<PathBuf>, SettingsError> {
    if value.contains(PEM) {
        // It may be the private key: it is not repeated.
        return Err(SettingsError::Value {
            key: key.to_owned(),
            value: "PEM itself".to_owned(),
            remedy: "write it into a file and give the path of that".to_owned(),
        });
    }
    Ok((!value.is_empty()).then(|| PathBuf::from(value)))
}
