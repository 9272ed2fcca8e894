//! The operations that a key permits.

use strum::{Display, EnumString, IntoStaticStr, VariantArray};

/// A group of operations that a key permits.
#[derive(
    Debug,
    Clone,
    Copy,
    PartialEq,
    Eq,
    Display,
    EnumString,
    IntoStaticStr,
    VariantArray,
    strum::VariantNames,
)]
#[strum(serialize_all = "snake_case")]
pub enum Scope {
    /// Detect persons in frames.
    Detect,
    /// Read calibrations, view plans, results and counts.
    Read,
    /// See the images of views.
    View,
    /// Everything, including changes of calibrations and cameras.
    Admin,
}

impl Scope {
    /// Returns the name, as in files and commands.
    pub fn name(self) -> &'static str {
        self.into()
    }
}

/// The scopes of one key, in the order of the declaration of [`Scope`]; never none.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Scopes(Vec<Scope>);

impl Scopes {
    /// Creates a set of these scopes. Returns `None` if there is none.
    pub fn new(given: &[Scope]) -> Option<Self> {
        let given = Scope::VARIANTS.iter().filter(|scope| given.contains(scope));
        let given: Vec<_> = given.copied().collect();
        (!given.is_empty()).then_some(Self(given))
    }

    /// Returns true if `wanted` is among them. `admin` includes all.
    pub fn allow(&self, wanted: Scope) -> bool {
        self.0.contains(&wanted) || self.0.contains(&Scope::Admin)
    }

    /// Their names, separated by `separator`.
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
        for &own in Scope::VARIANTS {
            for &wanted in Scope::VARIANTS {
                let opens = Scopes::new(&[own]).unwrap().allow(wanted);
                assert_eq!(opens, own == wanted || own == Scope::Admin);
            }
        }
        assert_eq!(Scopes::new(&[]), None);
    }
}
