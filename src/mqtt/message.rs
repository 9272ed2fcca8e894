//! What is published.

use bytes::Bytes;

/// A message for a topic.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Message {
    pub(super) topic: String,
    pub(super) payload: Bytes,
    /// Whether the broker keeps it for whoever comes later.
    pub(super) retained: bool,
}

impl Message {
    /// One that is kept.
    pub(super) fn retained(topic: String, payload: impl Into<Bytes>) -> Self {
        Self {
            topic,
            payload: payload.into(),
            retained: true,
        }
    }

    /// One for those who listen now.
    pub(super) fn passing(topic: String, payload: Bytes) -> Self {
        Self {
            topic,
            payload,
            retained: false,
        }
    }

    /// One that makes the broker forget what it keeps (MQTT 3.1.1, section 3.3.1.3).
    pub(super) fn forget(topic: String) -> Self {
        Self::retained(topic, Bytes::new())
    }
}
