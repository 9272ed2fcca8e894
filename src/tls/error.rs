//! Errors of certificates and keys.

use std::{io, path::PathBuf};

/// Certificates and keys that cannot be used. Each message names the setting, the file and the
/// remedy, and none repeats the content of a file.
#[derive(Debug, thiserror::Error)]
pub enum TlsError {
    /// A file cannot be read.
    #[error("{setting}: {} cannot be read ({cause}): check its path and its permissions", path.display())]
    Unreadable {
        /// The setting.
        setting: &'static str,
        /// The file.
        path: PathBuf,
        /// The cause.
        cause: io::Error,
    },
    /// A file is not valid PEM.
    #[error("{setting}: {} is damaged PEM: replace it with the file as it was issued", path.display())]
    Damaged {
        /// The setting.
        setting: &'static str,
        /// The file.
        path: PathBuf,
    },
    /// A file has no certificate.
    #[error(
        "{setting}: there is no certificate in {}: give a PEM file, whose certificates stand between \
         BEGIN CERTIFICATE and END CERTIFICATE",
        path.display()
    )]
    NoCertificate {
        /// The setting.
        setting: &'static str,
        /// The file.
        path: PathBuf,
    },
    /// A file has no private key.
    #[error(
        "server.tls.private_key: there is no private key in {}: give a PEM file with one in PKCS #8, \
         PKCS #1 or SEC1, without a passphrase",
        path.display()
    )]
    NoKey {
        /// The file.
        path: PathBuf,
    },
    /// The type of the private key is not supported.
    #[error(
        "server.tls.private_key: the private key in {} cannot be used: give an RSA key of 2048 bits \
         or more, an ECDSA key on P-256 or P-384, or an Ed25519 key",
        path.display()
    )]
    UnknownKey {
        /// The file.
        path: PathBuf,
    },
    /// The private key does not belong to the certificate.
    #[error(
        "server.tls.private_key: the private key in {} is not that of the first certificate in {} \
         (server.tls.certificate): give both files of one pair, the server's own certificate first",
        private_key.display(),
        certificate.display()
    )]
    Mismatch {
        /// The file of the private key.
        private_key: PathBuf,
        /// The file of the certificate.
        certificate: PathBuf,
    },
    /// A certificate is damaged.
    #[error(
        "{setting}: certificate {position} in {} is not an X.509 certificate of version 3 that can be \
         used: replace it with the file as it was issued, or have another issued",
        path.display()
    )]
    InvalidCertificate {
        /// The setting.
        setting: &'static str,
        /// The file.
        path: PathBuf,
        /// The position of the certificate, from 1.
        position: usize,
    },
    /// The TLS library refuses files that passed all checks.
    #[error("server.tls: these files cannot be used together ({0}): give others")]
    Refused(#[from] rustls::Error),
}
