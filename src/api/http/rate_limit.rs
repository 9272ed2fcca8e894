//! Rate limits: a token bucket for each API key, and for each address without a valid key.
//!
//! Responses report the state in the fields `RateLimit-Policy` and `RateLimit` of
//! draft-ietf-httpapi-ratelimit-headers-11 (23 May 2026).

mod buckets;

use std::{
    num::NonZeroU32,
    sync::Arc,
    time::{Duration, Instant},
};

use axum::{
    extract::{Request, State},
    http::{HeaderName, HeaderValue},
    middleware::Next,
    response::{IntoResponse, Response},
};
use lookdown_detect::fairness::Client;
use parking_lot::Mutex;

use self::buckets::{Buckets, Standing};
use super::{
    context::RequestContext,
    problem::{Problem, ProblemKind},
};

pub(in crate::api) const RATE_LIMIT: HeaderName = HeaderName::from_static("ratelimit");
pub(in crate::api) const RATE_LIMIT_POLICY: HeaderName =
    HeaderName::from_static("ratelimit-policy");

/// The rate limit of a client.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RequestRate {
    /// Sustained requests per second, more than 0.
    pub per_second: f64,
    /// Requests at once after a pause.
    pub burst: NonZeroU32,
}

impl RequestRate {
    /// Returns the time between two requests at the sustained rate.
    fn interval(&self) -> Duration {
        let seconds = Duration::try_from_secs_f64(self.per_second.recip());
        seconds
            .unwrap_or(Duration::MAX)
            .clamp(Duration::from_nanos(1), Duration::from_hours(1))
    }
}

/// The token buckets of all clients. Clones share them.
#[derive(Clone)]
pub(in crate::api) struct RateLimiter {
    buckets: Arc<Mutex<Buckets>>,
    policy: HeaderValue,
}

impl RateLimiter {
    /// Creates full buckets.
    pub(in crate::api) fn new(rate: RequestRate) -> Self {
        let (interval, burst) = (rate.interval(), rate.burst.get());
        let window = whole_seconds(interval * burst);
        // Digits are visible ASCII.
        let policy = format!("\"default\";q={burst};w={window}").parse();
        Self {
            buckets: Arc::new(Mutex::new(Buckets::new(interval, burst))),
            policy: policy.unwrap_or(HeaderValue::from_static("\"default\"")),
        }
    }

    /// Takes a token of a client.
    fn take(&self, client: Client) -> Standing {
        // The change under this lock cannot panic half-way.
        let mut buckets = self.buckets.lock();
        buckets.take(client, Instant::now())
    }
}

/// The tokens of the client of a request. Each further piece of work in it, as much as a request,
/// takes one.
#[derive(Clone)]
pub(in crate::api) struct RequestTokens {
    limiter: RateLimiter,
    client: Client,
    /// The state after the last token.
    standing: Arc<Mutex<Standing>>,
}

impl RequestTokens {
    /// Takes a further token.
    pub(in crate::api) fn take(&self) -> Result<(), Problem> {
        let standing = self.limiter.take(self.client.clone());
        *self.standing.lock() = standing;
        if standing.admitted {
            Ok(())
        } else {
            Err(too_fast(standing.next_in))
        }
    }
}

/// Refuses requests beyond the rate limit and adds its headers to every response.
pub(in crate::api) async fn apply(
    State(limiter): State<RateLimiter>,
    mut request: Request,
    next: Next,
) -> Response {
    let context = match RequestContext::from_extensions(request.extensions()) {
        Ok(context) => context,
        Err(problem) => return problem.into_response(),
    };
    let client = context.caller.rate_limited.clone();
    let standing = limiter.take(client.clone());
    let last = Arc::new(Mutex::new(standing));
    let mut response = if standing.admitted {
        request.extensions_mut().insert(RequestTokens {
            limiter: limiter.clone(),
            client,
            standing: Arc::clone(&last),
        });
        next.run(request).await
    } else {
        too_fast(standing.next_in).into_response()
    };
    let standing = *last.lock();
    let remaining = format!(
        "\"default\";r={};t={}",
        standing.remaining,
        whole_seconds(standing.next_in)
    );
    let headers = response.headers_mut();
    headers.insert(RATE_LIMIT_POLICY, limiter.policy.clone());
    if let Ok(remaining) = remaining.parse() {
        headers.insert(RATE_LIMIT, remaining);
    }
    response
}

fn too_fast(next_in: Duration) -> Problem {
    let seconds = whole_seconds(next_in);
    let detail = format!(
        "the client exceeds its rate limit: retry in {seconds} s (limits.\
         requests_per_second, limits.request_burst)"
    );
    Problem::new(ProblemKind::RateLimited, detail).with_retry_after(next_in)
}

/// Rounds up to at least one second: these fields hold whole seconds.
fn whole_seconds(time: Duration) -> u64 {
    let begun = u64::from(time.subsec_nanos() > 0);
    (time.as_secs() + begun).max(1)
}
