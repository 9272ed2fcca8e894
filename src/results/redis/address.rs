//! The address of a Redis.

use std::{fmt, str::FromStr};

use redis::{Client, ConnectionAddr};
use url::Url;

/// The address and the credentials of a Redis. It is displayed without the credentials.
#[derive(Clone)]
pub struct RedisAddress {
    url: Url,
    client: Client,
}

/// The text is not an address of a Redis. The text is not repeated, as it may hold a password.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error(
    "give redis://host:port/database, or rediss:// for TLS, with user:password@ before \
     the host where a login is needed"
)]
pub struct RedisAddressError;

impl RedisAddress {
    pub(super) fn client(&self) -> &Client {
        &self.client
    }

    /// The number of the database.
    pub(super) fn database(&self) -> i64 {
        self.client.get_connection_info().redis_settings().db()
    }
}

impl FromStr for RedisAddress {
    type Err = RedisAddressError;

    fn from_str(text: &str) -> Result<Self, RedisAddressError> {
        let url: Url = text.parse().map_err(|_| RedisAddressError)?;
        let is_plain = url.query().is_none() && url.fragment().is_none();
        if !matches!(url.scheme(), "redis" | "rediss") || !is_plain {
            return Err(RedisAddressError);
        }
        let client = Client::open(url.clone()).map_err(|_| RedisAddressError)?;
        Ok(Self { url, client })
    }
}

impl PartialEq for RedisAddress {
    fn eq(&self, other: &Self) -> bool {
        self.url == other.url
    }
}

impl fmt::Display for RedisAddress {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let info = self.client.get_connection_info();
        if let ConnectionAddr::Tcp(_, port) | ConnectionAddr::TcpTls { port, .. } = info.addr() {
            let host = self.url.host_str().unwrap_or_default();
            write!(formatter, "{}://{host}:{port}", self.url.scheme())?;
        }
        write!(formatter, "/{}", self.database())
    }
}

impl fmt::Debug for RedisAddress {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, formatter)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_address_is_shown_without_its_credentials() {
        for (text, shown) in [
            ("redis://localhost", "redis://localhost:6379/0"),
            ("redis://:s3cret@redis:6380/2", "redis://redis:6380/2"),
            ("rediss://me:s3cret@[::1]/", "rediss://[::1]:6379/0"),
        ] {
            let address: RedisAddress = text.parse().unwrap();
            assert_eq!(address.to_string(), shown);
            assert_eq!(format!("{address:?}"), shown);
        }
    }

    #[test]
    fn other_texts_are_refused_without_being_repeated() {
        for text in [
            "",
            "localhost:6379",
            "http://:s3cret@localhost",
            "redis://:s3cret@localhost/first",
            "redis://:s3cret@",
            "rediss://:s3cret@localhost/#insecure",
            "redis://:s3cret@localhost?protocol=7",
        ] {
            let error = text.parse::<RedisAddress>().unwrap_err();
            assert!(!error.to_string().contains("s3cret"), "{text}");
        }
    }
}
