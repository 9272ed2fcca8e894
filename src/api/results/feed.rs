//! What a listener is sent: what it has missed, then what comes, and a sign of life in between.

use std::{collections::VecDeque, num::NonZeroUsize, sync::Arc, time::Duration};

use bytes::{BufMut, Bytes, BytesMut};
use tokio::time::{sleep, timeout};

use crate::{
    api::problem::Problem,
    results::{Cameras, Listening, ReportId, ResultStore, StoredReport},
};

/// After so long without a report a comment is sent: proxies close connections that are silent, and
/// who has gone without a word is found out.
const KEEP_ALIVE: Duration = Duration::from_secs(15);
const SIGN_OF_LIFE: Bytes = Bytes::from_static(b": nothing new\n\n");
/// Until a place of reports that does not answer is asked again.
const PAUSE: Duration = Duration::from_secs(1);
/// Missed reports that are fetched at a time.
const PAGE: usize = 32;

/// A listener's view of the reports.
pub(super) struct Feed {
    results: Arc<dyn ResultStore>,
    cameras: Cameras,
    listening: Listening,
    /// The last report that was sent.
    last: ReportId,
    /// Reports from before the listener came, to be sent first.
    missed: VecDeque<Arc<StoredReport>>,
    /// Whether there may be more of those.
    behind: bool,
}

impl Feed {
    /// Goes on after the report that was heard last, or begins with the latest of each camera.
    ///
    /// # Errors
    /// [`Problem`] when there is no place to listen, or nobody who knows the reports.
    pub(super) async fn begin(
        results: Arc<dyn ResultStore>,
        cameras: Cameras,
        last_heard: Option<ReportId>,
    ) -> Result<Self, Problem> {
        // Listens before it looks: nothing is missed in between.
        let listening = results.listeners().listen(cameras.clone())?;
        let latest = match &cameras {
            Cameras::All => results.latest_of_all().await?,
            Cameras::One(camera) => results.latest(camera).await?.into_iter().collect(),
        };
        let newest = latest.last().map(|report| report.id).unwrap_or_default();
        // What is ahead of all reports is an ID from elsewhere: nothing here comes after it.
        let last_heard = last_heard.filter(|id| *id <= newest);
        Ok(Self {
            results,
            cameras,
            listening,
            last: last_heard.unwrap_or(newest),
            behind: last_heard.is_some(),
            missed: match last_heard {
                None => latest.into(),
                Some(_) => VecDeque::new(),
            },
        })
    }

    /// The next event or comment; `None` when there will be none.
    pub(super) async fn next(&mut self) -> Option<Bytes> {
        loop {
            if let Some(missed) = self.missed.pop_front() {
                return Some(self.event(&missed));
            }
            if self.behind {
                let page = NonZeroUsize::new(PAGE).unwrap_or(NonZeroUsize::MIN);
                let missed = self.results.since(&self.cameras, self.last, page).await;
                let Ok(missed) = missed else {
                    sleep(PAUSE).await;
                    return Some(SIGN_OF_LIFE);
                };
                self.behind = !missed.is_empty();
                self.missed = missed.into();
                continue;
            }
            match timeout(KEEP_ALIVE, self.listening.next()).await {
                Err(_) => return Some(SIGN_OF_LIFE),
                Ok(None) => return None,
                Ok(Some(report)) if report.id > self.last => return Some(self.event(&report)),
                // It was sent with what was missed.
                Ok(Some(_)) => {}
            }
        }
    }

    fn event(&mut self, stored: &StoredReport) -> Bytes {
        self.last = stored.id;
        let mut text = BytesMut::with_capacity(stored.report.json.len() + 64);
        text.put_slice(format!("id: {}\ndata: ", stored.id).as_bytes());
        text.put_slice(&stored.report.json);
        text.put_slice(b"\n\n");
        text.freeze()
    }
}
