//! Reading a body within bounds.

use std::{future::poll_fn, pin::Pin, sync::Arc};

use axum::{
    body::{Body, HttpBody},
    http::{
        HeaderMap,
        header::{CONTENT_LENGTH, EXPECT},
    },
};
use bytes::{Bytes, BytesMut};
use tokio::sync::{OwnedSemaphorePermit, Semaphore};

use crate::api::problem::{Problem, ProblemKind};

/// A client that is in the middle of sending sees a refusal only once it has sent everything. So
/// this many times the limit is read and thrown away before a body is refused.
const DISCARDED_LIMITS: usize = 4;

/// The memory that all bodies together may hold, counted in bytes. Clones share it.
#[derive(Clone)]
pub(in crate::api) struct UploadBudget(Arc<Semaphore>);

impl UploadBudget {
    pub(in crate::api) fn new(bytes: usize) -> Self {
        Self(Arc::new(Semaphore::new(bytes.min(Semaphore::MAX_PERMITS))))
    }

    fn take(&self, bytes: usize) -> Option<OwnedSemaphorePermit> {
        let bytes = u32::try_from(bytes).ok()?;
        Arc::clone(&self.0).try_acquire_many_owned(bytes).ok()
    }
}

/// Bytes together with their share of the budget.
pub(in crate::api) struct HeldBytes {
    bytes: Bytes,
    _share: OwnedSemaphorePermit,
}

impl HeldBytes {
    pub(super) fn bytes(&self) -> Bytes {
        self.bytes.clone()
    }

    /// Other bytes, copied from these, in their place.
    pub(super) fn with_bytes(self, bytes: Bytes) -> Self {
        Self { bytes, ..self }
    }

    /// Plain bytes that give their share back when the last clone of them is gone.
    pub(in crate::api) fn into_bytes(self) -> Bytes {
        Bytes::from_owner(self)
    }
}

impl AsRef<[u8]> for HeldBytes {
    fn as_ref(&self) -> &[u8] {
        &self.bytes
    }
}

/// What a body may cost.
pub(in crate::api) struct BodyReader<'a> {
    pub(in crate::api) max_bytes: usize,
    /// What to do about a body that has more.
    pub(in crate::api) remedy: &'static str,
    pub(in crate::api) budget: &'a UploadBudget,
}

impl BodyReader<'_> {
    /// Reads a whole body.
    pub(in crate::api) async fn read(
        &self,
        headers: &HeaderMap,
        mut body: Body,
    ) -> Result<HeldBytes, Problem> {
        if announced_bytes(headers).is_some_and(|bytes| bytes > self.max_bytes) {
            self.discard_unread(headers, body).await;
            return Err(self.too_large());
        }
        let mut bytes = BytesMut::new();
        let mut share = self.budget.take(0).ok_or_else(no_memory)?;
        while let Some(chunk) = next_chunk(&mut body).await? {
            if bytes.len() + chunk.len() > self.max_bytes {
                self.discard(body).await;
                return Err(self.too_large());
            }
            let Some(more) = self.budget.take(chunk.len()) else {
                drop((bytes, share));
                self.discard(body).await;
                return Err(no_memory());
            };
            share.merge(more);
            bytes.extend_from_slice(&chunk);
        }
        Ok(HeldBytes {
            bytes: bytes.freeze(),
            _share: share,
        })
    }

    /// Discards a body that is refused before any of it was read. A client that asked first has not
    /// begun to send, and need not.
    pub(in crate::api) async fn discard_unread(&self, headers: &HeaderMap, body: Body) {
        if !headers.contains_key(EXPECT) {
            self.discard(body).await;
        }
    }

    /// Reads what the client is sending, within bounds, so that it can see the answer.
    async fn discard(&self, mut body: Body) {
        let mut left = self.max_bytes.saturating_mul(DISCARDED_LIMITS);
        while let Ok(Some(chunk)) = next_chunk(&mut body).await
            && chunk.len() < left
        {
            left -= chunk.len();
        }
    }

    fn too_large(&self) -> Problem {
        let detail = format!(
            "the body is larger than {} bytes: {}",
            self.max_bytes, self.remedy
        );
        Problem::new(ProblemKind::BodyTooLarge, detail)
    }
}

fn announced_bytes(headers: &HeaderMap) -> Option<usize> {
    headers.get(CONTENT_LENGTH)?.to_str().ok()?.parse().ok()
}

async fn next_chunk(body: &mut Body) -> Result<Option<Bytes>, Problem> {
    loop {
        match poll_fn(|context| Pin::new(&mut *body).poll_frame(context)).await {
            None => return Ok(None),
            Some(Err(error)) => {
                let detail = format!("the body ended early ({error}): send it again");
                return Err(Problem::new(ProblemKind::MalformedRequest, detail));
            }
            // Trailers carry nothing of ours.
            Some(Ok(frame)) => {
                if let Ok(chunk) = frame.into_data() {
                    return Ok(Some(chunk));
                }
            }
        }
    }
}

fn no_memory() -> Problem {
    let detail = "too many request bodies are in memory already: send fewer at a time, or retry";
    Problem::new(ProblemKind::Overloaded, detail)
}
