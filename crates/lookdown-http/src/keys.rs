//! The keys that a request presents, and the check of a single key.

use axum::http::{HeaderMap, HeaderName, HeaderValue, header::AUTHORIZATION};
use base64::{Engine as _, engine::general_purpose::STANDARD};
use secrecy::{ExposeSecret, SecretString};
use sha2::{Digest, Sha256};
use subtle::ConstantTimeEq;

use crate::problem::{Kind, Problem};

/// The header that holds a key alone.
pub const API_KEY: HeaderName = HeaderName::from_static("x-api-key");
const BEARER: &[u8] = b"bearer ";
const BASIC: &[u8] = b"basic ";

/// Returns the keys in the headers. Other schemes of `Authorization` are ignored: they may be meant
/// for a proxy.
pub fn presented(headers: &HeaderMap) -> impl Iterator<Item = &[u8]> {
    let bearers = headers.get_all(AUTHORIZATION).iter().filter_map(|value| {
        let (scheme, key) = value.as_bytes().split_at_checked(BEARER.len())?;
        scheme
            .eq_ignore_ascii_case(BEARER)
            .then(|| key.trim_ascii())
    });
    let plain = headers.get_all(API_KEY).iter();
    bearers.chain(plain.map(HeaderValue::as_bytes))
}

/// Returns the password of Basic authentication (RFC 7617).
pub fn basic_password(headers: &HeaderMap) -> Option<String> {
    let value = headers.get(AUTHORIZATION)?.as_bytes();
    let (scheme, credentials) = value.split_at_checked(BASIC.len())?;
    let is_basic = scheme.eq_ignore_ascii_case(BASIC);
    let credentials = STANDARD.decode(credentials.trim_ascii());
    let credentials = String::from_utf8(credentials.ok().filter(|_| is_basic)?).ok()?;
    let (_, password) = credentials.split_once(':')?;
    Some(password.to_owned())
}

/// Returns the single key of a request.
///
/// # Errors
/// [`Problem`] without a key, or with more than one.
pub fn only_key<'a>(mut keys: impl Iterator<Item = &'a [u8]>) -> Result<&'a [u8], Problem> {
    match (keys.next(), keys.next()) {
        (Some(key), None) => Ok(key),
        (None, _) => Err(Problem::new(
            Kind::KeyRequired,
            "the request needs a key: send it as Authorization: Bearer KEY or as X-API-Key: KEY",
        )),
        (Some(_), Some(_)) => Err(Problem::new(
            Kind::KeyRequired,
            "more than one key was sent: send one, as Authorization: Bearer KEY or as X-API-Key: \
             KEY",
        )),
    }
}

/// Checks that the request presents this key.
///
/// # Errors
/// [`Problem`] otherwise.
pub fn check(headers: &HeaderMap, key: &SecretString) -> Result<(), Problem> {
    let given = only_key(presented(headers))?;
    // Digests of equal length make the time of the comparison independent of the key.
    let [given, wanted] = [given, key.expose_secret().as_bytes()].map(Sha256::digest);
    if bool::from(given.ct_eq(&wanted)) {
        return Ok(());
    }
    let detail = "the key is not valid: it was mistyped, or the operator has changed it";
    Err(Problem::new(Kind::KeyRequired, detail))
}
