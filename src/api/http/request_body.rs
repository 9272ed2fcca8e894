//! Reads a request body within limits: its size, its rate, the deadline of the request, and the
//! memory of all requests together.
//!
//! The minimum upload rate, the protection against slow-body (slow-loris) clients: a period of a
//! few seconds must not bring fewer bytes than the rate requires.

use std::{future::poll_fn, num::NonZeroU64, pin::Pin, sync::Arc, time::Duration};

use axum::{
    body::{Body, HttpBody},
    http::{HeaderMap, header::CONTENT_LENGTH},
};
use bytes::{Bytes, BytesMut};
use lookdown_detect::fairness::{BudgetError, BudgetShare, Client, SharedBudget};
use tokio::time::{Instant, timeout_at};

use super::{
    deadline::Deadline,
    problem::{Problem, ProblemKind},
};

/// The limits of a body.
pub(in crate::api) struct BodyReader {
    pub(in crate::api) max_bytes: usize,
    /// The advice for a larger body.
    pub(in crate::api) remedy: &'static str,
    pub(in crate::api) budget: UploadBudget,
    /// Least rate; `None` for no limit.
    pub(in crate::api) least_bytes_per_second: Option<NonZeroU64>,
    pub(in crate::api) deadline: Deadline,
}

impl BodyReader {
    /// Reads a whole body.
    pub(in crate::api) async fn read(
        &self,
        headers: &HeaderMap,
        mut body: Body,
    ) -> Result<Held<Bytes>, Problem> {
        if announced_bytes(headers).is_some_and(|bytes| bytes > self.max_bytes) {
            return Err(self.too_large());
        }
        let mut bytes = BytesMut::new();
        let mut share = self.budget.take(0)?;
        let mut upload_rate = MinimumUploadRate::begin(self.least_bytes_per_second);
        while let Some(chunk) = self.next_in_time(&mut body, &upload_rate).await? {
            if bytes.len() + chunk.len() > self.max_bytes {
                return Err(self.too_large());
            }
            share.merge(self.budget.take(chunk.len())?);
            // A frame of this process comes as a whole, and is not copied.
            if bytes.is_empty() && body.is_end_stream() {
                return Ok(Held::new(chunk, share));
            }
            bytes.extend_from_slice(&chunk);
            upload_rate.came(chunk.len());
        }
        Ok(Held::new(bytes.freeze(), share))
    }

    async fn next_in_time(
        &self,
        body: &mut Body,
        upload_rate: &MinimumUploadRate,
    ) -> Result<Option<Bytes>, Problem> {
        let deadline = self.deadline.at();
        let late_at = upload_rate.late_at(deadline);
        match timeout_at(late_at, next_chunk(body)).await {
            Ok(chunk) => chunk,
            Err(_) if late_at < deadline => {
                let least = self.least_bytes_per_second.map_or(0, NonZeroU64::get);
                let detail = format!(
                    "the body arrives at less than {least} bytes per second: send it over a \
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

/// Returns the next bytes of a body; `None` at its end.
pub(in crate::api) async fn next_chunk(body: &mut Body) -> Result<Option<Bytes>, Problem> {
    loop {
        match poll_fn(|context| Pin::new(&mut *body).poll_frame(context)).await {
            None => return Ok(None),
            Some(Err(error)) => {
                let detail = format!("the body ended early ({error}): send it again");
                return Err(Problem::new(ProblemKind::MalformedRequest, detail));
            }
            // Trailers are ignored.
            Some(Ok(frame)) => {
                if let Ok(chunk) = frame.into_data() {
                    return Ok(Some(chunk));
                }
            }
        }
    }
}

/// The memory of all bodies and of the tensors unpacked from them, in bytes. Clones share it.
#[derive(Clone)]
pub(in crate::api) struct UploadBudget {
    bytes: SharedBudget,
    /// The client that uses it.
    client: Client,
    /// The advice for a client whose body finds no free memory.
    remedy: &'static str,
}

impl UploadBudget {
    /// Creates a budget. One client may use at most half of it, but at least `least_share`.
    pub(in crate::api) fn new(bytes: usize, least_share: usize, remedy: &'static str) -> Self {
        Self {
            bytes: SharedBudget::with_least_share(bytes, least_share),
            client: Client::Others,
            remedy,
        }
    }

    /// Returns the same budget as a client may use it.
    pub(in crate::api) fn for_client(&self, client: &Client) -> Self {
        Self {
            client: client.clone(),
            ..self.clone()
        }
    }

    /// Reserves a number of bytes until the permit is dropped. Fails when fewer are free.
    pub(in crate::api) fn take(&self, bytes: usize) -> Result<BudgetShare, Problem> {
        let share = self.bytes.take(&self.client, bytes);
        share.map_err(|error| self.exhausted(error))
    }

    fn exhausted(&self, error: BudgetError) -> Problem {
        let (client, remedy) = (&self.client, self.remedy);
        let detail = match error {
            BudgetError::Full => {
                format!("too many request bodies are in memory already: {remedy}")
            }
            BudgetError::ShareUsed { share } => format!(
                "{client} uses its share of the memory for request bodies already ({share} \
                 bytes): {remedy}"
            ),
        };
        Problem::new(ProblemKind::Overloaded, detail)
    }
}

/// A value in memory together with its permit.
pub(in crate::api) struct Held<T> {
    content: T,
    _share: BudgetShare,
}

impl<T> Held<T> {
    pub(in crate::api) fn new(content: T, share: BudgetShare) -> Self {
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

impl Held<Vec<Bytes>> {
    /// Returns plain bytes that release the permit when the last clone of the last element is
    /// dropped.
    pub(in crate::api) fn into_elements(self) -> Vec<Bytes> {
        let all = Arc::new(self);
        let elements = (0..all.content.len()).map(|index| {
            Bytes::from_owner(HeldElement {
                all: Arc::clone(&all),
                index,
            })
        });
        elements.collect()
    }
}

/// An element in memory together with the permit of all elements.
struct HeldElement {
    all: Arc<Held<Vec<Bytes>>>,
    index: usize,
}

impl AsRef<[u8]> for HeldElement {
    fn as_ref(&self) -> &[u8] {
        &self.all.content[self.index]
    }
}

impl<T: AsRef<U>, U: ?Sized> AsRef<U> for Held<T> {
    fn as_ref(&self) -> &U {
        self.content.as_ref()
    }
}

/// Longest time without any bytes.
const MAX_SILENCE: Duration = Duration::from_secs(5);

/// The time to wait for the next bytes. Each byte extends it, up to [`MAX_SILENCE`].
pub(in crate::api) struct MinimumUploadRate {
    /// Least rate; `None` for no limit.
    least_bytes_per_second: Option<NonZeroU64>,
    late_at: Instant,
}

impl MinimumUploadRate {
    pub(in crate::api) fn begin(least_bytes_per_second: Option<NonZeroU64>) -> Self {
        Self {
            least_bytes_per_second,
            late_at: Instant::now() + MAX_SILENCE,
        }
    }

    /// Returns the end of the wait: the time at which the client is too slow, or `deadline`.
    pub(in crate::api) fn late_at(&self, deadline: Instant) -> Instant {
        match self.least_bytes_per_second {
            Some(_) => self.late_at.min(deadline),
            None => deadline,
        }
    }

    /// Records received bytes.
    pub(in crate::api) fn came(&mut self, bytes: usize) {
        let Some(least) = self.least_bytes_per_second else {
            return;
        };
        let extension = (bytes as f64 / least.get() as f64).min(MAX_SILENCE.as_secs_f64());
        let longest = Instant::now() + MAX_SILENCE;
        self.late_at = (self.late_at + Duration::from_secs_f64(extension)).min(longest);
    }
}
