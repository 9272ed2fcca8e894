//! The operations that a key permits.

use std::{fmt, str::FromStr};

/// A group of operations that a key permits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scope {
    /// Detect persons in frames.
    Detect,
    /// Read calibrations, view plans and the list of models.
    Read,
    /// Everything, including changes of calibrations and models.
    Admin,
}

impl Scope {
    /// Every scope.
    pub const ALL: [Self; 3] = [Self::Detect, Self::Read, Self::Admin];

    /// The name in files and commands.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Detect => "detect",
            Self::Read => "read",
            Self::Admin => "admin",
        }
    }
}

impl fmt::Display for Scope {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(self.name())
    }
}

/// The scope is unknown.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("a scope is detect, read or admin")]
pub struct UnknownScope;

impl FromStr for Scope {
    type Err = UnknownScope;

    fn from_str(name: &str) -> Result<Self, UnknownScope> {
        let mut all = Self::ALL.into_iter();
        all.find(|scope| scope.name() == name).ok_or(UnknownScope)
    }
}

/// The scopes of one key, in the order of [`Scope::ALL`], at least one.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Scopes(Vec<Scope>);

impl Scopes {
    /// Creates a set of these scopes. Returns `None` if there is none.
    #[must_use]
    pub fn new(given: &[Scope]) -> Option<Self> {
        let given = Scope::ALL.into_iter().filter(|scope| given.contains(scope));
        let given: Vec<_> = given.collect();
        (!given.is_empty()).then_some(Self(given))
    }

    /// Returns true if `wanted` is among them. `admin` includes all.
    #[must_use]
    pub fn allow(&self, wanted: Scope) -> bool {
        self.0.contains(&wanted) || self.0.contains(&Scope::Admin)
    }

    /// Their names, separated by `separator`.
    #[must_use]
    pub fn joined(&self, separator: &str) -> String {
        let names: Vec<_> = self.0.iter().map(|scope| scope.name()).collect();
        names.join(separator)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_scope_permits_itself_and_admin_permits_all() {
        for own in Scope::ALL {
            for wanted in Scope::ALL {
                let opens = Scopes::new(&[own]).unwrap().allow(wanted);
                assert_eq!(opens, own == wanted || own == Scope::Admin);
            }
        }
        assert_eq!(Scopes::new(&[]), None);
    }
}
