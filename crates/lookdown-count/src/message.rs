//! Messages of webhooks and conditions that hold, as they are stored.

/// A message to be delivered.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Message {
    /// The same for every attempt.
    pub(crate) id: String,
    /// The digest of its webhook. The URL of the receiver may hold a password or a token.
    pub(crate) webhook: String,
    /// JSON.
    pub(crate) body: String,
    /// Time of the message, seconds since the Unix epoch.
    pub(crate) created_s: i64,
}

/// A condition that holds, as it is stored.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct HeldCondition {
    /// The digest of the webhook.
    pub(crate) webhook: String,
    pub(crate) camera: String,
}
