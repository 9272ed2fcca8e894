//! Redis servers that misbehave, on real sockets.

use std::{
    io::{Read, Write},
    net::{TcpListener, TcpStream},
    sync::atomic::{AtomicU64, Ordering},
    thread,
    time::Instant,
};

use super::*;

/// Bytes that kernel buffers may take in addition to what the client reads.
const SOCKET_BYTES: u64 = 16 << 20;

/// A Redis that logs clients in, and sends `evil` to every other query, again and again if
/// `is_endless`.
struct EvilRedis {
    port: u16,
    sent: Arc<AtomicU64>,
}

struct Evil {
    reply: Vec<u8>,
    is_endless: bool,
    pause: Duration,
    /// True to send it without a query, to every connection for subscriptions.
    is_pushed: bool,
}

impl Evil {
    fn once(reply: &str) -> Self {
        Self {
            reply: reply.as_bytes().to_vec(),
            is_endless: false,
            pause: Duration::ZERO,
            is_pushed: false,
        }
    }
}

impl EvilRedis {
    fn start(evil: Evil) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let port = listener.local_addr().unwrap().port();
        let sent = Arc::new(AtomicU64::new(0));
        let (evil, counter) = (Arc::new(evil), Arc::clone(&sent));
        named(move || {
            for stream in listener.incoming().map_while(Result::ok) {
                let (evil, counter) = (Arc::clone(&evil), Arc::clone(&counter));
                // It ends when the client disconnects.
                named(move || serve(stream, &evil, &counter));
            }
        });
        Self { port, sent }
    }

    /// A store with a connection to this server.
    async fn store(&self) -> RedisResults {
        let limits = ResultLimits {
            max_bytes: 1 << 20,
            max_reports: NonZeroUsize::MIN,
            max_age: Duration::from_mins(1),
            ..ResultLimits::default()
        };
        let options = RedisOptions {
            address: format!("redis://127.0.0.1:{}", self.port).parse().unwrap(),
            key_prefix: "lookdown".to_owned(),
        };
        let store = RedisResults::start(options, limits, Arc::default()).unwrap();
        timeout(TIMEOUT, store.shared.link.next_line())
            .await
            .unwrap();
        store
    }
}

/// Starts a thread, which ends with its connection or its listener.
fn named<T: Send + 'static>(work: impl FnOnce() -> T + Send + 'static) -> thread::JoinHandle<T> {
    let thread = thread::Builder::new().name("evil-peer".to_owned());
    thread.spawn(work).unwrap()
}

fn serve(mut stream: TcpStream, evil: &Evil, sent: &AtomicU64) -> Option<()> {
    let mut buffer = vec![0; 64 << 10];
    let mut is_for_pushes = false;
    loop {
        let count = stream.read(&mut buffer).ok().filter(|count| *count > 0)?;
        let text = String::from_utf8_lossy(&buffer[..count]);
        // A test sends one query at a time, except at the login.
        is_for_pushes |= text.contains("HELLO\r\n");
        let is_check = text.contains("HGET\r\n") && text.contains("last");
        if text.contains("SETINFO") {
            let replies = text.matches("SETINFO").count() + text.matches("HELLO\r\n").count();
            stream
                .write_all("+OK\r\n".repeat(replies).as_bytes())
                .ok()?;
        } else if is_check && !(evil.is_pushed && is_for_pushes) {
            stream.write_all(b"$-1\r\n").ok()?;
        } else {
            loop {
                for part in evil.reply.chunks(64 << 10) {
                    stream.write_all(part).ok()?;
                    sent.fetch_add(part.len() as u64, Ordering::Relaxed);
                    thread::sleep(evil.pause);
                }
                if !evil.is_endless {
                    break;
                }
            }
        }
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn silence_and_a_slow_reply_end_in_time() {
    for reply in ["", "$100\r\n", "+"] {
        let redis = EvilRedis::start(Evil {
            reply: reply.as_bytes().to_vec(),
            is_endless: !reply.is_empty(),
            pause: Duration::from_millis(20),
            is_pushed: false,
        });
        let store = redis.store().await;
        let began = Instant::now();
        store.latest("hall").await.unwrap_err();
        assert!(
            began.elapsed() < TIMEOUT + Duration::from_secs(1),
            "{reply:?}"
        );
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn garbage_of_redis_is_a_failure_in_one_line() {
    for (reply, part) in [
        ("HTTP/1.1 400 Bad Request\r\n", ""),
        ("$x\r\n", ""),
        ("-ERR no\n2026-11-22 ERROR forged\r\n", "forged"),
        (":1\r\n", ""),
    ] {
        let redis = EvilRedis::start(Evil::once(reply));
        let store = redis.store().await;
        let Unreachable(problem) = store.latest("hall").await.unwrap_err();
        assert!(!problem.contains(['\r', '\n']), "{problem:?}");
        assert!(problem.contains(part), "{problem:?}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_flood_of_messages_of_redis_ends_the_connection() {
    let text = "y".repeat(8 << 10);
    let message = format!(
        ">3\r\n$8\r\nsmessage\r\n$1\r\nx\r\n${}\r\n{text}\r\n",
        text.len()
    );
    let redis = EvilRedis::start(Evil {
        reply: message.into_bytes(),
        is_endless: true,
        pause: Duration::ZERO,
        is_pushed: true,
    });
    let store = redis.store().await;
    timeout(2 * TIMEOUT, store.shared.link.lost())
        .await
        .unwrap();
    let sent = redis.sent.load(Ordering::Relaxed);
    assert!(sent < 4 * SOCKET_BYTES, "{sent}");
}

#[tokio::test(flavor = "multi_thread")]
async fn cameras_with_names_that_are_refused_are_skipped() {
    let long = "n".repeat(129);
    let names = ["hall", "", "\u{202e}llah", "a\nb", &long];
    let reply = names.map(|name| format!("${}\r\n{name}\r\n", name.len()));
    let mut reply = format!("*6\r\n{}", reply.concat()).into_bytes();
    reply.extend_from_slice(b"$2\r\n\xff\xfe\r\n");
    let redis = EvilRedis::start(Evil {
        reply,
        ..Evil::once("")
    });
    assert_eq!(redis.store().await.cameras().await.unwrap(), ["hall"]);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_report_with_line_ends_is_skipped() {
    let entry = |json: &str| {
        let fields = [
            "received_at",
            "2026-11-22T09:30:00Z",
            "persons",
            "1",
            "json",
            json,
        ];
        let fields = fields.map(|field| format!("${}\r\n{field}\r\n", field.len()));
        format!("*1\r\n*2\r\n$3\r\n7-0\r\n*6\r\n{}", fields.concat())
    };
    for (json, is_report) in [("{}", true), ("{}\n\nevent: evil", false), ("{}\r", false)] {
        let redis = EvilRedis::start(Evil::once(&entry(json)));
        let found = redis.store().await.latest("hall").await.unwrap();
        assert_eq!(found.is_some(), is_report, "{json:?}");
    }
}
