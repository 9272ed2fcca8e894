//! The user name and the password of a camera, and the header that carries them.

use http_auth::{PasswordClient, PasswordParams, digest::Qop};
use lookdown_common::Secret;
use reqwest::{
    Url,
    header::{HeaderMap, HeaderValue, WWW_AUTHENTICATE},
};
use secrecy::ExposeSecret;

use crate::SourceError;

/// The user name and the password of a camera.
#[derive(Debug, Clone, PartialEq)]
pub struct Credentials {
    /// The user name.
    pub user: String,
    /// The password.
    pub password: Secret,
}

/// Authentication of requests to a camera, as the camera asks for it: Digest is preferred to Basic
/// (RFC 7616, RFC 7617). A camera that asked for Digest once gets no Basic later, which is the
/// password in plain text.
pub(crate) struct Login {
    credentials: Option<Credentials>,
    challenge: Option<PasswordClient>,
    has_digest: bool,
}

impl Login {
    /// Starts without a challenge: the first request carries no password.
    pub(crate) fn new(credentials: Option<Credentials>) -> Self {
        Self {
            credentials,
            challenge: None,
            has_digest: false,
        }
    }

    /// Forgets the challenge of the last connection.
    pub(crate) fn restart(&mut self) {
        self.challenge = None;
    }

    /// Takes the challenge of an HTTP response with the status 401.
    ///
    /// # Errors
    /// Those of [`Self::accept_challenges`].
    pub(crate) fn accept_challenge(&mut self, headers: &HeaderMap) -> Result<(), SourceError> {
        let challenges = headers.get_all(WWW_AUTHENTICATE).iter();
        self.accept_challenges(challenges.filter_map(|header| header.to_str().ok()))
    }

    /// Takes the challenges of a response with the status 401.
    ///
    /// # Errors
    /// [`SourceError`] if no request can answer them: there are no credentials, the scheme is
    /// unknown, or it is Basic after Digest.
    pub(crate) fn accept_challenges<'a>(
        &mut self,
        challenges: impl Iterator<Item = &'a str>,
    ) -> Result<(), SourceError> {
        self.challenge = None;
        if self.credentials.is_none() {
            return Err(SourceError::CredentialsMissing);
        }
        let mut builder = PasswordClient::builder();
        for challenge in challenges {
            builder = builder.challenges(challenge);
        }
        let challenge = builder
            .build()
            .map_err(|_| SourceError::UnknownAuthentication)?;
        match &challenge {
            PasswordClient::Digest(digest) => {
                self.has_digest = true;
                if !(digest.qop() & Qop::Auth) {
                    return Err(SourceError::UnknownAuthentication);
                }
            }
            _ if self.has_digest => return Err(SourceError::BasicAfterDigest),
            _ => {}
        }
        self.challenge = Some(challenge);
        Ok(())
    }

    /// The header `Authorization` of a GET request.
    pub(crate) fn authorization(&mut self, url: &Url) -> Option<HeaderValue> {
        let uri = match url.query() {
            Some(query) => format!("{}?{query}", url.path()),
            None => url.path().to_owned(),
        };
        let mut header = HeaderValue::try_from(self.respond("GET", &uri)?).ok()?;
        header.set_sensitive(true);
        Some(header)
    }

    /// The value of `Authorization` for a request.
    pub(crate) fn respond(&mut self, method: &str, uri: &str) -> Option<String> {
        let (credentials, challenge) = (self.credentials.as_ref()?, self.challenge.as_mut()?);
        let value = challenge.respond(&PasswordParams {
            username: &credentials.user,
            password: credentials.password.expose_secret(),
            uri,
            method,
            // A body would select auth-int, which http-auth computes wrongly.
            body: None,
        });
        value.ok()
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
        let offered = challenges(&["Basic realm=\"cam\"", digest]);
        login.accept_challenge(&offered).unwrap();
        let url = "http://camera/snap.jpg?size=1".parse().unwrap();
        let header = login.authorization(&url).unwrap();
        assert!(header.is_sensitive());
        let text = header.to_str().unwrap();
        assert!(text.starts_with("Digest "), "{text}");
        assert!(text.contains("uri=\"/snap.jpg?size=1\""), "{text}");
        assert!(!text.contains("Circle"), "{text}");
    }

    #[test]
    fn auth_is_chosen_where_auth_int_is_offered() {
        for qop in ["auth,auth-int", "auth-int, auth", "auth"] {
            let mut login = login();
            let digest = format!("Digest realm=\"onvif\", qop=\"{qop}\", nonce=\"abc\"");
            login
                .accept_challenges([digest.as_str()].into_iter())
                .unwrap();
            let header = login.respond("GET", "/snap.jpg").unwrap();
            assert!(header.contains("qop=auth,"), "{qop}: {header}");
            assert!(header.contains("nc=00000001"), "{header}");
        }
        let only = "Digest realm=\"onvif\", qop=\"auth-int\", nonce=\"abc\"";
        let refused = login().accept_challenges([only].into_iter());
        assert!(matches!(refused, Err(SourceError::UnknownAuthentication)));
    }

    #[test]
    fn an_unknown_scheme_or_no_password_is_reported() {
        let unknown = login().accept_challenge(&challenges(&["Negotiate"]));
        assert!(matches!(unknown, Err(SourceError::UnknownAuthentication)));
        let basic = challenges(&["Basic realm=\"cam\""]);
        let missing = Login::new(None).accept_challenge(&basic);
        assert!(matches!(missing, Err(SourceError::CredentialsMissing)));
        login().accept_challenge(&basic).unwrap();
    }

    #[test]
    fn no_password_is_sent_in_plain_text_after_digest() {
        let mut login = login();
        let digest = challenges(&["Digest realm=\"cam\", nonce=\"abc\", qop=\"auth\""]);
        login.accept_challenge(&digest).unwrap();
        login.restart();
        let basic = login.accept_challenge(&challenges(&["Basic realm=\"cam\""]));
        assert!(matches!(basic, Err(SourceError::BasicAfterDigest)));
        assert_eq!(login.respond("GET", "/"), None);
    }
}
