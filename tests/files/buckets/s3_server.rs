//! The S3 server as a process.

use std::{
    fs::File,
    io::{Read, Write},
    net::{SocketAddr, TcpStream},
    path::Path,
    process::{Child, Command, Stdio},
    time::{Duration, Instant},
};

use lookdown::calibration_store::{BucketStore, CalibrationStore, Replaces};
use tempfile::TempDir;

/// Must never appear in any output.
pub(crate) const SECRET: &str = "kept-to-itself-7f3a";
const TIMEOUT: Duration = Duration::from_mins(1);

/// A server with the bucket `cameras`. Its log lists the requests.
pub(crate) struct S3Server {
    process: Child,
    pub(crate) address: SocketAddr,
    folder: TempDir,
}

impl S3Server {
    pub(crate) fn start() -> Self {
        Self::at("127.0.0.1:0".parse().unwrap())
    }

    /// Starts a new, empty server on the address of one that was stopped.
    pub(crate) fn at(address: SocketAddr) -> Self {
        let program = Path::new(env!("CARGO_MANIFEST_DIR")).join(".setup/venv/bin/moto_server");
        assert!(
            program.exists(),
            "run `make test` or `scripts/setup.py s3-server` first"
        );
        let folder = tempfile::tempdir().unwrap();
        let log = File::create(folder.path().join("log")).unwrap();
        let process = Command::new(program)
            .args(["-H", "127.0.0.1", "-p", &address.port().to_string()])
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(log)
            .spawn()
            .unwrap();
        let mut server = Self {
            process,
            address,
            folder,
        };
        let begun = Instant::now();
        let address = loop {
            let log = server.log();
            if let Some((_, rest)) = log.split_once("Running on http://")
                && let Some((address, _)) = rest.split_once('\n')
            {
                break address.trim().parse().unwrap();
            }
            assert!(
                begun.elapsed() < TIMEOUT,
                "the S3 server does not start: {log}"
            );
            assert_eq!(server.process.try_wait().unwrap(), None, "{log}");
            std::thread::yield_now();
        };
        server.address = address;
        server.make_bucket();
        server
    }

    fn make_bucket(&self) {
        let mut connection = TcpStream::connect(self.address).unwrap();
        let request = "PUT /cameras HTTP/1.1\r\nHost: s3\r\nConnection: close\r\n\
                       Content-Length: 0\r\n\r\n";
        connection.write_all(request.as_bytes()).unwrap();
        let mut answer = String::new();
        connection.read_to_string(&mut answer).unwrap();
        assert!(answer.starts_with("HTTP/1.1 200"), "{answer}");
    }

    pub(crate) fn log(&self) -> String {
        std::fs::read_to_string(self.folder.path().join("log")).unwrap()
    }

    /// The store at the prefix `ceiling` of its bucket.
    pub(crate) fn store(&self) -> BucketStore {
        store("s3://cameras/ceiling", self.address)
    }

    /// Writes an object as another client would.
    pub(crate) fn put(&self, name: &str, content: &str) {
        let store = self.store();
        store
            .write(name, content.as_bytes(), Replaces::Anything)
            .unwrap();
    }
}

impl Drop for S3Server {
    fn drop(&mut self) {
        // It may have ended already.
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

/// The provider's variables for the server at `address`.
pub(crate) fn variables(address: SocketAddr) -> Vec<(String, String)> {
    let endpoint = format!("http://{address}");
    [
        ("AWS_ENDPOINT", &*endpoint),
        ("AWS_ALLOW_HTTP", "true"),
        ("AWS_ACCESS_KEY_ID", "lookdown"),
        ("AWS_SECRET_ACCESS_KEY", SECRET),
    ]
    .map(|(name, value)| (name.to_owned(), value.to_owned()))
    .to_vec()
}

pub(crate) fn store(url: &str, address: SocketAddr) -> BucketStore {
    BucketStore::new(&url.parse().unwrap(), variables(address).into_iter()).unwrap()
}
