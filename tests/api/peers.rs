//! HTTP peers that misbehave: an inference server and a trace collector whose responses never end,
//! never come or are not HTTP. The bytes and the time of each are bounded.

use std::{
    fs,
    io::{Read, Write},
    net::{SocketAddr, TcpListener, TcpStream},
    num::NonZeroUsize,
    sync::{
        Arc,
        atomic::{AtomicU64, Ordering},
    },
    thread,
    time::{Duration, Instant},
};

use lookdown::{
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
        // Up to 6 MB/s, which a client without optimization still reads.
        rest: hints.repeat(7).into_bytes(),
        pause: Duration::from_millis(10),
    }
}

#[test]
fn provisional_responses_end_at_the_timeout() {
    let began = Instant::now();
    let peer = EvilServer::start(provisional());
    let options = RemoteOptions {
        url: format!("http://{}", peer.address).parse().unwrap(),
        token: None,
        model: "there".to_owned(),
        called: "here".to_owned(),
        timeout: Duration::from_secs(3),
    };
    let server = RemoteServer::new(options, Arc::default()).unwrap();
    for _ in 0..3 {
        server.check_health();
    }
    assert!(!server.is_available());
    // Three probes of 2 s.
    assert!(began.elapsed() < Duration::from_secs(20));
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
