//! The highest priority level that a key permits.

use std::{fmt, str::FromStr};

/// A priority level of requests: 1 is the highest, 9 the lowest.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PriorityLevel(u32);

impl PriorityLevel {
    /// Creates a level. Returns `None` unless it is 1 to 9.
    #[must_use]
    pub fn new(level: u32) -> Option<Self> {
        (1..=9).contains(&level).then_some(Self(level))
    }

    /// The level as a number.
    #[must_use]
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
#[error("a priority is 1 (highest) to 9")]
pub struct InvalidPriorityLevel;

impl Default for PriorityLevel {
    /// The level of requests that name none.
    fn default() -> Self {
        Self(5)
    }
}
