//! The content of the TLS files, with a digest that detects changes. Each error names the setting,
//! the file and the remedy, and none repeats the content of a file.

use std::{
    num::NonZeroU64,
    os::unix::fs::PermissionsExt,
    path::{Path, PathBuf},
    time::Duration,
};

use anyhow::{anyhow, ensure};
use lookdown_common::files::{self, MAX_SETTINGS_BYTES};
use rustls::pki_types::{
    CertificateDer, PrivateKeyDer,
    pem::{Error, PemObject},
};
use sha2::{Digest, Sha256};

const CERTIFICATE: &str = "server.tls.certificate";
const PRIVATE_KEY: &str = "server.tls.private_key";
const CLIENT_CERTIFICATES: &str = "server.tls.client_certificates";
/// The permission bit of users that are neither owner nor group.
const READABLE_BY_OTHERS: u32 = 0o004;

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

/// The content of the files.
pub(super) struct TlsFiles {
    certificate: Vec<u8>,
    private_key: Vec<u8>,
    client_certificates: Option<Vec<u8>>,
}

impl TlsFiles {
    /// Reads all files.
    pub(super) fn read(options: &TlsOptions) -> anyhow::Result<Self> {
        let authorities = options.client_certificates.as_deref();
        Ok(Self {
            certificate: read(CERTIFICATE, &options.certificate)?,
            private_key: read(PRIVATE_KEY, &options.private_key)?,
            client_certificates: authorities
                .map(|path| read(CLIENT_CERTIFICATES, path))
                .transpose()?,
        })
    }

    /// A digest of the content.
    pub(super) fn digest(&self) -> [u8; 32] {
        let mut digest = Sha256::new();
        let optional = self.client_certificates.as_deref().unwrap_or_default();
        for content in [&self.certificate, &self.private_key, optional] {
            digest.update(Sha256::digest(content));
        }
        digest.finalize().into()
    }

    /// The certificate of the server and the intermediate certificates up to an authority.
    pub(super) fn chain(
        &self,
        options: &TlsOptions,
    ) -> anyhow::Result<Vec<CertificateDer<'static>>> {
        certificates(CERTIFICATE, &options.certificate, &self.certificate)
    }

    /// The server's private key.
    pub(super) fn key(&self, options: &TlsOptions) -> anyhow::Result<PrivateKeyDer<'static>> {
        let path = &options.private_key;
        PrivateKeyDer::from_pem_slice(&self.private_key).map_err(|error| match error {
            Error::NoItemsFound => anyhow!(
                "{PRIVATE_KEY}: there is no private key in {}: give a PEM file with one in PKCS #8, \
                 PKCS #1 or SEC1, without a passphrase",
                path.display()
            ),
            // The original error would quote the file.
            _ => damaged(PRIVATE_KEY, path),
        })
    }

    /// The authorities of client certificates, if these are required.
    pub(super) fn authorities(
        &self,
        options: &TlsOptions,
    ) -> anyhow::Result<Option<Vec<CertificateDer<'static>>>> {
        let path = options.client_certificates.as_deref();
        let content = path.zip(self.client_certificates.as_deref());
        content
            .map(|(path, content)| certificates(CLIENT_CERTIFICATES, path, content))
            .transpose()
    }
}

/// The authorities in the file that the setting `setting` names.
pub(super) fn authorities(
    setting: &str,
    path: &Path,
) -> anyhow::Result<Vec<CertificateDer<'static>>> {
    certificates(setting, path, &read(setting, path)?)
}

/// The error about a certificate in one of the files.
pub(super) fn invalid(options: &TlsOptions, of_clients: bool, position: usize) -> anyhow::Error {
    let (setting, path) = match &options.client_certificates {
        Some(path) if of_clients => (CLIENT_CERTIFICATES, path),
        _ => (CERTIFICATE, &options.certificate),
    };
    anyhow!(
        "{setting}: certificate {position} in {} is not an X.509 certificate of version 3 that can \
         be used: replace it with the file as it was issued, or have another issued",
        path.display()
    )
}

/// The error about a file that is not valid PEM.
pub(super) fn damaged(setting: &str, path: &Path) -> anyhow::Error {
    let path = path.display();
    anyhow!("{setting}: {path} is damaged PEM: replace it with the file as it was issued")
}

/// Returns true if every user of the machine may read the file.
pub(super) fn is_readable_by_others(path: &Path) -> bool {
    path.metadata()
        .is_ok_and(|metadata| metadata.permissions().mode() & READABLE_BY_OTHERS != 0)
}

fn certificates(
    setting: &str,
    path: &Path,
    content: &[u8],
) -> anyhow::Result<Vec<CertificateDer<'static>>> {
    let found: Result<Vec<_>, _> = CertificateDer::pem_slice_iter(content).collect();
    let found = found.map_err(|_| damaged(setting, path))?;
    ensure!(
        !found.is_empty(),
        "{setting}: there is no certificate in {}: give a PEM file, whose certificates stand \
         between BEGIN CERTIFICATE and END CERTIFICATE",
        path.display()
    );
    Ok(found)
}

fn read(setting: &str, path: &Path) -> anyhow::Result<Vec<u8>> {
    files::read(path, MAX_SETTINGS_BYTES).map_err(|cause| {
        let path = path.display();
        anyhow!("{setting}: {path} cannot be read ({cause}): check its path and its permissions")
    })
}
