//! The same attacks on each listener of the product. The table of protections in SECURITY.md shows
//! what this test measures.

use std::{
    fs,
    io::{ErrorKind, Read, Write},
    net::{SocketAddr, TcpListener, TcpStream},
    path::{Path, PathBuf},
    sync::Arc,
    time::Duration,
};

use lookdown_common::ServerEntry;
use lookdown_count::{CountEntry, Snapshot};
use lookdown_watch::{CameraEntry, Metrics, WatchOptions, serve_metrics};
use tempfile::TempDir;
use tokio::{
    sync::watch,
    task::{JoinHandle, spawn_blocking},
    time::{sleep, timeout},
};

use crate::server::Server;

/// A listener under test.
struct Listener {
    name: &'static str,
    address: SocketAddr,
    /// A path of the listener that shows data.
    path: &'static str,
    key: Option<&'static str>,
}

pub(crate) const KEY: &str = "0123456789abcdef";
/// Fewer connections than a companion serves at a time.
const SILENT: usize = 48;

/// Longest wait for a connection, and for the end of an answer: longer than the timeouts of heads.
const TIMEOUT: Duration = Duration::from_secs(20);

/// Sends bytes and reads until the listener closes the connection.
pub(crate) fn answer(address: SocketAddr, request: &str) -> String {
    let mut connection = TcpStream::connect_timeout(&address, TIMEOUT).unwrap();
    connection.set_read_timeout(Some(TIMEOUT)).unwrap();
    connection.write_all(request.as_bytes()).unwrap();
    let mut bytes = Vec::new();
    // Bytes received before a reset count.
    if let Err(error) = connection.read_to_end(&mut bytes) {
        let is_open = error.kind() == ErrorKind::WouldBlock;
        assert!(!is_open, "{address} leaves this open: {request:?}");
    }
    String::from_utf8_lossy(&bytes).into_owned()
}

impl Listener {
    fn request(&self, method: &str, headers: &str) -> String {
        let path = self.path;
        answer(
            self.address,
            &format!("{method} {path} HTTP/1.1\r\nConnection: close\r\n{headers}\r\n"),
        )
    }

    fn with_key(&self, headers: &str) -> String {
        match self.key {
            Some(key) => format!("{headers}Authorization: bearer {key}\r\n"),
            None => headers.to_owned(),
        }
    }

    fn status(&self, headers: &str) -> u16 {
        status(&self.request("GET", &self.with_key(headers)))
    }

    fn is_alive(&self) -> bool {
        let request = "GET /livez HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n";
        status(&answer(self.address, request)) == 200
    }

    /// Silent connections, and a head that never ends.
    fn survives_silence(&self) -> bool {
        let silent: Vec<_> = (0..SILENT)
            .map(|_| TcpStream::connect(self.address).unwrap())
            .collect();
        let is_alive = self.is_alive();
        let slow = answer(
            self.address,
            "GET /livez HTTP/1.1\r\nHost: localhost\r\nX: ",
        );
        drop(silent);
        is_alive && slow.is_empty()
    }

    fn answers_pipelined_requests_in_order(&self) -> bool {
        let path = "GET /livez HTTP/1.1\r\nHost: localhost\r\n\r\n";
        let last = "GET /nowhere HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n";
        let answers = answer(self.address, &(path.repeat(100) + last));
        let is_in_order = answers.rfind("200 OK") < answers.find("404 Not Found");
        is_in_order && answers.matches("HTTP/1.1 200").count() == 100
    }

    /// Connections that ask without a pause and never read.
    fn survives_unread_answers(&self) -> bool {
        let request = self.with_key("Host: localhost\r\n");
        let request = format!("GET {} HTTP/1.1\r\n{request}\r\n", self.path);
        let unread: Vec<_> = (0..40)
            .map(|_| {
                let mut connection = TcpStream::connect(self.address).unwrap();
                // A listener that closes the connection is right.
                let _ = connection.write_all(request.repeat(20).as_bytes());
                connection
            })
            .collect();
        let is_alive = self.is_alive();
        drop(unread);
        is_alive
    }

    /// Measures the row of the table in SECURITY.md.
    fn row(&self) -> String {
        let local = "Host: localhost\r\n";
        assert_eq!(self.status(local), 200, "{}", self.name);
        let head = self.request("GET", &self.with_key(local));
        let has_headers = ["x-content-type-options: nosniff", "x-frame-options: DENY"];
        let has_headers = has_headers.iter().all(|header| head.contains(header))
            && head.contains("content-security-policy: default-src 'none'");
        let refused = answer(
            self.address,
            "GET /nowhere HTTP/1.1\r\nConnection: close\r\n\r\n",
        );
        let has_problems = refused.contains("application/problem+json")
            && refused.contains("\"request_id\"")
            && refused.contains("\"instance\"");
        // First: the connections of the others end some time later.
        let is_in_order = self.answers_pipelined_requests_in_order();
        let cells = [
            self.survives_silence(),
            is_in_order,
            self.survives_unread_answers(),
            ["", "Host: a{b\r\n", "Host: a\r\nHost: b\r\n"]
                .iter()
                .all(|hosts| self.status(hosts) == 400),
            self.status("Host: evil.example\r\n") == 403,
            self.status("Host: localhost\r\nX-Forwarded-For: 203.0.113.7\r\n") == 403,
            {
                let origin = self.with_key("Host: localhost\r\nOrigin: http://evil.example\r\n");
                status(&self.request("POST", &(origin + "Content-Length: 0\r\n"))) == 403
            },
            status(&self.request("GET", local)) == 401,
            has_headers,
            has_problems,
        ];
        let cells = cells.map(|is_true| if is_true { "yes" } else { "–" });
        format!("| {} | {} |", self.name, cells.join(" | "))
    }
}

pub(crate) fn status(answer: &str) -> u16 {
    let code = answer.split(' ').nth(1);
    code.and_then(|code| code.parse().ok()).unwrap_or_default()
}

fn free_address() -> SocketAddr {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    listener.local_addr().unwrap()
}

/// Starts `lookdown count` for a server that does not run.
pub(crate) fn start_count(
    folder: &Path,
    key_file: Option<PathBuf>,
) -> (SocketAddr, JoinHandle<()>) {
    let address = free_address();
    let entry = CountEntry {
        server: nowhere(),
        listen: Some(address),
        api_key_file: key_file,
        store: folder.join("counts.sqlite"),
        ..CountEntry::default()
    };
    let options = entry.check().unwrap();
    let (snapshots, _receiver) = watch::channel(Snapshot::default());
    let task = tokio::spawn(async move {
        let never = std::future::pending();
        let counting = lookdown_count::count(&options, snapshots, |_| {}, never);
        counting.await.unwrap();
    });
    (address, task)
}

/// Starts the metrics of `lookdown watch` for a server that does not run.
fn start_watch(folder: &Path) -> (SocketAddr, JoinHandle<()>) {
    let address = free_address();
    let camera = CameraEntry {
        name: Some("hall".to_owned()),
        url: Some(folder.display().to_string()),
        ..CameraEntry::default()
    };
    let camera = camera.check("").unwrap();
    let options = WatchOptions::new(nowhere().check().unwrap(), vec![camera]).unwrap();
    let origin = lookdown_watch::Origin::Fixed(options);
    let task = tokio::spawn(async move {
        let metrics = Arc::new(Metrics::new().unwrap());
        let listener = tokio::net::TcpListener::bind(address).await.unwrap();
        let watching = lookdown_watch::watch(origin, Arc::clone(&metrics), std::future::pending());
        let (watched, ()) = tokio::join!(watching, serve_metrics(listener, metrics));
        watched.unwrap();
    });
    (address, task)
}

fn nowhere() -> ServerEntry {
    ServerEntry {
        url: Some("http://127.0.0.1:9".to_owned()),
        ..ServerEntry::default()
    }
}

pub(crate) async fn accepts(address: SocketAddr) {
    let connected = async {
        while TcpStream::connect(address).is_err() {
            sleep(Duration::from_millis(20)).await;
        }
    };
    timeout(TIMEOUT, connected).await.unwrap();
}

#[tokio::test(flavor = "multi_thread", worker_threads = 4)]
async fn each_listener_has_the_protections_of_the_table() {
    let server = Server::start(&[
        ("SERVER__METRICS_LISTEN", "127.0.0.1:0"),
        ("SERVER__MAX_CONNECTIONS", "64"),
    ])
    .await;
    let folders: [TempDir; 3] = std::array::from_fn(|_| tempfile::tempdir().unwrap());
    let key_file = folders[1].path().join("key");
    fs::write(&key_file, KEY).unwrap();
    let (count, count_task) = start_count(folders[0].path(), None);
    let (guarded, guarded_task) = start_count(folders[1].path(), Some(key_file));
    let (watched, watch_task) = start_watch(folders[2].path());
    let listener = |name, address, path, key| Listener {
        name,
        address,
        path,
        key,
    };
    let listeners = [
        listener("`lookdown serve`", server.address, "/calibrations", None),
        listener(
            "`server.metrics_listen`",
            server.metrics_address,
            "/metrics",
            None,
        ),
        listener("`lookdown count`", count, "/counts", None),
        listener("`lookdown count` with a key", guarded, "/counts", Some(KEY)),
        listener(
            "`lookdown watch --metrics-listen`",
            watched,
            "/metrics",
            None,
        ),
    ];
    let mut rows = Vec::new();
    for listener in listeners {
        accepts(listener.address).await;
        rows.push(spawn_blocking(move || listener.row()).await.unwrap());
    }
    for task in [count_task, guarded_task, watch_task] {
        assert!(!task.is_finished());
        task.abort();
    }
    let document = fs::read_to_string("SECURITY.md").unwrap();
    let missing: Vec<_> = rows.iter().filter(|row| !document.contains(*row)).collect();
    assert!(
        missing.is_empty(),
        "SECURITY.md has other rows than\n{}",
        rows.join("\n")
    );
}
