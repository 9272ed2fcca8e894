//! Messages to publish.

use bytes::Bytes;

/// A message for a topic.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Message {
    pub(super) topic: String,
    pub(super) payload: Bytes,
    /// True if the broker keeps it for later subscribers.
    pub(super) retained: bool,
}

impl Message {
    /// A message that the broker retains.
    pub(super) fn retained(topic: String, payload: impl Into<Bytes>) -> Self {
        Self {
            topic,
            payload: payload.into(),
            retained: true,
        }
    }

    /// A message for current subscribers only.
    pub(super) fn passing(topic: String, payload: Bytes) -> Self {
        Self {
            topic,
            payload,
            retained: false,
        }
    }

    /// A message that deletes a retained one (MQTT 3.1.1, section 3.3.1.3).
    pub(super) fn forget(topic: String) -> Self {
        Self::retained(topic, Bytes::new())
    }
}
