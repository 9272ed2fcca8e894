//! The content of the TLS files, with a digest that detects changes.

use std::{os::unix::fs::PermissionsExt, path::Path};

use rustls::pki_types::{
    CertificateDer, PrivateKeyDer,
    pem::{Error, PemObject},
};
use sha2::{Digest, Sha256};

use super::{TlsError, TlsOptions};
use lookdown_common::files::{self, MAX_SETTINGS_BYTES};

const CERTIFICATE: &str = "server.tls.certificate";
const PRIVATE_KEY: &str = "server.tls.private_key";
const CLIENT_CERTIFICATES: &str = "server.tls.client_certificates";
/// The permission bit of users that are neither owner nor group.
const READABLE_BY_OTHERS: u32 = 0o004;

/// The content of the files.
pub(super) struct TlsFiles {
    certificate: Vec<u8>,
    private_key: Vec<u8>,
    client_certificates: Option<Vec<u8>>,
}

impl TlsFiles {
    /// Reads all files.
    pub(super) fn read(options: &TlsOptions) -> Result<Self, TlsError> {
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
    ) -> Result<Vec<CertificateDer<'static>>, TlsError> {
        certificates(CERTIFICATE, &options.certificate, &self.certificate)
    }

    /// The server's private key.
    pub(super) fn key(&self, options: &TlsOptions) -> Result<PrivateKeyDer<'static>, TlsError> {
        PrivateKeyDer::from_pem_slice(&self.private_key).map_err(|error| {
            let path = options.private_key.clone();
            match error {
                Error::NoItemsFound => TlsError::NoKey { path },
                // The original error would quote the file.
                _ => TlsError::Damaged {
                    setting: PRIVATE_KEY,
                    path,
                },
            }
        })
    }

    /// The authorities of client certificates, if these are required.
    pub(super) fn authorities(
        &self,
        options: &TlsOptions,
    ) -> Result<Option<Vec<CertificateDer<'static>>>, TlsError> {
        let path = options.client_certificates.as_deref();
        let content = path.zip(self.client_certificates.as_deref());
        content
            .map(|(path, content)| certificates(CLIENT_CERTIFICATES, path, content))
            .transpose()
    }
}

/// The authorities in the file that the setting `setting` names.
pub(super) fn authorities(
    setting: &'static str,
    path: &Path,
) -> Result<Vec<CertificateDer<'static>>, TlsError> {
    certificates(setting, path, &read(setting, path)?)
}

/// The error about a certificate in one of the files.
pub(super) fn invalid(options: &TlsOptions, of_clients: bool, position: usize) -> TlsError {
    let (setting, path) = match &options.client_certificates {
        Some(path) if of_clients => (CLIENT_CERTIFICATES, path),
        _ => (CERTIFICATE, &options.certificate),
    };
    TlsError::InvalidCertificate {
        setting,
        path: path.clone(),
        position,
    }
}

/// Returns true if every user of the machine may read the file.
pub(super) fn is_readable_by_others(path: &Path) -> bool {
    path.metadata()
        .is_ok_and(|metadata| metadata.permissions().mode() & READABLE_BY_OTHERS != 0)
}

fn certificates(
    setting: &'static str,
    path: &Path,
    content: &[u8],
) -> Result<Vec<CertificateDer<'static>>, TlsError> {
    let found: Result<Vec<_>, _> = CertificateDer::pem_slice_iter(content).collect();
    let path = path.to_owned();
    match found {
        Ok(found) if found.is_empty() => Err(TlsError::NoCertificate { setting, path }),
        Ok(found) => Ok(found),
        Err(_) => Err(TlsError::Damaged { setting, path }),
    }
}

fn read(setting: &'static str, path: &Path) -> Result<Vec<u8>, TlsError> {
    files::read(path, MAX_SETTINGS_BYTES).map_err(|cause| TlsError::Unreadable {
        setting,
        path: path.to_owned(),
        cause,
    })
}
