//! The parts that all routes share: the state, queries of the store, known owners.

use std::sync::Arc;

use axum::extract::rejection::QueryRejection;
use jiff::Timestamp;
use lookdown_common::text::{one_line, with_causes};
use lookdown_http::problem::{Kind, Problem};
use parking_lot::Mutex;
use tokio::sync::Semaphore;

use crate::{
    counter::Counter,
    store::{Store, StoreError},
    sums::Owner,
};

/// Most requests that read or draw at a time: a response is several times larger while it is made.
const MAX_CONCURRENT: usize = 4;

static PERMITS: Semaphore = Semaphore::const_new(MAX_CONCURRENT);

/// Everything that requests read.
pub(crate) struct Api {
    pub(crate) counter: Arc<Mutex<Counter>>,
    pub(crate) store: Store,
}

pub(super) type Shared = Arc<Api>;

pub(super) fn now_ms() -> i64 {
    Timestamp::now().as_millisecond()
}

/// Runs a query of the store without blocking the runtime.
pub(super) async fn query<T: Send + 'static>(
    api: &Shared,
    query: impl FnOnce(&Store) -> Result<T, StoreError> + Send + 'static,
) -> Result<T, Problem> {
    let store = api.store.clone();
    blocking(move || stored(query(&store))).await
}

/// Returns what the store returned. Only the log has the reason of a failure.
pub(super) fn stored<T>(result: Result<T, StoreError>) -> Result<T, Problem> {
    result.map_err(|problem| {
        tracing::error!("{problem}");
        Problem::internal()
    })
}

/// Runs work that takes time and memory without blocking the runtime, a few requests at a time.
pub(super) async fn blocking<T: Send + 'static>(
    work: impl FnOnce() -> Result<T, Problem> + Send + 'static,
) -> Result<T, Problem> {
    // The permits are never closed.
    let _permit = PERMITS.acquire().await;
    let done = tokio::task::spawn_blocking(work).await;
    // A task that panicked is logged by the panic hook.
    done.unwrap_or_else(|_| Err(Problem::internal()))
}

pub(super) fn not_found(detail: impl Into<String>) -> Problem {
    Problem::new(Kind::NotFound, detail)
}

/// Refuses an owner that has neither a scene nor sums.
pub(super) async fn check_known(api: &Shared, owner: &Owner) -> Result<(), Problem> {
    let is_followed = match owner {
        Owner::Camera(camera) => api.counter.lock().scene_of(camera).is_some(),
        Owner::Site(site) => api.counter.lock().site(site).is_some(),
    };
    if is_followed {
        return Ok(());
    }
    let asked = owner.clone();
    if query(api, move |store| store.has(&asked)).await? {
        return Ok(());
    }
    Err(match owner {
        Owner::Camera(camera) => not_found(format!(
            "there is no camera {}: GET /counts lists them",
            one_line(camera)
        )),
        Owner::Site(site) => not_found(format!(
            "there is no site {}: give a mount.site of a calibration in use",
            one_line(site)
        )),
    })
}

/// Returns the problem of a query with an unknown or repeated parameter.
pub(super) fn unusable_query(refused: &QueryRejection) -> Problem {
    let cause = with_causes(refused);
    let cause = cause.rsplit(": ").next().unwrap_or_default();
    let fault = format!(
        "{}: give each parameter of docs/count.md once",
        one_line(cause)
    );
    Problem::for_parameter("query", &fault)
}

/// Returns a place in meters or pixels with three decimals.
pub(super) fn rounded(place: [f64; 2]) -> [f64; 2] {
    place.map(|value| (value * 1000.0).round() / 1000.0)
}

#[cfg(test)]
mod tests {
    use std::{sync::mpsc::sync_channel, time::Duration};

    use tokio::spawn;

    use super::*;

    #[tokio::test]
    async fn reading_and_drawing_leave_the_runtime_free() {
        let (release, released) = sync_channel::<()>(1);
        let work = spawn(blocking(move || {
            let waited = released.recv_timeout(Duration::from_secs(20));
            Ok(waited.is_ok())
        }));
        // Runs on the only thread of the runtime while the work waits.
        let other = spawn(async move { release.send(()).is_ok() });
        assert!(work.await.unwrap().ok().unwrap() && other.await.unwrap());
    }

    #[tokio::test]
    async fn a_few_requests_read_or_draw_at_a_time() {
        let (release, released) = sync_channel::<()>(0);
        let released = Arc::new(Mutex::new(released));
        let (begun, beginnings) = sync_channel(100);
        let works: Vec<_> = (0..3 * MAX_CONCURRENT)
            .map(|_| {
                let (begun, released) = (begun.clone(), Arc::clone(&released));
                spawn(blocking(move || {
                    let _ = begun.send(());
                    let _ = released.lock().recv();
                    Ok(())
                }))
            })
            .collect();
        for _ in 0..MAX_CONCURRENT {
            tokio::task::yield_now().await;
        }
        let begins = || beginnings.recv_timeout(Duration::from_millis(500)).is_ok();
        let at_once = (0..3 * MAX_CONCURRENT).take_while(|_| begins()).count();
        assert_eq!(at_once, MAX_CONCURRENT);
        drop(release);
        for work in works {
            assert!(work.await.unwrap().is_ok());
        }
    }
}
