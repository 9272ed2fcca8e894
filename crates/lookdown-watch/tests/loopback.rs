//! Cameras and a Lookdown server over loopback: small HTTP servers that answer as they are asked.
#![expect(clippy::unwrap_used, reason = "a panic fails the test")]

mod exchange;

use std::{
    sync::{
        Arc,
        atomic::{AtomicUsize, Ordering},
    },
    time::{Duration, Instant},
};

use exchange::{Exchange, Reply, serve};
use lookdown_common::ServerEntry;
use lookdown_watch::{
    CameraEntry, Metrics, Origin, VideoFrames, VideoOptions, WatchError, WatchOptions, watch,
};
use tokio::time::{sleep, timeout};

const JPEG: &[u8] = b"\xff\xd8\xff\xda\x00\x02xyz\xff\xd9";
const PATIENCE: Duration = Duration::from_secs(20);

fn metrics() -> Arc<Metrics> {
    Arc::new(Metrics::new().unwrap())
}

/// Settings of a camera that sends every 50 ms.
fn entry(url: &str) -> CameraEntry {
    CameraEntry {
        name: Some("hall".to_owned()),
        url: Some(url.to_owned()),
        every: Some("50ms".to_owned()),
        stall_after: Some("1s".to_owned()),
        profile: Some("fast".to_owned()),
        ..CameraEntry::default()
    }
}

/// Watches a camera until `done` returns true, and returns the time that it took.
async fn watch_until(camera: CameraEntry, server: &Exchange, done: impl Fn() -> bool) -> Duration {
    let target = ServerEntry {
        url: Some(server.url("")),
        ..ServerEntry::default()
    };
    let options =
        WatchOptions::new(target.check().unwrap(), vec![camera.check("").unwrap()]).unwrap();
    let started = Instant::now();
    let stop = async {
        while !done() {
            sleep(Duration::from_millis(5)).await;
        }
    };
    let watching = watch(Origin::Fixed(options), metrics(), stop);
    timeout(PATIENCE, watching).await.unwrap().unwrap();
    started.elapsed()
}

fn snapshot() -> Reply {
    Reply::ok("image/jpeg", JPEG)
}

fn report() -> Reply {
    Reply::ok("application/json", b"{}")
}

#[tokio::test]
async fn snapshots_reach_the_server_with_their_parameters() {
    let camera = serve(|_| snapshot()).await;
    let server = serve(|_| report()).await;
    watch_until(entry(&camera.url("snap.jpg")), &server, || {
        server.count() >= 3
    })
    .await;
    let request = server.request(0);
    assert!(request.head.starts_with(
        "POST /detect?camera=hall&profile=fast&motion=true&follow=true&captured_at=20"
    ));
    assert!(
        request.head.contains("content-type: image/jpeg"),
        "{}",
        request.head
    );
    assert_eq!(request.body, JPEG);
}

#[tokio::test]
async fn an_unchanged_snapshot_is_not_sent_again() {
    let camera = serve(|request| {
        if request.head.contains("if-none-match: \"1\"") {
            Reply::status(304)
        } else {
            snapshot().with("ETag", "\"1\"")
        }
    })
    .await;
    let server = serve(|_| report()).await;
    watch_until(entry(&camera.url("")), &server, || camera.count() >= 10).await;
    assert_eq!(server.count(), 1);
}

#[tokio::test]
async fn a_challenge_is_answered_and_a_refusal_ends_the_attempts() {
    let challenge = || {
        Reply::status(401).with(
            "WWW-Authenticate",
            "Digest realm=\"c\", nonce=\"n\", qop=\"auth\"",
        )
    };
    let camera = serve(move |request| {
        if request.head.contains("authorization: Digest") {
            snapshot()
        } else {
            challenge()
        }
    })
    .await;
    let server = serve(|_| report()).await;
    let mut login = entry(&camera.url("").replace("//", "//user:secret@"));
    watch_until(login.clone(), &server, || server.count() >= 3).await;
    let heads = (0..camera.count()).map(|index| camera.request(index).head);
    assert_eq!(
        heads.filter(|head| !head.contains("authorization")).count(),
        1
    );

    let closed = serve(move |_| challenge()).await;
    login.url = Some(closed.url("").replace("//", "//user:wrong@"));
    let started = Instant::now();
    watch_until(login, &server, || {
        started.elapsed() > Duration::from_secs(2)
    })
    .await;
    assert_eq!(closed.count(), 2, "the account is not locked by attempts");
}

#[tokio::test]
async fn a_camera_with_basic_authentication_gets_its_login() {
    // RFC 7617: user, a colon and the password, in base64.
    let camera = serve(|request| {
        if request
            .head
            .contains("authorization: Basic dXNlcjpzZWNyZXQ=\r\n")
        {
            snapshot()
        } else {
            Reply::status(401).with("WWW-Authenticate", "Basic realm=\"camera\"")
        }
    })
    .await;
    let server = serve(|_| report()).await;
    let login = entry(&camera.url("").replace("//", "//user:secret@"));
    watch_until(login, &server, || server.count() >= 3).await;
    let heads: Vec<_> = (0..camera.count())
        .map(|index| camera.request(index).head)
        .collect();
    assert!(!heads[0].contains("authorization"), "{}", heads[0]);
    let without = heads.iter().filter(|head| !head.contains("authorization"));
    assert_eq!(without.count(), 1);
}

#[tokio::test]
async fn a_stream_is_read_and_damaged_parts_are_dropped() {
    let part = |body: &[u8]| [b"--b\r\nContent-Type: image/jpeg\r\n\r\n", body, b"\r\n"].concat();
    let stream = [part(JPEG), part(b"noise"), part(JPEG), b"--b\r\n".to_vec()].concat();
    let camera = serve(move |_| Reply::ok("multipart/x-mixed-replace; boundary=b", &stream)).await;
    let server = serve(|_| report()).await;
    // The stream ends after each answer, so the source reconnects.
    watch_until(entry(&camera.url("")), &server, || server.count() >= 2).await;
    assert!(camera.count() >= 2);
    assert_eq!(server.request(1).body, JPEG);
}

#[tokio::test]
async fn a_stalled_camera_is_asked_again() {
    let asked = AtomicUsize::new(0);
    let camera = serve(move |_| match asked.fetch_add(1, Ordering::Relaxed) {
        1 => Reply::Silence,
        _ => snapshot(),
    })
    .await;
    let server = serve(|_| report()).await;
    let took = watch_until(entry(&camera.url("")), &server, || server.count() >= 3).await;
    assert!(took > Duration::from_secs(1), "{took:?}");
}

#[tokio::test]
async fn retry_after_of_a_busy_server_is_honoured() {
    let camera = serve(|_| snapshot()).await;
    let asked = AtomicUsize::new(0);
    let server = serve(move |_| match asked.fetch_add(1, Ordering::Relaxed) {
        0 => Reply::status(429).with("Retry-After", "2"),
        _ => report(),
    })
    .await;
    let took = watch_until(entry(&camera.url("")), &server, || server.count() >= 2).await;
    assert!(
        took >= Duration::from_secs(2) && took < Duration::from_secs(6),
        "{took:?}"
    );
}

#[tokio::test]
async fn a_slow_server_gets_the_newest_frame_only() {
    let number = AtomicUsize::new(0);
    let camera = serve(move |_| {
        let number = number.fetch_add(1, Ordering::Relaxed);
        let frame = [&JPEG[..6], format!("{number:04}").as_bytes(), &JPEG[9..]].concat();
        Reply::ok("image/jpeg", &frame)
    })
    .await;
    let server = serve(|_| Reply::Slow(Duration::from_millis(500), Box::new(report()))).await;
    watch_until(entry(&camera.url("")), &server, || server.count() >= 3).await;
    let number = |index: usize| {
        let body = server.request(index).body;
        String::from_utf8(body[6..10].to_vec())
            .unwrap()
            .parse::<usize>()
            .unwrap()
    };
    assert!(
        number(1) >= 5,
        "the frames in between are skipped: {}",
        number(1)
    );
    assert!(number(2) >= number(1) + 5);
}

#[tokio::test]
async fn a_single_image_that_is_refused_fails() {
    let folder = tempfile::tempdir().unwrap();
    let clip = folder.path().join("clip.mp4");
    std::fs::write(&clip, "no video").unwrap();
    let server = serve(|_| report()).await;
    let target = ServerEntry {
        url: Some(server.url("")),
        ..ServerEntry::default()
    };
    let camera = entry(clip.to_str().unwrap()).check("").unwrap();
    let options = WatchOptions::new(target.check().unwrap(), vec![camera]).unwrap();
    let watching = watch(Origin::Fixed(options), metrics(), std::future::pending());
    let outcome = timeout(PATIENCE, watching).await.unwrap();
    assert!(matches!(outcome, Err(WatchError::NoFrame(name)) if name == "hall"));
}

#[tokio::test]
async fn a_missing_ffmpeg_is_named_with_its_remedy() {
    let options = VideoOptions {
        ffmpeg: "/nowhere/ffmpeg".into(),
        ..VideoOptions::default()
    };
    let opened = VideoFrames::open("clip.mp4".as_ref(), PATIENCE, &options).await;
    let error = opened.err().unwrap().to_string();
    assert!(
        error.starts_with("/nowhere/ffmpeg cannot be started"),
        "{error}"
    );
    assert!(error.contains("install ffmpeg 5.1 or newer"), "{error}");
}
