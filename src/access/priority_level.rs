//! The highest priority level that a key permits.

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

impl Default for PriorityLevel {
    /// The level of requests that name none.
    fn default() -> Self {
        Self(5)
    }
}
