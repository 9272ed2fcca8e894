//! Keys that are removed during a stream or a wait.

use std::{fs, sync::Arc, time::Duration};

use lookdown::access::AccessKeys;
use tempfile::TempDir;
use tokio::time::Instant;

use crate::{
    access::{line, service_with},
    results_events::Stream,
    service::{Answer, Service},
};

const STREAMS: [&str; 2] = ["/results/lobby/events", "/events"];
const GOING: &str = "lookdown_going";
const STAYING: &str = "lookdown_staying";

/// A service with two keys.
struct Keyed {
    service: Service,
    keys: Arc<AccessKeys>,
    folder: TempDir,
}

impl Keyed {
    fn start() -> Self {
        let folder = tempfile::tempdir().unwrap();
        write(&folder, &line("going", "\"read\"", GOING));
        let file = folder.path().join("keys.toml");
        let keys = AccessKeys::open("".parse().unwrap(), Some(&file)).unwrap();
        let keys = Arc::new(keys);
        Self {
            service: service_with(&keys),
            keys,
            folder,
        }
    }

    /// Replaces the line of the removed key by this one.
    fn replace_key(&self, by: &str) {
        write(&self.folder, by);
        self.keys.refresh();
    }

    async fn listen(&self, path: &str, key: &str) -> Stream {
        Stream::open_with(&self.service, path, Some(("x-api-key", key))).await
    }

    /// Returns the response to a wait whose key is replaced before there is a report.
    async fn wait_while_replaced(&self, by: &str) -> Answer {
        let headers = [("x-api-key", GOING)];
        let path = "/results/lobby/latest?wait=10";
        let waiting = self.service.ask("GET", path, &headers);
        let (answer, ()) = tokio::join!(waiting, async {
            self.service.has_listeners(1).await;
            self.replace_key(by);
            self.service.publish("lobby", 1);
        });
        answer
    }
}

fn write(folder: &TempDir, going: &str) {
    let lines = [going, &line("staying", "\"read\"", STAYING)];
    fs::write(folder.path().join("keys.toml"), lines.concat()).unwrap();
}

#[tokio::test]
async fn a_stream_ends_with_its_key_before_the_next_report() {
    for path in STREAMS {
        let keyed = Keyed::start();
        keyed.service.publish("lobby", 1);
        let mut going = keyed.listen(path, GOING).await;
        let mut staying = keyed.listen(path, STAYING).await;
        assert_eq!(going.number().await, 1, "{path}");
        assert_eq!(staying.number().await, 1, "{path}");

        keyed.replace_key("");
        keyed.service.publish("lobby", 2);
        assert_eq!(going.next().await, None, "{path}");
        assert_eq!(staying.number().await, 2, "{path}");
        assert_eq!(keyed.service.metrics.results_listeners.get(), 1, "{path}");
    }
}

#[tokio::test(start_paused = true)]
async fn an_idle_stream_ends_within_2_s_of_its_key_or_scope() {
    for by in [&*line("going", "\"detect\"", GOING), ""] {
        let keyed = Keyed::start();
        let mut stream = keyed.listen(STREAMS[0], GOING).await;
        assert!(stream.next().await.is_some());
        keyed.replace_key(by);
        let began = Instant::now();
        assert_eq!(stream.next().await, None);
        // Much sooner than the next keep-alive comment.
        assert!(began.elapsed() < Duration::from_secs(2));
    }
}

#[tokio::test]
async fn a_wait_whose_key_is_removed_returns_no_report() {
    let detect = line("going", "\"detect\"", GOING);
    for (by, status, kind) in [("", 401, "key-required"), (&*detect, 403, "forbidden")] {
        let answer = Keyed::start().wait_while_replaced(by).await;
        assert_eq!(answer.status, status, "{}", answer.text());
        let kind = format!("/problems/{kind}");
        assert_eq!(answer.problem()["type"], kind);
    }
}
