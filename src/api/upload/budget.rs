//! The memory that requests may hold: their bodies, and what is unpacked from them.

use std::sync::Arc;

use bytes::Bytes;
use tokio::sync::{OwnedSemaphorePermit, Semaphore};

use crate::api::problem::{Problem, ProblemKind};

/// The memory that all bodies, and tensors unpacked from them, may hold together, counted in bytes. Clones
/// share it.
#[derive(Clone)]
pub(in crate::api) struct UploadBudget {
    bytes: Arc<Semaphore>,
    /// The advice to clients for whose bodies nothing is left.
    remedy: &'static str,
}

impl UploadBudget {
    pub(in crate::api) fn new(bytes: usize, remedy: &'static str) -> Self {
        let bytes = Semaphore::new(bytes.min(Semaphore::MAX_PERMITS));
        Self {
            bytes: Arc::new(bytes),
            remedy,
        }
    }

    /// A share of so many bytes, which is given back when it is dropped. Refused when fewer are free.
    pub(in crate::api) fn take(&self, bytes: usize) -> Result<OwnedSemaphorePermit, Problem> {
        let bytes = u32::try_from(bytes).map_err(|_| self.exhausted())?;
        let share = Arc::clone(&self.bytes).try_acquire_many_owned(bytes);
        share.map_err(|_| self.exhausted())
    }

    fn exhausted(&self) -> Problem {
        let remedy = self.remedy;
        let detail = format!("too many request bodies are in memory already: {remedy}");
        Problem::new(ProblemKind::Overloaded, detail)
    }
}

/// Something in memory together with its share of the budget.
pub(in crate::api) struct Held<T> {
    content: T,
    _share: OwnedSemaphorePermit,
}

impl<T> Held<T> {
    pub(in crate::api) fn new(content: T, share: OwnedSemaphorePermit) -> Self {
        Self {
            content,
            _share: share,
        }
    }
}

impl Held<Bytes> {
    pub(super) fn bytes(&self) -> Bytes {
        self.content.clone()
    }

    /// Other bytes, copied from these, in their place.
    pub(super) fn with_bytes(self, content: Bytes) -> Self {
        Self { content, ..self }
    }

    /// Plain bytes that give their share back when the last clone of them is gone.
    pub(in crate::api) fn into_bytes(self) -> Bytes {
        Bytes::from_owner(self)
    }
}

impl<T: AsRef<U>, U: ?Sized> AsRef<U> for Held<T> {
    fn as_ref(&self) -> &U {
        self.content.as_ref()
    }
}
