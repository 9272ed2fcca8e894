//! The cameras of a query or a listener.

/// The cameras of a query.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub enum Cameras {
    /// Every camera.
    All,
    /// This camera.
    One(String),
}
