//! The priority of a frame in every queue.

/// The priority of a frame in every queue. Within a priority, clients take turns.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub enum Priority {
    /// Served first.
    High,
    /// Served after high priority.
    #[default]
    Normal,
    /// Served last.
    Low,
}

impl Priority {
    /// Returns the priority of a level in a request: 1 to 3 are high, 4 to 6 normal, 7 to 9 low.
    pub fn from_level(level: u32) -> Self {
        match level {
            ..=3 => Self::High,
            4..=6 => Self::Normal,
            7.. => Self::Low,
        }
    }

    /// Returns the smallest level of the priority.
    pub fn highest_level(self) -> u32 {
        match self {
            Self::High => 1,
            Self::Normal => 4,
            Self::Low => 7,
        }
    }
}
