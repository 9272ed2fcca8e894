//! The user name and the password of a camera, and the header that carries them.

use http_auth::{PasswordClient, PasswordParams};
use reqwest::{
    Url,
    header::{HeaderMap, HeaderValue, WWW_AUTHENTICATE},
};
use secrecy::{ExposeSecret, SecretString};

/// The user name and the password of a camera.
#[derive(Debug, Clone)]
pub struct Credentials {
    /// The user name.
    pub user: String,
    /// The password.
    pub password: SecretString,
}

impl PartialEq for Credentials {
    fn eq(&self, other: &Self) -> bool {
        self.user == other.user && self.password.expose_secret() == other.password.expose_secret()
    }
}

/// Authentication of requests to a camera, as the camera asks for it: Digest is preferred to Basic
/// (RFC 7616, RFC 7617).
pub(crate) struct Login {
    credentials: Option<Credentials>,
    challenge: Option<PasswordClient>,
}

impl Login {
    /// Starts without a challenge: the first request carries no password.
    pub(crate) fn new(credentials: Option<Credentials>) -> Self {
        Self {
            credentials,
            challenge: None,
        }
    }

    /// Takes the challenge of a response with the status 401. Returns false if no request can
    /// answer it: there are no credentials, or the scheme is unknown.
    pub(crate) fn accept_challenge(&mut self, headers: &HeaderMap) -> bool {
        let challenges = headers.get_all(WWW_AUTHENTICATE).iter();
        let mut builder = PasswordClient::builder();
        for challenge in challenges.filter_map(|header| header.to_str().ok()) {
            builder = builder.challenges(challenge);
        }
        self.challenge = builder.build().ok();
        self.credentials.is_some() && self.challenge.is_some()
    }

    /// The header `Authorization` of a GET request.
    pub(crate) fn authorization(&mut self, url: &Url) -> Option<HeaderValue> {
        let (credentials, challenge) = (self.credentials.as_ref()?, self.challenge.as_mut()?);
        let uri = match url.query() {
            Some(query) => format!("{}?{query}", url.path()),
            None => url.path().to_owned(),
        };
        let value = challenge.respond(&PasswordParams {
            username: &credentials.user,
            password: credentials.password.expose_secret(),
            uri: &uri,
            method: "GET",
            body: Some(&[]),
        });
        let mut header = HeaderValue::try_from(value.ok()?).ok()?;
        header.set_sensitive(true);
        Some(header)
    }

    /// The user name.
    pub(crate) fn user(&self) -> Option<&str> {
        Some(&self.credentials.as_ref()?.user)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn login() -> Login {
        Login::new(Some(Credentials {
            user: "Mufasa".to_owned(),
            password: "Circle of Life".into(),
        }))
    }

    fn challenges(values: &[&'static str]) -> HeaderMap {
        let values = values.iter().copied();
        values
            .map(|value| (WWW_AUTHENTICATE, HeaderValue::from_static(value)))
            .collect()
    }

    #[test]
    fn the_first_request_carries_no_password() {
        let url = "http://camera/snap.jpg".parse().unwrap();
        assert_eq!(login().authorization(&url), None);
    }

    #[test]
    fn digest_is_preferred_to_basic() {
        let mut login = login();
        let digest = "Digest realm=\"cam\", qop=\"auth\", nonce=\"abc\", algorithm=MD5";
        assert!(login.accept_challenge(&challenges(&["Basic realm=\"cam\"", digest])));
        let url = "http://camera/snap.jpg?size=1".parse().unwrap();
        let header = login.authorization(&url).unwrap();
        assert!(header.is_sensitive());
        let text = header.to_str().unwrap();
        assert!(text.starts_with("Digest "), "{text}");
        assert!(text.contains("uri=\"/snap.jpg?size=1\""), "{text}");
        assert!(!text.contains("Circle"), "{text}");
    }

    #[test]
    fn an_unknown_scheme_or_no_password_is_reported() {
        let unknown = challenges(&["Negotiate"]);
        assert!(!login().accept_challenge(&unknown));
        let basic = challenges(&["Basic realm=\"cam\""]);
        assert!(!Login::new(None).accept_challenge(&basic));
        assert!(login().accept_challenge(&basic));
    }
}
