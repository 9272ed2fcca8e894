//! Reads a request body within limits: its size, its rate, the deadline of the request, and the
//! memory of all requests together.

mod budget;
mod minimum_upload_rate;

use std::{future::poll_fn, num::NonZeroU64, pin::Pin};

use axum::{
    body::{Body, HttpBody},
    http::{HeaderMap, header::CONTENT_LENGTH},
};
use bytes::{Bytes, BytesMut};
use tokio::time::timeout_at;

use super::{
    deadline::Deadline,
    problem::{Problem, ProblemKind},
};

pub(in crate::api) use self::{
    budget::{Held, UploadBudget},
    minimum_upload_rate::MinimumUploadRate,
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
