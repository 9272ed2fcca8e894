//! The certificates and settings that a server uses in handshakes, made of validated files.
//!
//! The validity period of a certificate.

use std::{path::Path, sync::Arc};

use anyhow::{Context, anyhow};
use jiff::{Timestamp, civil::DateTime, tz::TimeZone};
use rustls::{
    Error, RootCertStore, ServerConfig,
    crypto::{CryptoProvider, ring},
    pki_types::CertificateDer,
    server::{WebPkiClientVerifier, danger::ClientCertVerifier},
    sign::{CertifiedKey, SingleCertAndKey},
    version::{TLS12, TLS13},
};

use super::files::{TlsFiles, TlsOptions, invalid, is_readable_by_others};

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
