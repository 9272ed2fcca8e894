//! The identity of a client, by which budgets and queues are shared.

use std::{
    fmt,
    net::{IpAddr, Ipv6Addr},
    sync::Arc,
};

/// The identity of a client.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub enum Client {
    /// The only client of a server, or the server itself. It may use whole budgets.
    #[default]
    Only,
    /// The client with the API key of this name.
    Key(Arc<str>),
    /// The client at this address, without a key.
    Address(IpAddr),
    /// All clients without a key and without a known address.
    Others,
}

impl Client {
    /// Returns the client with the API key of this name.
    pub fn with_key(name: &str) -> Self {
        Self::Key(name.into())
    }

    /// Returns the client at an address. A host has at least a /64 of IPv6 addresses, so such a
    /// prefix is one client.
    pub fn at(address: IpAddr) -> Self {
        Self::Address(match address.to_canonical() {
            IpAddr::V6(address) => {
                let prefix = address.to_bits() & !u128::from(u64::MAX);
                Ipv6Addr::from_bits(prefix).into()
            }
            address @ IpAddr::V4(_) => address,
        })
    }
}

/// A noun phrase for error messages.
impl fmt::Display for Client {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Only => f.write_str("the client"),
            Self::Key(name) => write!(f, "the key {name}"),
            Self::Address(address @ IpAddr::V4(_)) => write!(f, "the address {address}"),
            Self::Address(address @ IpAddr::V6(_)) => write!(f, "the network {address}/64"),
            Self::Others => f.write_str("the group of clients without a known address"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_addresses_of_a_host_are_one_client() {
        let at = |text: &str| Client::at(text.parse().unwrap());
        assert_eq!(at("2001:db8:1:2::1"), at("2001:db8:1:2:ffff::9"));
        assert_ne!(at("2001:db8:1:2::1"), at("2001:db8:1:3::1"));
        assert_eq!(at("::ffff:192.0.2.1"), at("192.0.2.1"));
        assert_ne!(at("192.0.2.1"), at("192.0.2.2"));
        let network = at("2001:db8:1:2::1").to_string();
        assert_eq!(network, "the network 2001:db8:1:2::/64");
    }
}
