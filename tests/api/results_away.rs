//! An unreachable result store: nothing listens on the first port.

use std::time::Duration;

use tokio::time::timeout;

use crate::server::Server;

#[tokio::test(flavor = "multi_thread")]
async fn detection_works_while_the_result_store_is_unreachable() {
    let url = "redis://:s3cret@127.0.0.1:1";
    let server = Server::start(&[("RESULTS__URL", url)]).await;
    assert!(server.detect().await.unwrap().unwrap().contains("200 OK"));
    server.shows("results_store_up", 0).await;
    server.shows("results_waiting", 1).await;
    for path in [
        "/results",
        "/results/lobby/latest",
        "/results/lobby/latest?wait=5",
        "/results/lobby/history",
        "/results/lobby/events",
        "/events",
    ] {
        let answer = server.get(path).await;
        assert!(answer.starts_with("HTTP/1.1 503 "), "{answer}");
        assert!(answer.contains("\r\nretry-after: 1\r\n"), "{answer}");
        assert!(answer.contains("/problems/results-unreachable"), "{answer}");
    }
    let ready = server.get("/readyz").await;
    assert!(ready.starts_with("HTTP/1.1 200 "), "{ready}");
    assert!(ready.contains("\"store_problem\":"), "{ready}");
    assert!(!ready.contains("s3cret"), "{ready}");
    server.shutdown.request_without_pause();
    let ended = timeout(Duration::from_secs(20), server.has_ended());
    ended.await.unwrap();
}
