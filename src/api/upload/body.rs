//! Reading a body within bounds.

use std::{future::poll_fn, num::NonZeroU64, pin::Pin, sync::Arc};

use axum::{
    body::{Body, HttpBody},
    http::{HeaderMap, header::CONTENT_LENGTH},
};
use bytes::{Bytes, BytesMut};
use tokio::{
    sync::{OwnedSemaphorePermit, Semaphore},
    time::timeout_at,
};

use super::Pace;
use crate::api::{
    deadline::Deadline,
    problem::{Problem, ProblemKind},
};

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
    /// `None`: any rate will do.
    pub(in crate::api) least_bytes_per_second: Option<NonZeroU64>,
    pub(in crate::api) deadline: Deadline,
}

impl BodyReader<'_> {
    /// Reads a whole body.
    pub(in crate::api) async fn read(
        &self,
        headers: &HeaderMap,
        mut body: Body,
    ) -> Result<HeldBytes, Problem> {
        if announced_bytes(headers).is_some_and(|bytes| bytes > self.max_bytes) {
            return Err(self.too_large());
        }
        let mut bytes = BytesMut::new();
        let mut share = self.budget.take(0).ok_or_else(no_memory)?;
        let mut pace = Pace::begin(self.least_bytes_per_second);
        while let Some(chunk) = self.next_in_time(&mut body, &pace).await? {
            if bytes.len() + chunk.len() > self.max_bytes {
                return Err(self.too_large());
            }
            let more = self.budget.take(chunk.len()).ok_or_else(no_memory)?;
            share.merge(more);
            bytes.extend_from_slice(&chunk);
            pace.came(chunk.len());
        }
        Ok(HeldBytes {
            bytes: bytes.freeze(),
            _share: share,
        })
    }

    async fn next_in_time(&self, body: &mut Body, pace: &Pace) -> Result<Option<Bytes>, Problem> {
        let deadline = self.deadline.at();
        let late_at = pace.late_at(deadline);
        match timeout_at(late_at, next_chunk(body)).await {
            Ok(chunk) => chunk,
            Err(_) if late_at < deadline => {
                let least = self.least_bytes_per_second.map_or(0, NonZeroU64::get);
                let detail = format!(
                    "the body comes more slowly than {least} bytes a second: send it over a \
                     faster line, or lower limits.min_upload_bytes_per_second"
                );
                Err(Problem::new(ProblemKind::SlowUpload, detail))
            }
            Err(_) => {
                let seconds = self.deadline.limit_seconds();
                let detail =
                    format!("the body did not arrive within {seconds} s: send a smaller one");
                Err(Problem::new(ProblemKind::SlowUpload, detail))
            }
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

/// The next bytes of a body; `None` at its end.
pub(in crate::api) async fn next_chunk(body: &mut Body) -> Result<Option<Bytes>, Problem> {
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
