//! The address of the broker and the login, as one URL.

use std::{fmt, path::Path, str::FromStr};

use percent_encoding::percent_decode_str;
use secrecy::{ExposeSecret, SecretString};
use url::Url;

use crate::tls::{ClientTls, TlsError};

const PORT: u16 = 1883;
const TLS_PORT: u16 = 8883;

/// A broker, `mqtt://user:password@host:1883` or `mqtts://…`. Its password is never displayed.
#[derive(Clone, PartialEq, Eq)]
pub struct Broker {
    /// Host name or address. An IPv6 address has no brackets.
    pub host: String,
    /// Port.
    pub port: u16,
    /// True if the connection uses TLS.
    pub has_tls: bool,
    pub(super) login: Option<(String, String)>,
}

impl Broker {
    /// Returns the client side of TLS if the connection uses it. `authorities` is a PEM file; `None`
    /// trusts those of the system.
    pub(super) fn tls(&self, authorities: Option<&Path>) -> Result<Option<ClientTls>, TlsError> {
        let tls = || ClientTls::new("mqtt.authorities", authorities);
        self.has_tls.then(tls).transpose()
    }
}

impl Broker {
    /// Sets the password of the login.
    ///
    /// # Errors
    /// [`BrokerError`] if there is no user name, or a password already.
    pub fn with_password(mut self, password: &SecretString) -> Result<Self, BrokerError> {
        match &mut self.login {
            Some((_, own)) if own.is_empty() => password.expose_secret().clone_into(own),
            _ => return Err(BrokerError),
        }
        Ok(self)
    }
}

/// The text is no URL of a broker. The text is not repeated, as it may hold a password.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error(
    "not a URL of a broker: give one such as mqtt://user:password@host:1883, or mqtts:// for TLS (with \
     a mqtt.password_file: mqtt://user@host:1883), with other characters than letters and digits in the password percent-encoded"
)]
pub struct BrokerError;

impl FromStr for Broker {
    type Err = BrokerError;

    fn from_str(text: &str) -> Result<Self, BrokerError> {
        let url: Url = text.parse().map_err(|_| BrokerError)?;
        let has_tls = match url.scheme() {
            "mqtt" => false,
            "mqtts" => true,
            _ => return Err(BrokerError),
        };
        let host = url.host_str().filter(|host| !host.is_empty());
        let has_more = !matches!(url.path(), "" | "/") || url.query().is_some();
        if has_more || url.fragment().is_some() {
            return Err(BrokerError);
        }
        let host = host.ok_or(BrokerError)?;
        let user = decoded(url.username())?;
        let password = decoded(url.password().unwrap_or_default())?;
        Ok(Self {
            host: host.trim_matches(['[', ']']).to_owned(),
            port: url.port().unwrap_or(if has_tls { TLS_PORT } else { PORT }),
            has_tls,
            login: (!user.is_empty()).then_some((user, password)),
        })
    }
}

fn decoded(text: &str) -> Result<String, BrokerError> {
    let text = percent_decode_str(text).decode_utf8();
    text.map(Into::into).map_err(|_| BrokerError)
}

impl fmt::Display for Broker {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}:{}", self.host, self.port)
    }
}

impl fmt::Debug for Broker {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, formatter)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_url_names_host_port_login_and_whether_there_is_tls() {
        let broker: Broker = "mqtt://home:s%40cret%2F@broker.local".parse().unwrap();
        assert_eq!((broker.host.as_str(), broker.port), ("broker.local", 1883));
        assert!(!broker.has_tls);
        let login = Some(("home".to_owned(), "s@cret/".to_owned()));
        assert_eq!(broker.login, login);
        let broker: Broker = "mqtts://[::1]/".parse().unwrap();
        assert_eq!((broker.host.as_str(), broker.port), ("::1", 8883));
        assert!(broker.has_tls && broker.login.is_none());
        assert_eq!("mqtt://h:1".parse::<Broker>().unwrap().port, 1);
    }

    #[test]
    fn other_urls_are_refused_without_being_repeated() {
        for url in [
            "",
            "broker:1883",
            "http://broker",
            "mqtt://",
            "mqtt://broker:99999",
            "mqtt://broker/topic",
            "mqtt://broker?x=1",
            "mqtt://broker#x",
            "mqtt://u:%ff@broker",
        ] {
            let refused = url.parse::<Broker>();
            assert_eq!(refused, Err(BrokerError), "{url}");
        }
    }

    #[test]
    fn the_password_is_not_shown() {
        let broker: Broker = "mqtt://home:secret@broker:1".parse().unwrap();
        assert_eq!(format!("{broker:?} {broker}"), "broker:1 broker:1");
    }
}
