//! A task whose end is tied to a value.

use tokio::task::AbortHandle;

/// A task that ends when this value is dropped.
#[derive(Debug)]
pub struct AbortOnDrop(pub AbortHandle);

impl Drop for AbortOnDrop {
    fn drop(&mut self) {
        self.0.abort();
    }
}
