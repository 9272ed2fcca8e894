//! The number of followed persons, which `lookdown count` hands back.

use std::time::Duration;

use jiff::Timestamp;

/// A followed number is valid for this time.
pub const FOLLOWED_FOR: Duration = Duration::from_secs(15);

/// The number of followed persons, as it was handed back.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FollowedNumber {
    /// The number of persons.
    pub persons: usize,
    /// The time at which it was handed back.
    pub at: Timestamp,
}

impl FollowedNumber {
    /// Returns true while it is valid.
    #[must_use]
    pub fn is_valid(&self, now: Timestamp) -> bool {
        let age = now.duration_since(self.at);
        Duration::try_from(age).map_or(true, |age| age <= FOLLOWED_FOR)
    }
}
