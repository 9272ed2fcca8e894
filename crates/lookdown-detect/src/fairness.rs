//! Fairness between clients: the identity of a client, its priority levels, and budgets of which
//! one client may use half.

mod shared_budget;

use std::{
    fmt,
    net::{IpAddr, Ipv6Addr},
    str::FromStr,
    sync::Arc,
};

pub use shared_budget::{BudgetError, BudgetShare, SharedBudget};

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

/// A priority level of requests: [`PriorityLevel::HIGHEST`] is served first.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PriorityLevel(u32);

impl PriorityLevel {
    /// The highest level.
    pub const HIGHEST: u32 = 1;
    /// The lowest level.
    pub const LOWEST: u32 = 9;
    /// The level of requests that name none, as they would give it.
    pub const DEFAULT: &str = "5";

    /// Creates a level. Returns `None` for a number that is none.
    pub fn new(level: u32) -> Option<Self> {
        (Self::HIGHEST..=Self::LOWEST)
            .contains(&level)
            .then_some(Self(level))
    }

    /// The level as a number.
    pub fn get(self) -> u32 {
        self.0
    }
}

impl FromStr for PriorityLevel {
    type Err = InvalidPriorityLevel;

    fn from_str(text: &str) -> Result<Self, InvalidPriorityLevel> {
        let level = text.parse().ok().and_then(Self::new);
        level.ok_or(InvalidPriorityLevel)
    }
}

impl fmt::Display for PriorityLevel {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(formatter)
    }
}

/// The text is not a level.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error(
    "a priority is {} (highest) to {}",
    PriorityLevel::HIGHEST,
    PriorityLevel::LOWEST
)]
pub struct InvalidPriorityLevel;

impl Default for PriorityLevel {
    /// The level of requests that name none.
    fn default() -> Self {
        Self::DEFAULT.parse().unwrap_or(Self(Self::LOWEST))
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
