//! An HTTP client for buckets that bounds the size of every response. The provider's client reads
//! listings and error messages of any size into memory, and reserves the declared length at once.
//! Names that it refuses are removed from listings.

use std::{
    borrow::Cow,
    pin::Pin,
    sync::atomic::{AtomicUsize, Ordering},
    task::{Context, Poll, ready},
};

use async_trait::async_trait;
use bytes::Bytes;
use http_body::{Body, Frame, SizeHint};
use lookdown_common::text::causes;
use object_store::{
    ClientOptions, Error, Result,
    client::{
        HttpClient, HttpConnector, HttpError, HttpErrorKind, HttpRequest, HttpResponse,
        HttpResponseBody, HttpService, ReqwestConnector,
    },
};

use super::listing::{Usable, usable};

/// Most bytes of a response: more than the largest page of a listing, 5000 objects with names of
/// 1024 bytes.
const MAX_RESPONSE_BYTES: u64 = 16 << 20;

/// Query parameters of requests for a listing: of S3 and Google Cloud Storage, and of Azure.
const LISTINGS: [&str; 2] = ["list-type=2", "comp=list"];

/// Creates clients with bounded responses.
#[derive(Debug, Default)]
pub(super) struct BoundedConnector(ReqwestConnector);

impl HttpConnector for BoundedConnector {
    fn connect(&self, options: &ClientOptions) -> Result<HttpClient> {
        let client = self.0.connect(options)?;
        Ok(HttpClient::new(BoundedClient {
            client,
            most_refused: AtomicUsize::new(0),
        }))
    }
}

#[derive(Debug)]
struct BoundedClient {
    client: HttpClient,
    /// The most entries of a page that were refused, so that a warning is not repeated.
    most_refused: AtomicUsize,
}

impl BoundedClient {
    fn without_refused_names(&self, page: Bytes) -> Bytes {
        let Ok(text) = str::from_utf8(&page) else {
            return page;
        };
        let Usable { listing, refused } = usable(text);
        if refused > self.most_refused.fetch_max(refused, Ordering::Relaxed) {
            tracing::warn!(
                "{refused} objects of the bucket of the calibrations are skipped: their names have \
                 empty or relative parts, such as a//b or ../a, or control characters: remove them"
            );
        }
        match listing {
            Cow::Borrowed(_) => page,
            Cow::Owned(listing) => listing.into(),
        }
    }
}

/// Returns true for the request of a page of a listing.
fn is_listing(request: &HttpRequest) -> bool {
    let query = request.uri().query().unwrap_or_default();
    query
        .split('&')
        .any(|parameter| LISTINGS.contains(&parameter))
}

#[async_trait]
impl HttpService for BoundedClient {
    async fn call(&self, request: HttpRequest) -> Result<HttpResponse, HttpError> {
        let is_listing = is_listing(&request);
        let response = self.client.execute(request).await?;
        if response.body().size_hint().lower() > MAX_RESPONSE_BYTES {
            return Err(too_large());
        }
        let response = response.map(|body| {
            HttpResponseBody::new(BoundedBody {
                body,
                left: MAX_RESPONSE_BYTES,
            })
        });
        if !is_listing || !response.status().is_success() {
            return Ok(response);
        }
        let (head, body) = response.into_parts();
        let body = self.without_refused_names(body.bytes().await?);
        Ok(HttpResponse::from_parts(head, body.into()))
    }
}

/// A body that fails when it is longer than the limit.
struct BoundedBody {
    body: HttpResponseBody,
    left: u64,
}

impl Body for BoundedBody {
    type Data = Bytes;
    type Error = HttpError;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, HttpError>>> {
        let frame = ready!(Pin::new(&mut self.body).poll_frame(context));
        if let Some(Ok(frame)) = &frame {
            let length = frame.data_ref().map_or(0, Bytes::len) as u64;
            let Some(left) = self.left.checked_sub(length) else {
                return Poll::Ready(Some(Err(too_large())));
            };
            self.left = left;
        }
        Poll::Ready(frame)
    }

    fn is_end_stream(&self) -> bool {
        self.body.is_end_stream()
    }

    fn size_hint(&self) -> SizeHint {
        self.body.size_hint()
    }
}

/// A response beyond the limit.
#[derive(Debug, thiserror::Error)]
#[error("it sent a response of more than {MAX_RESPONSE_BYTES} bytes")]
struct TooLarge;

fn too_large() -> HttpError {
    HttpError::new(HttpErrorKind::Decode, TooLarge)
}

/// Returns true if a request failed because its response exceeds the limit.
pub(super) fn is_too_large(error: &Error) -> bool {
    causes(error).any(<dyn std::error::Error>::is::<TooLarge>)
}
