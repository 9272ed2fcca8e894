//! The settings of TLS.

use std::{num::NonZeroU64, path::PathBuf, time::Duration};

/// The settings of TLS.
#[derive(Debug, Clone, PartialEq)]
pub struct TlsOptions {
    /// PEM file of the server's certificate, followed by the intermediate certificates up to an
    /// authority.
    pub certificate: PathBuf,
    /// PEM file of the private key.
    pub private_key: PathBuf,
    /// PEM file of authorities. If it is given, clients must have a certificate of one of them.
    pub client_certificates: Option<PathBuf>,
    /// Interval between two checks of the files, seconds. `None` disables them.
    pub poll_seconds: Option<NonZeroU64>,
    /// Longest time for a handshake.
    pub handshake_timeout: Duration,
}
