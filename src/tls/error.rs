//! Certificates and keys that cannot be used.

use std::{io, path::PathBuf};

/// Certificates and keys that cannot be used: each message names the setting, the file and what to
/// do, and none repeats what a file holds.
#[derive(Debug, thiserror::Error)]
pub enum TlsError {
    /// A file cannot be read.
    #[error("{setting}: {} cannot be read ({cause}): check its path and who may read it", path.display())]
    Unreadable {
        /// The setting.
        setting: &'static str,
        /// The file.
        path: PathBuf,
        /// Why.
        cause: io::Error,
    },
    /// A file is not PEM throughout.
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
    /// The private key is of a kind that is not known.
    #[error(
        "server.tls.private_key: the private key in {} cannot be used: give an RSA key of 2048 bits \
         or more, an ECDSA key on P-256 or P-384, or an Ed25519 key",
        path.display()
    )]
    UnknownKey {
        /// The file.
        path: PathBuf,
    },
    /// The private key is another certificate's.
    #[error(
        "server.tls.private_key: the private key in {} is not that of the first certificate in {} \
         (server.tls.certificate): give both files of one pair, the server's own certificate first",
        private_key.display(),
        certificate.display()
    )]
    Mismatch {
        /// The private key's file.
        private_key: PathBuf,
        /// The certificate's file.
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
        /// Which it is, from 1.
        position: usize,
    },
    /// The library refuses what looked right.
    #[error("server.tls: these files cannot be used together ({0}): give others")]
    Refused(#[from] rustls::Error),
}
