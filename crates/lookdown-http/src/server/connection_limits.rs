//! The limits of connections.

use std::{num::NonZeroUsize, time::Duration};

/// The limits of connections.
#[derive(Debug, Clone, PartialEq)]
pub struct ConnectionLimits {
    /// Most connections that are served at the same time.
    pub max_connections: NonZeroUsize,
    /// Longest time for the head of a request. On a new connection it includes the time before the
    /// first byte. Later it begins with the head's first byte.
    pub header_timeout: Duration,
    /// Longest time that a connection may be idle between two requests, or blocked because its
    /// client does not read the response.
    pub idle_timeout: Duration,
    /// Most bytes of a request's head. The service refuses a longer head, and a head of more than
    /// twice as many bytes never reaches it.
    pub max_header_bytes: usize,
    /// Most headers of a request, under the same rule.
    pub max_headers: usize,
}

impl Default for ConnectionLimits {
    fn default() -> Self {
        Self {
            max_connections: NonZeroUsize::new(512).unwrap_or(NonZeroUsize::MIN),
            header_timeout: Duration::from_secs(10),
            idle_timeout: Duration::from_secs(75),
            max_header_bytes: 16 * 1024,
            max_headers: 100,
        }
    }
}
