//! The priority levels of requests.

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
    #[must_use]
    pub fn new(level: u32) -> Option<Self> {
        (Self::HIGHEST..=Self::LOWEST)
            .contains(&level)
            .then_some(Self(level))
    }

    /// The level as a number.
    #[must_use]
    pub fn get(self) -> u32 {
        self.0
    }
}

impl Default for PriorityLevel {
    /// The level of requests that name none.
    fn default() -> Self {
        Self(Self::DEFAULT.parse().unwrap_or(Self::LOWEST))
    }
}
