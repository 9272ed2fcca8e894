//! What TLS is made of.

use std::{num::NonZeroU64, path::PathBuf, time::Duration};

/// What TLS is made of.
#[derive(Debug, Clone, PartialEq)]
pub struct TlsOptions {
    /// File of the server's certificate, PEM, and those that lead from it to an authority.
    pub certificate: PathBuf,
    /// File of its private key, PEM.
    pub private_key: PathBuf,
    /// File of certificates of authorities, PEM: who connects must have a certificate of one of
    /// them.
    pub client_certificates: Option<PathBuf>,
    /// How often the files are looked at, seconds; `None` for never.
    pub poll_seconds: Option<NonZeroU64>,
    /// Longest a handshake may take.
    pub handshake_timeout: Duration,
}
