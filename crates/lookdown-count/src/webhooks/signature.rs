//! The signature of a message (Standard Webhooks 1.0, symmetric).

use base64::{Engine as _, engine::general_purpose::STANDARD};
use ring::hmac;
use secrecy::{ExposeSecret, SecretSlice};

/// The prefix of secrets.
const PREFIX: &str = "whsec_";
/// Bytes of a secret.
const BYTES: std::ops::RangeInclusive<usize> = 24..=64;

/// The secret that a receiver shares.
#[derive(Debug, Clone)]
pub(crate) struct SigningKey(SecretSlice<u8>);

impl PartialEq for SigningKey {
    fn eq(&self, other: &Self) -> bool {
        self.0.expose_secret() == other.0.expose_secret()
    }
}

impl SigningKey {
    /// Parses a secret, `whsec_` and base64. The error does not repeat it.
    pub(crate) fn parse(text: &str) -> Result<Self, &'static str> {
        let problem = "the secret is invalid: write whsec_ and the base64 of 24 to 64 random bytes, such as \
                       `echo whsec_$(openssl rand -base64 32)` prints";
        let encoded = text.trim().strip_prefix(PREFIX).ok_or(problem)?;
        let bytes = STANDARD.decode(encoded).map_err(|_| problem)?;
        if !BYTES.contains(&bytes.len()) {
            return Err(problem);
        }
        Ok(Self(bytes.into()))
    }

    /// Returns the header `webhook-signature`.
    pub(crate) fn sign(&self, id: &str, timestamp_s: i64, body: &str) -> String {
        let key = hmac::Key::new(hmac::HMAC_SHA256, self.0.expose_secret());
        let signed = format!("{id}.{timestamp_s}.{body}");
        let signature = hmac::sign(&key, signed.as_bytes());
        format!("v1,{}", STANDARD.encode(signature))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_example_of_the_specification_is_reproduced() {
        let key = SigningKey::parse("whsec_MfKQ9r8GKYqrTwjUPD8ILPZIo2LaLaSw").unwrap();
        let signature = key.sign(
            "msg_p5jXN8AQM9LWM0D4loKWxJek",
            1_614_265_330,
            r#"{"test": 2432232314}"#,
        );
        assert_eq!(signature, "v1,g0hM9SsE+OTPJTGt/tmIKtSyZlE3uFJELVlNIOLJ1OE=");
    }

    #[test]
    fn other_secrets_are_refused() {
        for secret in [
            "",
            "MfKQ9r8GKYqrTwjUPD8ILPZIo2LaLaSw",
            "whsec_short",
            "whsec_!",
        ] {
            assert!(SigningKey::parse(secret).is_err(), "{secret}");
        }
    }
}
