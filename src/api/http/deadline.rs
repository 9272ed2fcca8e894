//! The deadline of a request. All work for the request ends there.

use std::{future::Future, time::Duration};

use lookdown_detect::pipeline::PipelineError;
use tokio::{
    sync::Semaphore,
    task::spawn_blocking,
    time::{Instant, timeout_at},
};

use super::problem::{Problem, ProblemKind};

/// The setting of the limit.
const REQUEST_TIMEOUT: &str = "server.request_timeout_millis";

/// Most requests that use a store at a time. A request to a store that hangs keeps a thread, of
/// which the runtime has 512 for blocking work.
const MAX_WAITING: usize = 32;

/// A store of files that may hang, as on a network file system.
pub(in crate::api) struct SlowStore {
    free: Semaphore,
    /// The requests that use it, in the error sentence.
    requests: &'static str,
}

/// The stored calibrations, whose changes use their files.
pub(in crate::api) static CALIBRATIONS: SlowStore = SlowStore::new("changes of calibrations");
/// The folder of the cameras, which every request about cameras uses.
pub(in crate::api) static CAMERAS: SlowStore = SlowStore::new("requests about cameras");

impl SlowStore {
    const fn new(requests: &'static str) -> Self {
        Self {
            free: Semaphore::const_new(MAX_WAITING),
            requests,
        }
    }
}

/// The time at which a response must be complete.
#[derive(Debug, Clone, Copy)]
pub(in crate::api) struct Deadline {
    /// The time at which the request arrived.
    pub(in crate::api) began: Instant,
    limit: Duration,
    /// The setting or parameter that raises the limit.
    set_by: &'static str,
}

impl Deadline {
    /// Returns the deadline `limit` from now.
    pub(in crate::api) fn begin(limit: Duration) -> Self {
        Self {
            began: Instant::now(),
            limit,
            set_by: REQUEST_TIMEOUT,
        }
    }

    /// Returns this deadline, or that of the request's parameter if it is earlier.
    pub(in crate::api) fn within(self, own: Option<Duration>, parameter: &'static str) -> Self {
        match own {
            Some(limit) if limit < self.limit => Self {
                limit,
                set_by: parameter,
                ..self
            },
            _ => self,
        }
    }

    pub(in crate::api) fn at(self) -> Instant {
        self.began + self.limit
    }

    /// Returns the longest duration of the request in seconds.
    pub(in crate::api) fn limit_seconds(self) -> f64 {
        self.limit.as_secs_f64()
    }

    /// Waits for work that holds a permit of the frame queue. Work that has not begun at the
    /// deadline never begins. `undone` is the start of the error sentence, and `remedy` its advice.
    pub(in crate::api) async fn wait<T>(
        self,
        undone: &str,
        remedy: &str,
        work: impl Future<Output = Result<T, PipelineError>>,
    ) -> Result<T, Problem> {
        let done = timeout_at(self.at(), work).await;
        let done = done.map_err(|_| {
            let (seconds, set_by) = (self.limit_seconds(), self.set_by);
            let detail = format!("{undone} within {seconds} s: {remedy}, or raise {set_by}");
            Problem::new(ProblemKind::Timeout, detail)
        })?;
        Ok(done?)
    }

    /// Runs blocking work on the files of a store, unless many requests wait for it already.
    pub(in crate::api) async fn using<T, E>(
        self,
        store: &'static SlowStore,
        work: impl FnOnce() -> Result<T, E> + Send + 'static,
    ) -> Result<T, Problem>
    where
        T: Send + 'static,
        E: Into<Problem> + Send + 'static,
    {
        let permit = store.free.try_acquire().map_err(|_| {
            let requests = store.requests;
            let detail =
                format!("{MAX_WAITING} {requests} wait for their files: retry when they respond");
            Problem::new(ProblemKind::Overloaded, detail)
        })?;
        self.blocking(move || {
            let _permit = permit;
            work()
        })
        .await
    }

    /// Runs blocking work on a thread outside the async runtime, in the span of the request. Work
    /// that has begun is never interrupted: it continues after the request has timed out.
    pub(in crate::api) async fn blocking<T, E>(
        self,
        work: impl FnOnce() -> Result<T, E> + Send + 'static,
    ) -> Result<T, Problem>
    where
        T: Send + 'static,
        E: Into<Problem> + Send + 'static,
    {
        let request = tracing::Span::current();
        let work = move || request.in_scope(work);
        let done = timeout_at(self.at(), spawn_blocking(work)).await;
        let done = done.map_err(|_| {
            let detail = format!(
                "this is not done within {} s, and goes on: look later whether it has succeeded, \
                 or raise {}",
                self.limit_seconds(),
                self.set_by
            );
            Problem::new(ProblemKind::Timeout, detail)
        })?;
        done.map_err(Problem::internal)?.map_err(Into::into)
    }
}

#[cfg(test)]
mod tests {
    use std::sync::{Arc, mpsc::sync_channel};

    use parking_lot::Mutex;
    use tokio::{spawn, time::timeout};

    use super::*;

    static HANGING: SlowStore = SlowStore::new("changes");

    #[tokio::test]
    async fn requests_to_a_store_that_hangs_are_refused_beyond_a_limit() {
        let (release, hang) = sync_channel::<()>(0);
        let hang = Arc::new(Mutex::new(hang));
        let deadline = || Deadline::begin(Duration::from_mins(1));
        let waiting: Vec<_> = (0..MAX_WAITING)
            .map(|_| {
                let hang = Arc::clone(&hang);
                spawn(deadline().using(&HANGING, move || {
                    let _ = hang.lock().recv();
                    Ok::<_, Problem>(())
                }))
            })
            .collect();
        let all_wait = async {
            while HANGING.free.available_permits() > 0 {
                tokio::task::yield_now().await;
            }
        };
        timeout(Duration::from_secs(20), all_wait).await.unwrap();
        let refused = deadline().using(&HANGING, || Ok::<_, Problem>(())).await;
        let refused = refused.unwrap_err();
        assert_eq!(refused.kind, ProblemKind::Overloaded);
        for store in [&CALIBRATIONS, &CAMERAS] {
            let other = deadline().using(store, || Ok::<_, Problem>(1)).await;
            assert_eq!(other.ok(), Some(1));
        }
        drop(release);
        for change in waiting {
            assert!(change.await.unwrap().is_ok());
        }
    }
}
