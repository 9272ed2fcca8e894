//! The priority levels of requests.

use std::{fmt, str::FromStr};

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
