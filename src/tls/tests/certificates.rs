//! Certificates made for a test.

use std::{
    fs,
    os::unix::fs::PermissionsExt,
    path::{Path, PathBuf},
    time::Duration,
};

use rcgen::{BasicConstraints, CertificateParams, CertifiedIssuer, IsCa, KeyPair, date_time_ymd};
use tempfile::TempDir;

use super::super::TlsOptions;

/// An authority that issues certificates.
pub(super) struct Authority(CertifiedIssuer<'static, KeyPair>);

/// A certificate and its private key, PEM.
pub(super) struct Pair {
    pub(super) certificate: String,
    pub(super) private_key: String,
}

impl Authority {
    pub(super) fn new() -> Self {
        let mut parameters = CertificateParams::new(Vec::new()).unwrap();
        parameters.is_ca = IsCa::Ca(BasicConstraints::Unconstrained);
        let key = KeyPair::generate().unwrap();
        Self(CertifiedIssuer::self_signed(parameters, key).unwrap())
    }

    pub(super) fn pem(&self) -> String {
        self.0.pem()
    }

    /// A certificate for `localhost`, valid from the year 2000 until the first of January `year`.
    pub(super) fn issue_until(&self, year: i32) -> Pair {
        let mut parameters = CertificateParams::new(vec!["localhost".to_owned()]).unwrap();
        parameters.not_before = date_time_ymd(2000, 1, 1);
        parameters.not_after = date_time_ymd(year, 1, 1);
        let key = KeyPair::generate().unwrap();
        let certificate = parameters.signed_by(&key, &self.0).unwrap();
        Pair {
            certificate: certificate.pem(),
            private_key: key.serialize_pem(),
        }
    }

    pub(super) fn issue(&self) -> Pair {
        self.issue_until(2090)
    }
}

/// The files of a server.
pub(super) struct Files {
    folder: TempDir,
    pub(super) options: TlsOptions,
}

impl Files {
    pub(super) fn new(pair: &Pair) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let options = TlsOptions {
            certificate: folder.path().join("server.pem"),
            private_key: folder.path().join("server.key"),
            client_certificates: None,
            poll_seconds: None,
            handshake_timeout: Duration::from_secs(20),
        };
        let files = Self { folder, options };
        files.replace(pair);
        files
    }

    pub(super) fn replace(&self, pair: &Pair) {
        fs::write(&self.options.certificate, &pair.certificate).unwrap();
        fs::write(&self.options.private_key, &pair.private_key).unwrap();
        let_read(&self.options.private_key, 0o600);
    }

    /// Requires client certificates of these authorities, PEM.
    pub(super) fn ask_clients(&mut self, authorities: &str) -> PathBuf {
        let file = self.folder.path().join("clients.pem");
        fs::write(&file, authorities).unwrap();
        self.options.client_certificates = Some(file.clone());
        file
    }
}

/// Changes the permissions of a file.
pub(super) fn let_read(file: &Path, mode: u32) {
    fs::set_permissions(file, fs::Permissions::from_mode(mode)).unwrap();
}
