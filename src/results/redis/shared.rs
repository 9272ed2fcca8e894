//! The options and the state that the store shares with its background tasks.

use std::sync::Arc;

use super::{
    RedisAddress, connect::Connector, followed::Followed, keys::Keys, link::Link, outbox::Outbox,
};
use crate::{
    metrics::IntCounter,
    results::{Listeners, ResultLimits},
};

/// The Redis server and the part of it that this installation uses.
#[derive(Debug, Clone, PartialEq)]
pub struct RedisOptions {
    /// Its address.
    pub address: RedisAddress,
    /// The prefix of all keys: servers with the same prefix share their reports.
    pub key_prefix: String,
}

/// The state that the store shares with its background tasks.
pub(super) struct Shared {
    pub(super) options: RedisOptions,
    pub(super) connector: Connector,
    pub(super) limits: ResultLimits,
    pub(super) keys: Keys,
    pub(super) link: Link,
    pub(super) followed: Followed,
    pub(super) outbox: Outbox,
    pub(super) listeners: Arc<Listeners>,
    pub(super) stored: IntCounter,
}
