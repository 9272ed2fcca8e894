//! The memory budget of requests: their bodies, and the tensors unpacked from them.

use std::sync::Arc;

use bytes::Bytes;
use tokio::sync::{OwnedSemaphorePermit, Semaphore};

use crate::api::http::problem::{Problem, ProblemKind};

/// The memory of all bodies and of the tensors unpacked from them, in bytes. Clones share it.
#[derive(Clone)]
pub(in crate::api) struct UploadBudget {
    bytes: Arc<Semaphore>,
    /// The advice for a client whose body finds no free memory.
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

    /// Reserves a number of bytes until the permit is dropped. Fails when fewer are free.
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

/// A value in memory together with its permit.
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
    pub(in crate::api) fn bytes(&self) -> Bytes {
        self.content.clone()
    }

    /// Replaces the bytes by a copied part of them.
    pub(in crate::api) fn with_bytes(self, content: Bytes) -> Self {
        Self { content, ..self }
    }

    /// Returns plain bytes that release the permit when their last clone is dropped.
    pub(in crate::api) fn into_bytes(self) -> Bytes {
        Bytes::from_owner(self)
    }
}

impl<T: AsRef<U>, U: ?Sized> AsRef<U> for Held<T> {
    fn as_ref(&self) -> &U {
        self.content.as_ref()
    }
}
