//! Waiting for a report that is newer than the known one. In most tests the clock is paused and
//! advances only while all tasks wait.

use std::{num::NonZeroUsize, time::Duration};

use lookdown::results::{ResultLimits, ResultStore};
use tokio::{
    task::yield_now,
    time::{Instant, sleep},
};

use crate::{
    results::report,
    service::{Bounds, Service},
};

const WAIT: &str = "/results/lobby/latest?wait=10";

impl Service {
    /// Waits until there are this many subscribers.
    pub(crate) async fn has_listeners(&self, count: i64) {
        while self.metrics.results_listeners.get() != count {
            yield_now().await;
        }
    }
}

#[tokio::test]
async fn a_wait_ends_with_a_newer_report() {
    let service = Service::start();
    let tag = format!("\"{}\"", service.publish("lobby", 1));
    let (answer, id) = tokio::join!(service.get_if_none_match(WAIT, &tag), async {
        service.has_listeners(1).await;
        service.publish("hall", 2);
        service.publish("lobby", 3)
    });
    assert_eq!(
        (answer.status.as_u16(), answer.text()),
        (200, "3".to_owned())
    );
    assert_eq!(answer.header("etag"), format!("\"{id}\""));
    service.has_listeners(0).await;
}

#[tokio::test]
async fn a_late_notification_of_an_older_report_is_ignored() {
    let service = Service::start();
    let older = service.results.store(report("lobby", 1), None);
    let tag = format!("\"{}\"", service.publish("lobby", 2));
    let (answer, id) = tokio::join!(service.get_if_none_match(WAIT, &tag), async {
        service.has_listeners(1).await;
        // As a Redis does whose replicas lag behind.
        service.results.listeners().notify(&older);
        service.publish("lobby", 3)
    });
    assert_eq!(
        (answer.status.as_u16(), answer.text()),
        (200, "3".to_owned())
    );
    assert_eq!(answer.header("etag"), format!("\"{id}\""));
}

#[tokio::test]
async fn a_wait_for_the_first_report_of_a_camera_returns_it() {
    let service = Service::start();
    let (answer, _) = tokio::join!(service.get(WAIT), async {
        service.has_listeners(1).await;
        service.publish("lobby", 1)
    });
    assert_eq!(
        (answer.status.as_u16(), answer.text()),
        (200, "1".to_owned())
    );
}

#[tokio::test(start_paused = true)]
async fn without_a_newer_report_the_wait_ends_at_its_limit() {
    let service = Service::within(&Bounds {
        request_timeout: Duration::from_secs(20),
        ..Bounds::default()
    });
    let tag = format!("\"{}\"", service.publish("lobby", 1));
    for (camera, wait, waited, status) in [
        ("lobby", 7, 7, 304),
        ("lobby", 600, 20, 304),
        ("hall", 7, 7, 404),
    ] {
        let began = Instant::now();
        let path = format!("/results/{camera}/latest?wait={wait}");
        let answer = service.get_if_none_match(&path, &tag).await;
        assert_eq!(answer.status, status, "{path}");
        assert_eq!(began.elapsed().as_secs(), waited, "{path}");
    }
}

#[tokio::test(start_paused = true)]
async fn a_client_without_the_latest_report_does_not_wait() {
    let service = Service::start();
    service.publish("lobby", 1);
    let began = Instant::now();
    for answer in [
        service.get(WAIT).await,
        service.get_if_none_match(WAIT, "\"1\"").await,
    ] {
        assert_eq!(answer.status, 200);
    }
    let now = service.get("/results/lobby/latest?wait=0").await;
    assert_eq!(now.status, 200);
    assert!(began.elapsed() < Duration::from_secs(1));
}

#[tokio::test(start_paused = true)]
async fn an_abandoned_wait_frees_its_permit() {
    let service = Service::start();
    tokio::select! {
        _ = service.get(WAIT) => panic!("the wait returned without a report"),
        () = sleep(Duration::from_secs(1)) => {}
    }
    assert_eq!(service.metrics.results_listeners.get(), 0);
}

#[tokio::test]
async fn waits_beyond_the_limit_are_refused() {
    let service = Service::within(&Bounds {
        results: ResultLimits {
            max_listeners: NonZeroUsize::MIN,
            ..ResultLimits::default()
        },
        ..Bounds::default()
    });
    let (first, refused) = tokio::join!(service.get(WAIT), async {
        service.has_listeners(1).await;
        let refused = [
            service.get("/results/hall/latest?wait=1").await,
            service.get("/results/hall/events").await,
            service.get("/events").await,
        ];
        service.publish("lobby", 1);
        refused
    });
    for answer in refused {
        assert_eq!(
            (answer.status.as_u16(), answer.header("retry-after")),
            (429, "1")
        );
        let problem = answer.problem();
        assert_eq!(problem["type"], "/problems/too-many-listeners");
        assert!(
            problem["detail"]
                .as_str()
                .unwrap()
                .contains("results.max_listeners")
        );
    }
    assert_eq!(first.status, 200);
}

#[tokio::test]
async fn a_wait_is_seconds_up_to_ten_minutes() {
    let service = Service::start();
    service.publish("lobby", 1);
    for wait in ["601", "-1", "1.5", "long", ""] {
        let answer = service
            .get(&format!("/results/lobby/latest?wait={wait}"))
            .await;
        assert_eq!(answer.status, 422, "{wait}");
        let problem = answer.problem();
        assert!(problem["detail"].as_str().unwrap().starts_with("wait: "));
    }
}
