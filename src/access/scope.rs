//! What a key opens.

use std::{fmt, str::FromStr};

/// What a key opens.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scope {
    /// Finding the persons in frames.
    Detect,
    /// Reading calibrations, view plans and the list of models.
    Read,
    /// Everything, changes of calibrations and models included.
    Admin,
}

impl Scope {
    /// Every scope.
    pub const ALL: [Self; 3] = [Self::Detect, Self::Read, Self::Admin];

    /// As it is written in files and commands.
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

/// There is no such scope.
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

/// The scopes of one key, in the order of [`Scope::ALL`]; never none.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Scopes(Vec<Scope>);

impl Scopes {
    /// These scopes; `None` when there is none.
    #[must_use]
    pub fn new(given: &[Scope]) -> Option<Self> {
        let given = Scope::ALL.into_iter().filter(|scope| given.contains(scope));
        let given: Vec<_> = given.collect();
        (!given.is_empty()).then_some(Self(given))
    }

    /// Whether `wanted` is among them; `admin` includes all.
    #[must_use]
    pub fn allow(&self, wanted: Scope) -> bool {
        self.0.contains(&wanted) || self.0.contains(&Scope::Admin)
    }

    /// Their names, with `separator` between them.
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
    fn a_scope_opens_itself_and_admin_opens_all() {
        for own in Scope::ALL {
            for wanted in Scope::ALL {
                let opens = Scopes::new(&[own]).unwrap().allow(wanted);
                assert_eq!(opens, own == wanted || own == Scope::Admin);
            }
        }
        assert_eq!(Scopes::new(&[]), None);
    }
}
