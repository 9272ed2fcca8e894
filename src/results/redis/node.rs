//! The address of a Redis, or of a node of a Redis Cluster.

use std::fmt;

use redis::{ErrorKind, RedisError, ServerErrorKind};

/// The address of a node.
#[derive(Clone, PartialEq, Eq)]
pub(super) struct Node {
    pub(super) host: String,
    pub(super) port: u16,
}

impl Node {
    pub(super) fn new(host: &str, port: u16) -> Self {
        let host = host.to_owned();
        Self { host, port }
    }

    /// The node that an error names as the one that serves the slot. A cluster may omit the host if
    /// it is that of the node which answered.
    pub(super) fn redirected(&self, error: &RedisError) -> Option<Self> {
        if error.kind() != ErrorKind::Server(ServerErrorKind::Moved) {
            return None;
        }
        let (address, _) = error.redirect_node()?;
        let (host, port) = address.rsplit_once(':')?;
        let host = if host.is_empty() { &self.host } else { host };
        Some(Self::new(host, port.parse().ok()?))
    }
}

impl fmt::Display for Node {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}:{}", self.host, self.port)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn moved(detail: &str) -> RedisError {
        let error = redis::parse_redis_value(format!("-MOVED {detail}\r\n").as_bytes());
        error.unwrap().extract_error().unwrap_err()
    }

    #[test]
    fn redirection_names_the_node_that_serves_the_slot() {
        for (detail, node) in [
            ("7 10.0.0.2:7001", "10.0.0.2:7001"),
            ("7 :7001", "redis:7001"),
            ("7 fd00::2:7001", "fd00::2:7001"),
        ] {
            let redirected = Node::new("redis", 7000).redirected(&moved(detail)).unwrap();
            assert_eq!(redirected.to_string(), node);
        }
        for detail in ["7 10.0.0.2", "7 10.0.0.2:port", "7"] {
            assert!(
                Node::new("redis", 7000)
                    .redirected(&moved(detail))
                    .is_none(),
                "{detail}"
            );
        }
    }
}
