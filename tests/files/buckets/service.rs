//! The process of Lookdown with its calibrations in a bucket.

use std::{
    io::{BufRead, BufReader, Read, Write},
    net::{SocketAddr, TcpStream},
    process::{Child, ChildStderr, Command, Stdio},
    sync::{Arc, Mutex},
    thread::{self, JoinHandle},
    time::{Duration, Instant},
};

use crate::{buckets::s3_server::variables, models::folder::fixture};

const TIMEOUT: Duration = Duration::from_mins(1);
/// Pause between two looks.
const POLL: Duration = Duration::from_millis(20);

/// A server that polls `s3://cameras/ceiling` every second.
pub(crate) struct Service {
    process: Child,
    address: SocketAddr,
    log: Arc<Mutex<String>>,
    reader: Option<JoinHandle<()>>,
}

/// The command that starts it.
pub(crate) fn command(s3: SocketAddr) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_lookdown"));
    command
        .arg("serve")
        .envs(variables(s3))
        .env("LOOKDOWN__SERVER__LISTEN", "127.0.0.1:0")
        .env("LOOKDOWN__CALIBRATIONS__PATH", "s3://cameras/ceiling")
        .env("LOOKDOWN__CALIBRATIONS__POLL_SECONDS", "1")
        // Loads at once: no test of this server sends frames.
        .env("LOOKDOWN__MODEL__PATH", fixture("any_batch"))
        .env("LOOKDOWN__INFERENCE__THREADS", "1")
        .stdin(Stdio::null())
        .stderr(Stdio::piped());
    command
}

impl Service {
    /// Starts a server and waits until its `/readyz` answers 200.
    pub(crate) fn start(s3: SocketAddr) -> Self {
        let mut process = command(s3).spawn().unwrap();
        let mut lines = BufReader::new(process.stderr.take().unwrap());
        let mut log = String::new();
        let address = loop {
            assert!(
                lines.read_line(&mut log).unwrap() > 0,
                "it does not start: {log}"
            );
            if let Some((_, rest)) = log.split_once("http://") {
                break rest.split(',').next().unwrap().parse().unwrap();
            }
        };
        let log = Arc::new(Mutex::new(log));
        let reader = Some(follow(lines, Arc::clone(&log)));
        let service = Self {
            process,
            address,
            log,
            reader,
        };
        service.wait_for("/readyz", |answer| answer.starts_with("HTTP/1.1 200"));
        service
    }

    /// Returns the complete response to a request.
    pub(crate) fn send(&self, method: &str, path: &str, header: &str, body: &str) -> String {
        let mut connection = TcpStream::connect(self.address).unwrap();
        let length = body.len();
        write!(
            connection,
            "{method} {path} HTTP/1.1\r\nHost: lookdown\r\nConnection: close\r\n{header}\
             Content-Length: {length}\r\n\r\n{body}"
        )
        .unwrap();
        let mut answer = String::new();
        connection.read_to_string(&mut answer).unwrap();
        answer
    }

    pub(crate) fn get(&self, path: &str) -> String {
        self.send("GET", path, "", "")
    }

    /// Waits for the first response for which `is_right` returns true.
    pub(crate) fn wait_for(&self, path: &str, is_right: impl Fn(&str) -> bool) -> String {
        let begun = Instant::now();
        loop {
            let answer = self.get(path);
            if is_right(&answer) {
                return answer;
            }
            assert!(begun.elapsed() < TIMEOUT, "still {answer}; {}", self.log());
            thread::sleep(POLL);
        }
    }

    /// Returns the log once it contains this text.
    pub(crate) fn log_with(&self, expected: &str) -> String {
        let begun = Instant::now();
        loop {
            let log = self.log();
            if log.contains(expected) {
                return log;
            }
            assert!(begun.elapsed() < TIMEOUT, "no {expected:?} in {log}");
            thread::sleep(POLL);
        }
    }

    pub(crate) fn log(&self) -> String {
        self.log.lock().unwrap().clone()
    }
}

/// Collects the log, so that the server never blocks on a full pipe.
fn follow(lines: BufReader<ChildStderr>, log: Arc<Mutex<String>>) -> JoinHandle<()> {
    let thread = thread::Builder::new().name("log".to_owned());
    let follow = move || {
        for line in lines.lines().map_while(Result::ok) {
            *log.lock().unwrap() += &(line + "\n");
        }
    };
    thread.spawn(follow).unwrap()
}

impl Drop for Service {
    fn drop(&mut self) {
        // It may have ended already.
        let _ = self.process.kill();
        let _ = self.process.wait();
        if let Some(reader) = self.reader.take() {
            let _ = reader.join();
        }
    }
}
