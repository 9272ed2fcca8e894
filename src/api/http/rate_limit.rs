//! Rate limits: a token bucket for each API key, and for each address without a valid key.
//!
//! Responses report the state in the fields `RateLimit-Policy` and `RateLimit` of
//! draft-ietf-httpapi-ratelimit-headers-11 (23 May 2026).
//!
//! Token buckets. Each bucket stores only the time at which it is full again: the virtual
//! scheduling form of the generic cell rate algorithm, ITU-T I.371.

use std::{
    collections::HashMap,
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
) -> Result<Response, Problem> {
    let context = RequestContext::from_extensions(request.extensions())?;
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
    Ok(response)
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

/// Largest number of buckets. Further addresses share one bucket.
const MAX_BUCKETS: usize = 10_000;
/// Shortest interval between two removals of full buckets at that number.
const PURGE_EVERY: Duration = Duration::from_secs(1);

/// The state of a client's rate limit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Standing {
    /// `true` if the request is admitted.
    admitted: bool,
    /// Number of further requests that would be admitted now.
    remaining: u32,
    /// Time until one more request is admitted.
    next_in: Duration,
}

/// A bucket for each client.
struct Buckets {
    /// Time in which one token is added.
    interval: Duration,
    /// Tokens of a full bucket.
    burst: u32,
    /// Buckets that may not be full.
    full_at: HashMap<Client, Instant>,
    purged_at: Option<Instant>,
}

impl Buckets {
    /// Creates full buckets of `burst` tokens. Each `interval` adds one token.
    fn new(interval: Duration, burst: u32) -> Self {
        Self {
            interval,
            burst,
            full_at: HashMap::new(),
            purged_at: None,
        }
    }

    /// Takes a token, if there is one.
    fn take(&mut self, client: Client, now: Instant) -> Standing {
        let client = self.placed(client, now);
        let full_at = self.full_at.entry(client).or_insert(now);
        let missing = full_at.saturating_duration_since(now);
        let admitted = missing + self.interval <= self.interval * self.burst;
        let missing = if admitted {
            missing + self.interval
        } else {
            missing
        };
        *full_at = now + missing;
        let tokens = missing.as_nanos().div_ceil(self.interval.as_nanos());
        let tokens = u32::try_from(tokens).unwrap_or(u32::MAX).max(1);
        Standing {
            admitted,
            remaining: self.burst.saturating_sub(tokens),
            next_in: missing.saturating_sub(self.interval * (tokens - 1)),
        }
    }

    /// Returns the client whose bucket is used. The number of keys is small, but a client may have
    /// any number of addresses.
    fn placed(&mut self, client: Client, now: Instant) -> Client {
        let is_new_address =
            matches!(client, Client::Address(_)) && !self.full_at.contains_key(&client);
        if !is_new_address || self.full_at.len() < MAX_BUCKETS {
            return client;
        }
        let is_due = |at: Instant| now.saturating_duration_since(at) >= PURGE_EVERY;
        if self.purged_at.is_none_or(is_due) {
            self.purged_at = Some(now);
            // A full bucket needs no entry.
            self.full_at.retain(|_, full_at| *full_at > now);
        }
        if self.full_at.len() < MAX_BUCKETS {
            client
        } else {
            Client::Others
        }
    }
}

#[cfg(test)]
mod tests {
    use std::net::IpAddr;

    use proptest::prelude::*;

    use super::*;

    fn key(name: &str) -> Client {
        Client::with_key(name)
    }

    fn address(number: u32) -> Client {
        Client::at(IpAddr::from(number.to_be_bytes()))
    }

    #[test]
    fn a_burst_is_admitted_and_then_one_request_per_interval() {
        let second = Duration::from_secs(1);
        let mut buckets = Buckets::new(second, 3);
        let start = Instant::now();
        let standings = [0, 0, 0, 0].map(|_| buckets.take(key("gate"), start));
        assert_eq!(
            standings.map(|standing| standing.admitted),
            [true, true, true, false]
        );
        assert_eq!(standings.map(|standing| standing.remaining), [2, 1, 0, 0]);
        assert_eq!(standings.map(|standing| standing.next_in), [second; 4]);

        let almost = buckets.take(key("gate"), start + second * 9 / 10);
        assert!(!almost.admitted);
        assert_eq!(almost.next_in, second / 10);
        assert!(buckets.take(key("gate"), start + second).admitted);
        assert!(!buckets.take(key("gate"), start + second).admitted);
        // A long pause fills the bucket, but not beyond its size.
        let rested = buckets.take(key("gate"), start + second * 100);
        assert_eq!((rested.admitted, rested.remaining), (true, 2));
    }

    #[test]
    fn clients_have_buckets_of_their_own() {
        let mut buckets = Buckets::new(Duration::from_secs(1), 1);
        let now = Instant::now();
        for client in [key("gate"), key("office"), address(1), address(2)] {
            assert!(buckets.take(client.clone(), now).admitted, "{client:?}");
            assert!(!buckets.take(client.clone(), now).admitted, "{client:?}");
        }
    }

    #[test]
    fn many_addresses_use_bounded_memory_and_keys_keep_buckets() {
        let second = Duration::from_secs(1);
        let mut buckets = Buckets::new(second, 1);
        let start = Instant::now();
        let admitted = |buckets: &mut Buckets, numbers: std::ops::Range<u32>, now| {
            let taken = numbers.map(|number| buckets.take(address(number), now));
            taken.filter(|standing| standing.admitted).count()
        };
        // All later addresses share one token.
        let flood = admitted(&mut buckets, 0..50_000, start);
        assert_eq!(flood, MAX_BUCKETS + 1);
        assert!(buckets.full_at.len() <= MAX_BUCKETS + 1);
        assert!(buckets.take(key("gate"), start).admitted);
        // Full buckets are removed, which makes room for others.
        let later = admitted(&mut buckets, 60_000..60_100, start + second);
        assert_eq!(later, 100);
        assert!(buckets.full_at.len() <= 101);
    }

    proptest! {
        #[test]
        fn no_period_admits_more_than_the_burst_and_the_rate(
            pauses in prop::collection::vec(0_u64..3_000, 1..200),
            interval_millis in 1_u64..2_000,
            burst in 1_u32..20,
        ) {
            let interval = Duration::from_millis(interval_millis);
            let mut buckets = Buckets::new(interval, burst);
            let mut now = Instant::now();
            let mut admitted = Vec::new();
            for pause in pauses {
                now += Duration::from_millis(pause);
                let standing = buckets.take(Client::Others, now);
                prop_assert!(standing.remaining < burst);
                prop_assert!(standing.next_in <= interval && !standing.next_in.is_zero());
                if standing.admitted {
                    admitted.push(now);
                }
            }
            for (first, from) in admitted.iter().enumerate() {
                for (last, to) in admitted.iter().enumerate().skip(first) {
                    let refilled = (*to - *from).as_millis() / u128::from(interval_millis);
                    prop_assert!((last - first + 1) as u128 <= u128::from(burst) + refilled);
                }
            }
        }
    }
}
