//! The certificates and settings that a server uses in handshakes, made of validated files.
//!
//! The content of the TLS files, with a digest that detects changes. Each error names the setting,
//! the file and the remedy, and none repeats the content of a file.

use std::{
    num::NonZeroU64,
    os::unix::fs::PermissionsExt,
    path::{Path, PathBuf},
    sync::Arc,
    time::Duration,
};

use anyhow::{Context, anyhow, ensure};
use jiff::{Timestamp, civil::DateTime, tz::TimeZone};
use lookdown_common::files::{self, MAX_SETTINGS_BYTES};
use rustls::{
    Error, RootCertStore, ServerConfig,
    crypto::{CryptoProvider, ring},
    pki_types::{
        CertificateDer, PrivateKeyDer,
        pem::{self, PemObject},
    },
    server::{WebPkiClientVerifier, danger::ClientCertVerifier},
    sign::{CertifiedKey, SingleCertAndKey},
    version::{TLS12, TLS13},
};
use sha2::{Digest, Sha256};

/// The application protocol over TLS (ALPN, RFC 7301).
const PROTOCOL: &[u8] = b"http/1.1";

/// Files that passed all checks, and that the TLS library refuses.
const REFUSED: &str = "server.tls: these files cannot be used together: give others";

/// The certificates and settings that a server uses in handshakes.
pub(super) struct Identity {
    /// The digest of the files that it is made of.
    pub(super) digest: [u8; 32],
    pub(super) config: Arc<ServerConfig>,
    /// The validity of the server's certificate, if it could be parsed.
    pub(super) validity: Option<Validity>,
}

impl Identity {
    /// Validates the content of the files: the key belongs to the certificate, and all can be used.
    pub(super) fn new(files: &TlsFiles, options: &TlsOptions) -> anyhow::Result<Self> {
        let provider = Arc::new(ring::default_provider());
        let certified = certified_key(files, options, &provider)?;
        let validity = certified
            .end_entity_cert()
            .ok()
            .and_then(|certificate| Validity::from_der(certificate));
        let builder = ServerConfig::builder_with_provider(Arc::clone(&provider))
            .with_protocol_versions(&[&TLS13, &TLS12])
            .context(REFUSED)?;
        let builder = match files.authorities(options)? {
            Some(authorities) => {
                builder.with_client_cert_verifier(verifier(authorities, options, provider)?)
            }
            None => builder.with_no_client_auth(),
        };
        let mut config = builder.with_cert_resolver(Arc::new(SingleCertAndKey::from(certified)));
        config.alpn_protocols = vec![PROTOCOL.to_vec()];
        Ok(Self {
            digest: files.digest(),
            config: Arc::new(config),
            validity,
        })
    }

    /// Logs problems that the operator should fix although TLS works.
    pub(super) fn warn(&self, now: Timestamp, options: &TlsOptions) {
        let certificate = options.certificate.display();
        match self.validity {
            Some(validity) if validity.not_after < now => tracing::warn!(
                "server.tls.certificate: {certificate} has expired at {}, and clients refuse it: \
                 replace it",
                validity.not_after
            ),
            Some(validity) if now < validity.not_before => tracing::warn!(
                "server.tls.certificate: {certificate} is valid from {} on, and clients refuse it \
                 until then: replace it, or check the clock",
                validity.not_before
            ),
            Some(_) => {}
            None => tracing::warn!(
                "server.tls.certificate: the validity of {certificate} cannot be parsed, so no \
                 metric shows it"
            ),
        }
        warn_of_readers(&options.private_key);
    }
}

fn warn_of_readers(private_key: &Path) {
    if is_readable_by_others(private_key) {
        tracing::warn!(
            "server.tls.private_key: every user of this machine may read {}: remove that permission \
             (chmod o-r; defaultMode: 0440 for a Secret of Kubernetes)",
            private_key.display()
        );
    }
}

fn certified_key(
    files: &TlsFiles,
    options: &TlsOptions,
    provider: &CryptoProvider,
) -> anyhow::Result<CertifiedKey> {
    let chain = files.chain(options)?;
    let key = files.key(options)?;
    CertifiedKey::from_der(chain, key, provider).map_err(|error| {
        let file = options.private_key.display();
        match error {
            Error::InconsistentKeys(_) => anyhow!(
                "server.tls.private_key: the private key in {file} is not that of the first \
                 certificate in {} (server.tls.certificate): give both files of one pair, the \
                 server's own certificate first",
                options.certificate.display()
            ),
            Error::InvalidCertificate(_) => invalid(options, false, 1),
            _ => anyhow!(
                "server.tls.private_key: the private key in {file} cannot be used: give an RSA key \
                 of 2048 bits or more, an ECDSA key on P-256 or P-384, or an Ed25519 key"
            ),
        }
    })
}

fn verifier(
    authorities: Vec<CertificateDer<'static>>,
    options: &TlsOptions,
    provider: Arc<CryptoProvider>,
) -> anyhow::Result<Arc<dyn ClientCertVerifier>> {
    let mut roots = RootCertStore::empty();
    for (position, certificate) in (1..).zip(authorities) {
        let added = roots.add(certificate);
        added.map_err(|_| invalid(options, true, position))?;
    }
    let verifier = WebPkiClientVerifier::builder_with_provider(Arc::new(roots), provider).build();
    verifier.context(REFUSED)
}

/// The tag of the optional version, the first field of a certificate.
const VERSION: u8 = 0xa0;
/// The tag of a time with a year of two digits.
const UTC_TIME: u8 = 0x17;

/// The validity period of a certificate (RFC 5280, section 4.1.2.5).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Validity {
    pub(super) not_before: Timestamp,
    pub(super) not_after: Timestamp,
}

/// An element of DER.
struct Element<'a> {
    tag: u8,
    content: &'a [u8],
}

impl Validity {
    /// Reads the validity of a DER certificate. Returns `None` if it cannot be parsed.
    pub(super) fn from_der(mut certificate: &[u8]) -> Option<Self> {
        let mut fields = next(&mut next(&mut certificate)?.content)?.content;
        if fields.first() == Some(&VERSION) {
            next(&mut fields)?;
        }
        // The serial number, the algorithm and the issuer.
        for _ in 0..3 {
            next(&mut fields)?;
        }
        let mut validity = next(&mut fields)?.content;
        Some(Self {
            not_before: timestamp(&next(&mut validity)?)?,
            not_after: timestamp(&next(&mut validity)?)?,
        })
    }
}

/// Takes the next element off the front of DER.
fn next<'a>(der: &mut &'a [u8]) -> Option<Element<'a>> {
    let [tag, first, rest @ ..] = *der else {
        return None;
    };
    let (length, rest) = match usize::from(*first) {
        short @ ..0x80 => (short, rest),
        long => {
            // The bytes of a length of at most 4 GiB.
            let (bytes, rest) = rest.split_at_checked(long - 0x80)?;
            let bytes = bytes.iter().map(|byte| usize::from(*byte));
            let length = bytes.fold(0_usize, |length, byte| length.saturating_mul(256) | byte);
            (length, rest)
        }
    };
    let (content, rest) = rest.split_at_checked(length)?;
    *der = rest;
    Some(Element { tag: *tag, content })
}

fn timestamp(time: &Element<'_>) -> Option<Timestamp> {
    let text = str::from_utf8(time.content).ok()?;
    let century = match time.tag {
        UTC_TIME if text >= "50" => "19",
        UTC_TIME => "20",
        _ => "",
    };
    let text = format!("{century}{text}");
    let time = DateTime::strptime("%Y%m%d%H%M%SZ", text).ok()?;
    Some(time.to_zoned(TimeZone::UTC).ok()?.timestamp())
}

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
            pem::Error::NoItemsFound => anyhow!(
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
pub(super) fn authorities_in(
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
