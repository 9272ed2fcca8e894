//! The numbers of persons that the counts follow.

use std::{fmt, sync::Arc};

use parking_lot::RwLock;

/// Returns the number of a camera; `None` while it is unknown.
type Source = Arc<dyn Fn(&str) -> Option<u64> + Send + Sync>;

/// The persons that the counts of this process or of `counts.url` follow, if there are any. Clones
/// share them.
#[derive(Clone, Default)]
pub struct FollowedPersons(Arc<RwLock<Option<Source>>>);

impl FollowedPersons {
    /// Replaces the source of the numbers.
    pub fn set(&self, source: impl Fn(&str) -> Option<u64> + Send + Sync + 'static) {
        *self.0.write() = Some(Arc::new(source));
    }

    /// Returns the number of a camera; `None` while it is unknown.
    #[must_use]
    pub fn at(&self, camera: &str) -> Option<usize> {
        let source = self.0.read().clone()?;
        usize::try_from(source(camera)?).ok()
    }
}

impl fmt::Debug for FollowedPersons {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("FollowedPersons")
    }
}
