//! The address of the broker and the login, as one URL.

use std::{fmt, path::Path, str::FromStr};

use percent_encoding::percent_decode_str;
use url::Url;

use crate::tls::ClientTls;

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
    /// Sets the password of the user in the URL.
    ///
    /// # Errors
    /// If the URL has no user, or a password of its own.
    pub(crate) fn with_password(mut self, password: &str) -> Result<Self, &'static str> {
        match &mut self.login {
            None => Err("the URL of the broker has no user: give it as mqtt://user@host:1883"),
            Some((_, own)) if !own.is_empty() => {
                Err("the URL of the broker has a password, too: remove one of them")
            }
            Some((_, own)) => {
                password.clone_into(own);
                Ok(self)
            }
        }
    }

    /// Returns the client side of TLS if the connection uses it. `authorities` is a PEM file;
    /// `None` trusts those of the system.
    pub(super) fn tls(&self, authorities: Option<&Path>) -> anyhow::Result<Option<ClientTls>> {
        let tls = || ClientTls::new("mqtt.authorities", authorities);
        self.has_tls.then(tls).transpose()
    }
}

/// The text is not a URL of a broker. The text is not repeated, as it may hold a password.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error(
    "not a URL of a broker: give one such as mqtt://user:password@host:1883, or mqtts:// for TLS, \
     with other characters than letters and digits in the password percent-encoded"
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
    fn a_separate_password_belongs_to_the_user_of_the_url() {
        let broker: Broker = "mqtt://home@broker".parse().unwrap();
        let login = broker.with_password("s@cret/").unwrap().login;
        assert_eq!(login, Some(("home".to_owned(), "s@cret/".to_owned())));
        for (url, problem) in [
            ("mqtt://broker", "has no user"),
            ("mqtt://home:other@broker", "has a password, too"),
        ] {
            let broker: Broker = url.parse().unwrap();
            let refused = broker.with_password("secret").unwrap_err();
            assert!(refused.contains(problem), "{url}");
        }
    }

    #[test]
    fn the_password_is_not_shown() {
        let broker: Broker = "mqtt://home:secret@broker:1".parse().unwrap();
        assert_eq!(format!("{broker:?} {broker}"), "broker:1 broker:1");
    }
}
