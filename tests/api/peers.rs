//! HTTP peers that misbehave: an inference server, a bucket and a trace collector whose responses
//! never end, never come or are not HTTP. The bytes and the time of each are bounded.

use std::{
    env, fs,
    io::{Read, Write},
    net::{SocketAddr, TcpListener, TcpStream},
    num::NonZeroUsize,
    process::Command,
    sync::{
        Arc,
        atomic::{AtomicU64, Ordering},
    },
    thread,
    time::{Duration, Instant},
};

use lookdown::{
    calibration_store::{BucketStore, CalibrationStore},
    settings::TraceSettings,
    telemetry::{IncomingTrace, Tracer},
};
use lookdown_detect::inference::{
    CandidateOptions, InferenceError, RemoteDetector, RemoteOptions, RemoteServer,
};
use tokio::task::spawn_blocking;

/// Bytes that kernel buffers may take in addition to what a client reads.
const SOCKET_BYTES: u64 = 16 << 20;
const HEAD: &str = "HTTP/1.1 200 OK\r\n";

/// A server that answers every connection alike.
struct EvilServer {
    address: SocketAddr,
    sent: Arc<AtomicU64>,
}

/// An answer: `start`, then `rest` again and again with a pause after each, until the client
/// leaves.
#[derive(Clone)]
struct Evil {
    name: &'static str,
    start: String,
    rest: Vec<u8>,
    pause: Duration,
}

fn every_kind() -> Vec<Evil> {
    let chunk = [b"10000\r\n", &vec![b' '; 1 << 16][..], b"\r\n"].concat();
    let spaces = vec![b' '; 1 << 16];
    let evil = |name, start: String, rest: &[u8], millis| Evil {
        name,
        start,
        rest: rest.to_vec(),
        pause: Duration::from_millis(millis),
    };
    vec![
        evil(
            "endless chunks",
            format!("{HEAD}Transfer-Encoding: chunked\r\n\r\n"),
            &chunk,
            0,
        ),
        evil(
            "a huge declared length",
            format!("{HEAD}Content-Length: 1000000000000\r\n\r\n"),
            &spaces,
            0,
        ),
        evil("an endless head", format!("{HEAD}X: "), &[b'x'; 1 << 16], 0),
        evil("silence", String::new(), b"", 50),
        evil(
            "a slow body",
            format!("{HEAD}Content-Length: 1000000\r\n\r\n"),
            b" ",
            50,
        ),
        evil("a slow head", format!("{HEAD}X: "), b"x", 50),
        evil("garbage", "\u{1}\u{2}\r\n\r\n".to_owned(), &spaces, 0),
    ]
}

impl EvilServer {
    fn start(evil: Evil) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = listener.local_addr().unwrap();
        let sent = Arc::new(AtomicU64::new(0));
        let counter = Arc::clone(&sent);
        named(move || {
            for stream in listener.incoming().map_while(Result::ok) {
                let (evil, counter) = (evil.clone(), Arc::clone(&counter));
                named(move || answer(stream, &evil, &counter));
            }
        });
        Self { address, sent }
    }

    fn sent(&self) -> u64 {
        self.sent.load(Ordering::Relaxed)
    }
}

/// Starts a thread, which ends with its connection or its listener.
fn named<T: Send + 'static>(work: impl FnOnce() -> T + Send + 'static) -> thread::JoinHandle<T> {
    let thread = thread::Builder::new().name("evil-peer".to_owned());
    thread.spawn(work).unwrap()
}

fn answer(mut stream: TcpStream, evil: &Evil, sent: &AtomicU64) -> Option<()> {
    let count = stream.read(&mut [0; 1 << 13]).ok()?;
    if count == 0 {
        return None;
    }
    stream.write_all(evil.start.as_bytes()).ok()?;
    // Silence ends when the client leaves, too.
    stream
        .set_read_timeout(Some(Duration::from_millis(1)))
        .ok()?;
    loop {
        stream.write_all(&evil.rest).ok()?;
        sent.fetch_add(evil.rest.len() as u64, Ordering::Relaxed);
        thread::sleep(evil.pause);
        if evil.rest.is_empty() && stream.read(&mut [0; 1 << 13]).is_ok_and(|count| count == 0) {
            return None;
        }
    }
}

#[test]
fn responses_of_an_inference_server_are_bounded() {
    let folder = tempfile::tempdir().unwrap();
    let manifest = "name = \"here\"\nonnx = \"model.onnx\"\n";
    fs::write(folder.path().join("model.toml"), manifest).unwrap();
    let candidates = CandidateOptions {
        score_floor: 0.1,
        max_detections_per_view: 10,
    };
    let timeout = Duration::from_secs(3);
    for evil in every_kind() {
        let name = evil.name;
        let peer = EvilServer::start(evil);
        let options = RemoteOptions {
            url: format!("http://{}", peer.address).parse().unwrap(),
            token: None,
            model: "there".to_owned(),
            called: "here".to_owned(),
            timeout,
        };
        let server = Arc::new(RemoteServer::new(options, Arc::default()).unwrap());
        let began = Instant::now();
        let model = folder.path();
        let loaded = RemoteDetector::load_sessions(&server, model, candidates, NonZeroUsize::MIN);
        let error = loaded.err().unwrap();
        assert!(
            matches!(error, InferenceError::Remote { .. }),
            "{name}: {error}"
        );
        assert!(!error.to_string().contains('\n'), "{name}: {error}");
        // A request that fails before its response is sent once more.
        assert!(began.elapsed() < 2 * timeout, "{name}");
        assert!(peer.sent() < (64 << 20) + 2 * SOCKET_BYTES, "{name}");
    }
}

/// An answer that only announces another one, without end.
fn provisional() -> Evil {
    let link = "s".repeat(8000);
    let hints = format!("HTTP/1.1 103 Early Hints\r\nLink: </{link}.css>; rel=preload\r\n\r\n");
    Evil {
        name: "endless provisional responses",
        start: String::new(),
        // Up to 6 MB/s, which a client without optimization still reads. Both clients get more than
        // the bound of memory.
        rest: hints.repeat(7).into_bytes(),
        pause: Duration::from_millis(10),
    }
}

/// Returns the memory that this process uses, in bytes.
fn resident_bytes() -> u64 {
    let pages = fs::read_to_string("/proc/self/statm").unwrap();
    let pages = pages.split(' ').nth(1).unwrap();
    pages.parse::<u64>().unwrap() * 4096
}

#[test]
fn provisional_responses_end_at_the_timeout() {
    // In a process of its own: the memory of other tests is not measured with it.
    let mut alone = Command::new(env::current_exe().unwrap());
    alone.args(["peers::provisional_responses_alone", "--exact", "--ignored"]);
    let output = alone.output().unwrap();
    let printed = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{printed}");
    assert!(printed.contains("1 passed"), "{printed}");
}

#[tokio::test(flavor = "multi_thread")]
#[ignore = "run by the test before in a process of its own"]
async fn provisional_responses_alone() {
    let before = resident_bytes();
    let server = |address: SocketAddr| {
        let options = RemoteOptions {
            url: format!("http://{address}").parse().unwrap(),
            token: None,
            model: "there".to_owned(),
            called: "here".to_owned(),
            timeout: Duration::from_secs(3),
        };
        RemoteServer::new(options, Arc::default()).unwrap()
    };
    let began = Instant::now();
    let peer = EvilServer::start(provisional());
    let address = peer.address;
    let probes = spawn_blocking(move || {
        let server = server(address);
        (0..3).for_each(|_| {
            server.check_health();
        });
        assert!(!server.is_available());
    });
    let list = spawn_blocking(move || {
        let bucket = bucket_at(address).list().unwrap_err().to_string();
        assert!(bucket.contains("no answer in time"), "{bucket}");
    });
    probes.await.unwrap();
    list.await.unwrap();
    // Three probes of 2 s, and a request of 5 s beside them.
    assert!(began.elapsed() < Duration::from_secs(20));
    assert!(resident_bytes() < before + (40 << 20));
}

fn bucket_at(address: SocketAddr) -> BucketStore {
    let variables = [
        ("AWS_ENDPOINT", format!("http://{address}")),
        ("AWS_ALLOW_HTTP", "true".to_owned()),
        ("AWS_ACCESS_KEY_ID", "me".to_owned()),
        ("AWS_SECRET_ACCESS_KEY", "secret".to_owned()),
    ];
    let variables = variables.map(|(name, value)| (name.to_owned(), value));
    BucketStore::new(&"s3://cameras".parse().unwrap(), variables.into_iter()).unwrap()
}

/// Answers a request for an object of 50 MB, or for a part of it.
fn answer_huge_object(mut stream: TcpStream) {
    let mut request = [0; 1 << 13];
    let length = stream.read(&mut request).unwrap();
    let request = String::from_utf8_lossy(&request[..length]).to_ascii_lowercase();
    let head =
        "ETag: \"1\"\r\nLast-Modified: Mon, 23 Nov 2026 09:00:00 GMT\r\nConnection: close\r\n";
    let answer = if request.contains("range: bytes=0-1023\r\n") {
        let part = "Content-Range: bytes 0-1023/50000000\r\nContent-Length: 1024\r\n\r\n";
        let body = " ".repeat(1024);
        format!("HTTP/1.1 206 Partial Content\r\n{head}{part}{body}")
    } else {
        format!("{HEAD}{head}Content-Length: 50000000\r\n\r\n")
    };
    // The client does not wait for the rest.
    let _ = stream.write_all(answer.as_bytes());
}

#[test]
fn a_huge_object_of_a_bucket_is_read_up_to_the_limit() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap();
    named(move || {
        for stream in listener.incoming().map_while(Result::ok) {
            named(move || answer_huge_object(stream));
        }
    });
    let contents = bucket_at(address).read(&["huge.json"], 1024);
    assert_eq!(contents[0].as_ref().unwrap().len(), 1024);
}

#[test]
fn responses_of_a_bucket_are_bounded() {
    let tests = every_kind().into_iter().map(|evil| {
        named(move || {
            let name = evil.name;
            let peer = EvilServer::start(evil);
            let store = bucket_at(peer.address);
            let began = Instant::now();
            let error = store.list().unwrap_err().to_string();
            assert!(!error.contains('\n'), "{name}: {error}");
            // Two attempts of at most 5 s each.
            assert!(began.elapsed() < Duration::from_secs(13), "{name}");
            assert!(peer.sent() < 3 * ((16 << 20) + SOCKET_BYTES), "{name}");
        })
    });
    for test in tests.collect::<Vec<_>>() {
        test.join().unwrap();
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn responses_of_a_trace_collector_are_bounded() {
    for evil in every_kind() {
        let name = evil.name;
        let peer = EvilServer::start(evil);
        let settings = TraceSettings {
            otlp_endpoint: Some(format!("http://{}", peer.address).parse().unwrap()),
            sample_ratio: 1.0,
            service_name: "lookdown".to_owned(),
        };
        let tracer = Tracer::start(&settings).unwrap();
        drop(tracer.request(|| "GET".to_owned(), &IncomingTrace::default()));
        let began = Instant::now();
        spawn_blocking(move || tracer.shut_down()).await.unwrap();
        assert!(began.elapsed() < Duration::from_secs(5), "{name}");
        assert!(peer.sent() < 2 * SOCKET_BYTES, "{name}");
    }
}
