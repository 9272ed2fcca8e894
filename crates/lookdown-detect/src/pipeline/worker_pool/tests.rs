use std::{
    sync::mpsc::{Receiver, SyncSender, sync_channel},
    time::Duration,
};

use super::*;
use crate::pipeline::test_support::{BlobDetector, engine, frame_with_disc, job};

impl WorkerPool {
    async fn detect(&self, job: DetectJob) -> Result<DetectedFrame, PipelineError> {
        self.detect_and(job, |detected| detected).await
    }
}

/// A detector that reports the start of each batch and then waits for release.
fn gated_pool(capacity: usize) -> (Arc<WorkerPool>, Receiver<()>, SyncSender<()>) {
    let (begun, begins) = sync_channel(64);
    let (go, gate) = sync_channel(64);
    let detector = BlobDetector {
        before: Box::new(move || {
            begun.send(()).unwrap();
            gate.recv_timeout(Duration::from_mins(1)).unwrap();
            Ok(())
        }),
        ..BlobDetector::default()
    };
    let one = NonZeroUsize::MIN;
    let engine = Arc::new(engine(detector, None));
    let pool = WorkerPool::start(&engine, one, NonZeroUsize::new(capacity).unwrap()).unwrap();
    (Arc::new(pool), begins, go)
}

fn direct_job() -> DetectJob {
    job(
        frame_with_disc(100, [30.0, 50.0], 8.0),
        &[("profile", "direct")],
    )
}

fn spawn(pool: &Arc<WorkerPool>) -> tokio::task::JoinHandle<Result<DetectedFrame, PipelineError>> {
    let pool = Arc::clone(pool);
    tokio::spawn(async move { pool.detect(direct_job()).await })
}

/// Waits until `count` frames are pending.
async fn until_pending(pool: &WorkerPool, count: usize) {
    while pool.pending() != count {
        tokio::task::yield_now().await;
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_full_queue_refuses_frames_until_it_has_drained() {
    let (pool, begins, go) = gated_pool(2);
    let (first, second) = (spawn(&pool), spawn(&pool));
    until_pending(&pool, 2).await;
    begins.recv().unwrap();
    let refused = pool.detect(direct_job()).await.unwrap_err();
    assert!(matches!(
        refused,
        PipelineError::Overloaded { capacity: 2, .. }
    ));

    go.send(()).unwrap();
    go.send(()).unwrap();
    first.await.unwrap().unwrap();
    second.await.unwrap().unwrap();
    until_pending(&pool, 0).await;
    go.send(()).unwrap();
    pool.detect(direct_job()).await.unwrap();
}

#[tokio::test(flavor = "multi_thread")]
async fn a_costly_frame_takes_more_permits_but_at_most_half() {
    // 128 views and more cost 5 permits, of which 4 are half of the queue.
    let (pool, begins, go) = gated_pool(8);
    let paper = || {
        let image = frame_with_disc(100, [30.0, 50.0], 8.0);
        job(image, &[("profile", "paper")])
    };
    let first = spawn(&pool);
    begins.recv().unwrap();
    let costly = Arc::clone(&pool);
    let costly = tokio::spawn(async move { costly.detect(paper()).await.map(drop) });
    until_pending(&pool, 2).await;
    let refused = pool.detect(paper()).await.unwrap_err();
    assert!(matches!(refused, PipelineError::Overloaded { .. }));
    let others: Vec<_> = (0..3).map(|_| spawn(&pool)).collect();
    until_pending(&pool, 5).await;
    assert!(pool.admits(&Client::Only).is_err());
    costly.abort();
    for _ in 0..4 {
        go.send(()).unwrap();
    }
    first.await.unwrap().unwrap();
    for other in others {
        other.await.unwrap().unwrap();
    }
    until_pending(&pool, 0).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn one_client_leaves_half_of_the_queue_to_others() {
    let (pool, begins, go) = gated_pool(4);
    let detect = |name: &str| {
        let (pool, mut job) = (Arc::clone(&pool), direct_job());
        job.ticket.client = Client::with_key(name);
        tokio::spawn(async move { pool.detect(job).await.map(drop) })
    };
    let greedy = [detect("greedy"), detect("greedy")];
    until_pending(&pool, 2).await;
    begins.recv().unwrap();
    let refused = detect("greedy").await.unwrap().unwrap_err().to_string();
    let expected = "the key greedy uses its share of the queue already (2 of 4 frames)";
    assert!(refused.starts_with(expected), "{refused}");
    let modest = detect("modest");
    until_pending(&pool, 3).await;
    for _ in 0..3 {
        go.send(()).unwrap();
    }
    for frame in greedy.into_iter().chain([modest]) {
        frame.await.unwrap().unwrap();
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn other_work_takes_a_permit_and_waits_for_its_turn() {
    let (pool, begins, go) = gated_pool(2);
    let first = spawn(&pool);
    begins.recv().unwrap();
    let others = Arc::clone(&pool);
    let other = tokio::spawn(async move { others.run(Ticket::default(), |_| 7).await });
    until_pending(&pool, 2).await;
    let refused = pool.run(Ticket::default(), |_| 8).await.unwrap_err();
    assert!(matches!(
        refused,
        PipelineError::Overloaded { capacity: 2, .. }
    ));
    go.send(()).unwrap();
    first.await.unwrap().unwrap();
    assert_eq!(other.await.unwrap().unwrap(), 7);
    until_pending(&pool, 0).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_frame_of_a_disconnected_client_is_not_processed() {
    let (pool, begins, go) = gated_pool(4);
    let first = spawn(&pool);
    begins.recv().unwrap();
    let second = spawn(&pool);
    until_pending(&pool, 2).await;
    second.abort();
    assert!(second.await.unwrap_err().is_cancelled());
    go.send(()).unwrap();
    first.await.unwrap().unwrap();
    until_pending(&pool, 0).await;
    assert!(
        begins.try_recv().is_err(),
        "the second frame reached the network"
    );
}

#[tokio::test(flavor = "multi_thread")]
async fn shutdown_finishes_queued_frames_and_refuses_new_ones() {
    let (pool, begins, go) = gated_pool(4);
    let (first, second) = (spawn(&pool), spawn(&pool));
    until_pending(&pool, 2).await;
    begins.recv().unwrap();
    let closing = Arc::clone(&pool);
    let closing = tokio::task::spawn_blocking(move || closing.shut_down());
    go.send(()).unwrap();
    go.send(()).unwrap();
    first.await.unwrap().unwrap();
    second.await.unwrap().unwrap();
    closing.await.unwrap();
    let late = pool.detect(direct_job()).await.unwrap_err();
    assert!(matches!(late, PipelineError::ShuttingDown));
}

#[tokio::test(flavor = "multi_thread")]
async fn a_panic_on_one_frame_fails_that_frame_only() {
    let mut frames = 0;
    let detector = BlobDetector {
        before: Box::new(move || {
            frames += 1;
            assert_ne!(frames, 1, "the first frame fails on purpose");
            Ok(())
        }),
        ..BlobDetector::default()
    };
    let engine = Arc::new(engine(detector, None));
    let pool = WorkerPool::start(&engine, NonZeroUsize::MIN, NonZeroUsize::MIN).unwrap();
    let failed = pool.detect(direct_job()).await.unwrap_err();
    assert!(matches!(failed, PipelineError::Internal(_)));
    until_pending(&pool, 0).await;
    pool.detect(direct_job()).await.unwrap();
}

#[tokio::test(flavor = "multi_thread")]
async fn finish_runs_on_the_worker_and_holds_the_permit() {
    let engine = Arc::new(engine(BlobDetector::default(), None));
    let pool = WorkerPool::start(&engine, NonZeroUsize::MIN, NonZeroUsize::MIN).unwrap();
    let pool = Arc::new(pool);
    let asked = Arc::clone(&pool);
    let finished = pool.detect_and(direct_job(), move |detected| {
        let thread = std::thread::current().name().map(ToOwned::to_owned);
        (detected.report.persons.len(), asked.pending(), thread)
    });
    let (persons, pending, thread) = finished.await.unwrap();
    assert_eq!((persons, pending), (1, 1));
    assert_eq!(thread.as_deref(), Some("frame-worker-0"));
    until_pending(&pool, 0).await;
    let failed = pool.detect_and(direct_job(), |_| panic!("drawing fails on purpose"));
    assert!(matches!(
        failed.await.unwrap_err(),
        PipelineError::Internal(_)
    ));
    until_pending(&pool, 0).await;
    pool.detect(direct_job()).await.unwrap();
}
