//! TLS: a certificate and its private key, given together or not at all.

use std::{num::NonZeroU64, path::PathBuf, time::Duration};

use super::{
    SettingsError,
    declare::settings,
    form::{millis, optional, path, poll_seconds},
};
use crate::tls::TlsOptions;

/// A minute: no client needs longer for a handshake.
const MAX_HANDSHAKE_MILLIS: u64 = 60_000;

settings! {
    /// TLS as it is written.
    #[derive(Debug, Clone)]
    pub(super) struct TlsKeys in "server.tls" {
        /// The PEM file of the server's certificate, followed by the intermediate certificates.
        /// With a certificate and a private key the server speaks HTTPS, without them plain HTTP.
        certificate: Option<PathBuf> = None => optional(path());
        /// The PEM file of the certificate's private key.
        private_key: Option<PathBuf> = None => optional(path());
        /// The PEM file of certificate authorities. Each client must then show a certificate of one
        /// of them.
        client_certificates: Option<PathBuf> = None => optional(path());
        /// The interval in seconds at which these files are checked for changes. 0: never. An
        /// invalid new version leaves the old one in use and shows in the metrics and in the log.
        poll_seconds: Option<NonZeroU64> = NonZeroU64::new(2) => poll_seconds();
        /// The longest time for a TLS handshake.
        handshake_timeout as "handshake_timeout_millis": Duration = Duration::from_secs(10)
            => millis(1..=MAX_HANDSHAKE_MILLIS);
    }
}

impl TlsKeys {
    /// The options of TLS; `None` for plain HTTP.
    pub(super) fn checked(self) -> Result<Option<TlsOptions>, SettingsError> {
        let missing = |key, remedy| Err(SettingsError::value(key, "empty", remedy));
        match (self.certificate, self.private_key) {
            (Some(certificate), Some(private_key)) => Ok(Some(TlsOptions {
                certificate,
                private_key,
                client_certificates: self.client_certificates,
                poll_seconds: self.poll_seconds,
                handshake_timeout: self.handshake_timeout,
            })),
            (Some(_), None) => missing(
                "server.tls.private_key",
                "give the file of the certificate's private key, or leave the certificate out",
            ),
            (None, Some(_)) => missing(
                "server.tls.certificate",
                "give the file of the private key's certificate, or leave the private key out",
            ),
            (None, None) if self.client_certificates.is_some() => missing(
                "server.tls.certificate",
                "clients show certificates over TLS only: give the server's certificate and private \
                 key, or leave client_certificates out",
            ),
            (None, None) => Ok(None),
        }
    }
}
