//! `lookdown run`: a server, cameras and counts in one process.

use std::{
    fs,
    io::{BufRead, BufReader, Read, Write},
    net::{TcpListener, TcpStream},
    path::Path,
    process::{Child, Command, Stdio},
    thread,
    time::{Duration, Instant},
};

use super::{assert_fails_with, lookdown};

const KEY: &str = "lookdown_0123456789abcdef";
/// SHA-256 of [`KEY`].
const KEY_DIGEST: &str = "5800568aa3f1d98c8b4ed0c70daf01517134d48b8a9392e61ae22301e0c65945";
/// Longest wait for a condition.
const TIMEOUT: Duration = Duration::from_mins(1);
/// Interval of the checks of a condition.
const CHECK: Duration = Duration::from_millis(100);

/// A running process.
struct Running {
    process: Child,
    address: String,
    log: Option<thread::JoinHandle<Vec<String>>>,
}

impl Drop for Running {
    fn drop(&mut self) {
        // It still runs only if a test has failed.
        let _ = self.process.kill();
    }
}

impl Running {
    fn start(arguments: &[&str], variables: &[(&str, &str)]) -> Self {
        let mut process = Command::new(env!("CARGO_BIN_EXE_lookdown"))
            .args(arguments)
            .args(["--listen", "127.0.0.1:0"])
            .env("LOOKDOWN__SHUTDOWN__GRACE_MILLIS", "0")
            .envs(variables.iter().copied())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let mut lines = BufReader::new(process.stderr.take().unwrap()).lines();
        let address = lines.by_ref().map_while(Result::ok).find_map(|line| {
            let (_, rest) = line.split_once("listening on http://")?;
            Some(rest.split_once(',')?.0.to_owned())
        });
        let log = thread::Builder::new().name("log".to_owned());
        Self {
            process,
            address: address.unwrap(),
            log: Some(
                log.spawn(move || lines.map_while(Result::ok).collect())
                    .unwrap(),
            ),
        }
    }

    /// Sends a request with a JSON body, and returns the response.
    fn ask(&self, request: &str, body: &str) -> String {
        let length = body.len();
        let head = format!(
            "{request} HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\
             Content-Type: application/json\r\nContent-Length: {length}\r\n\r\n{body}"
        );
        let mut connection = TcpStream::connect(&self.address).unwrap();
        connection.write_all(head.as_bytes()).unwrap();
        let mut answer = String::new();
        connection.read_to_string(&mut answer).unwrap();
        answer
    }

    /// Sends a GET request with these header lines, and returns the response.
    fn get(&self, path: &str, headers: &str) -> String {
        let head =
            format!("GET {path} HTTP/1.1\r\nHost: lookdown\r\nConnection: close\r\n{headers}\r\n");
        let mut connection = TcpStream::connect(&self.address).unwrap();
        connection.write_all(head.as_bytes()).unwrap();
        let mut answer = Vec::new();
        connection.read_to_end(&mut answer).unwrap();
        String::from_utf8_lossy(&answer).into_owned()
    }

    /// Waits until the response has this part, and returns it. `act` is called before each request.
    #[track_caller]
    fn until(&self, path: &str, headers: &str, part: &str, mut act: impl FnMut()) -> String {
        let started = Instant::now();
        loop {
            act();
            let answer = self.get(path, headers);
            if answer.contains(part) {
                return answer;
            }
            assert!(
                started.elapsed() < TIMEOUT,
                "{path}: no {part:?} in {answer}"
            );
            thread::sleep(CHECK);
        }
    }

    /// Ends the process at once, as `kill -9` and a loss of power do.
    fn kill(mut self) {
        self.process.kill().unwrap();
        self.process.wait().unwrap();
    }

    /// Ends the process as Ctrl-C does, and returns the rest of the log.
    fn interrupt(mut self) -> Vec<String> {
        let kill = format!("kill -INT {}", self.process.id());
        assert!(
            Command::new("sh")
                .args(["-c", &kill])
                .status()
                .unwrap()
                .success()
        );
        let ended = self.process.wait().unwrap();
        let log = self.log.take().unwrap().join().unwrap();
        assert!(ended.success(), "{log:?}");
        log
    }
}

/// Drops frames into a folder.
fn drop_frames(folder: &Path) -> impl FnMut() {
    let office = Path::new(env!("CARGO_MANIFEST_DIR")).join("samples/office.jpg");
    let folder = folder.to_owned();
    let mut number = 0;
    move || {
        number += 1;
        let hidden = folder.join(".office.part");
        fs::copy(&office, &hidden).unwrap();
        fs::rename(hidden, folder.join(format!("{number}.jpg"))).unwrap();
    }
}

#[test]
fn a_camera_is_counted_on_the_port_of_the_server() {
    let folder = tempfile::tempdir().unwrap();
    let frames = folder.path().join("frames");
    fs::create_dir(&frames).unwrap();
    let (source, store) = (
        frames.to_str().unwrap(),
        folder.path().join("counts.sqlite"),
    );
    let keys = format!("me:read:{KEY_DIGEST}");
    let arguments = [
        "run",
        source,
        "--name",
        "hall",
        "--every",
        "200ms",
        "--profile",
        "fast",
        "--store",
        store.to_str().unwrap(),
    ];
    let running = Running::start(&arguments, &[("LOOKDOWN__ACCESS__KEYS", &keys)]);
    let key = format!("X-API-Key: {KEY}\r\n");
    let counted = "lookdown_count_last_report_timestamp_seconds{camera=\"hall\"}";
    let metrics = running.until("/metrics", &key, counted, drop_frames(&frames));
    for metric in ["watch_frames_sent_total", "camera_persons"] {
        assert!(metrics.contains(&format!("lookdown_{metric}{{camera=\"hall\"}}")));
    }
    let counts = running.get("/counts", &key);
    assert!(counts.contains("\"name\":\"hall\""), "{counts}");
    assert!(counts.starts_with("HTTP/1.1 200 "), "{counts}");
    let past = "/counts/hall?from=2026-01-01T00:00:00Z&to=2026-01-02T00:00:00Z";
    let counts = running.get(past, &key);
    let tag = counts.lines().find(|line| line.starts_with("etag: "));
    let known = tag.unwrap().replace("etag", "If-None-Match");
    let unmodified = running.get(past, &format!("{key}{known}\r\n"));
    assert!(unmodified.starts_with("HTTP/1.1 304 "), "{unmodified}");
    let refused = running.get("/counts", "");
    assert!(refused.starts_with("HTTP/1.1 401 "), "{refused}");
    let unknown = running.get("/counts/gate", &key);
    assert!(unknown.starts_with("HTTP/1.1 404 "), "{unknown}");
    assert!(unknown.contains("/problems/not-found"), "{unknown}");
    let page = running.get("/assets/options.json", "");
    assert!(page.contains("\"has_counts\":true"), "{page}");
    let log = running.interrupt().join("\n");
    assert!(
        !log.contains("status=503") && !log.contains("ended the stream"),
        "{log}"
    );
    assert!(store.exists());
}

#[test]
fn a_variable_has_the_source_of_a_camera() {
    let folder = tempfile::tempdir().unwrap();
    let frames = folder.path().join("frames");
    fs::create_dir(&frames).unwrap();
    let store = folder.path().join("counts.sqlite");
    let arguments = ["run", "--every", "200ms", "--profile", "fast", "--store"];
    let arguments = [&arguments[..], &[store.to_str().unwrap()]].concat();
    let calibrations = folder.path().join("calibrations");
    let variables = [
        ("LOOKDOWN_CAMERA", frames.to_str().unwrap()),
        (
            "LOOKDOWN__CALIBRATIONS__PATH",
            calibrations.to_str().unwrap(),
        ),
    ];
    let running = Running::start(&arguments, &variables);
    running.until("/counts", "", "\"camera\"", drop_frames(&frames));
    // As in a new volume.
    assert!(calibrations.is_dir());
    running.interrupt();
    // Without a camera, flags of a camera are refused, as without the variable.
    let refused = lookdown(&arguments, &[("LOOKDOWN_CAMERA", "")]);
    assert_fails_with(&refused, &["flags of a single camera need a source"]);
}

#[test]
fn cameras_of_the_settings_file_are_counted() {
    let folder = tempfile::tempdir().unwrap();
    let frames = folder.path().join("frames");
    fs::create_dir(&frames).unwrap();
    let settings = folder.path().join("lookdown.toml");
    let text = format!(
        "[counts]\npath = {store:?}\n[camera_defaults]\nprofile = \"fast\"\nevery = \"200ms\"\n\
         [[cameras]]\nname = \"hall\"\nurl = {frames:?}\n",
        store = folder.path().join("counts.sqlite"),
    );
    fs::write(&settings, &text).unwrap();
    let running = Running::start(&["run", settings.to_str().unwrap()], &[]);
    running.until("/counts", "", "\"hall\"", drop_frames(&frames));
    // A camera that is added to the file is watched without a restart.
    let text = format!("{text}[[cameras]]\nname = \"gate\"\nurl = {frames:?}\n");
    fs::write(&settings, text).unwrap();
    running.until("/counts", "", "\"gate\"", drop_frames(&frames));
    running.interrupt();
}

#[test]
fn paused_and_removed_cameras_leave_results_and_metrics() {
    let folder = tempfile::tempdir().unwrap();
    let [frames, state] = ["frames", "state"].map(|name| folder.path().join(name));
    fs::create_dir(&frames).unwrap();
    let settings = folder.path().join("lookdown.toml");
    let counts = format!(
        "[counts]\npath = {:?}\n",
        folder.path().join("counts.sqlite")
    );
    let camera = "[[cameras]]\nname = \"hall\"\nprofile = \"fast\"\nevery = \"200ms\"\n";
    fs::write(&settings, format!("{counts}{camera}url = {frames:?}\n")).unwrap();
    let arguments = ["run", settings.to_str().unwrap()];
    let variables = [("LOOKDOWN__STATE__PATH", state.to_str().unwrap())];
    let running = Running::start(&arguments, &variables);
    let counted = "lookdown_count_last_report_timestamp_seconds{camera=\"hall\"}";
    running.until("/counts", "", "\"hall\"", drop_frames(&frames));
    let metrics = running.ask("GET /metrics", "");
    assert!(metrics.contains(counted), "{metrics}");
    running.ask("PATCH /cameras/hall", r#"{"paused": true}"#);
    let paused =
        r#""persons":null,"persons_low":null,"persons_high":null,"persons_source":"paused""#;
    running.until("/results", "", paused, || {});
    let metrics = running.ask("GET /metrics", "");
    assert!(!metrics.contains(counted), "{metrics}");
    running.interrupt();

    // Without the camera in the settings, only the counts know it.
    fs::write(&settings, &counts).unwrap();
    let running = Running::start(&arguments, &variables);
    running.until("/counts", "", "\"hall\"", || {});
    for (request, counts) in [
        ("DELETE /results/hall", "\"known_seconds\""),
        ("DELETE /counts/hall", "404 Not Found"),
    ] {
        let deleted = running.ask(request, "");
        assert!(deleted.starts_with("HTTP/1.1 204 "), "{deleted}");
        let metrics = running.ask("GET /metrics", "");
        assert!(!metrics.contains(counted), "{metrics}");
        let shown = running.get("/counts/hall", "");
        assert!(shown.contains(counts), "{request}: {shown}");
    }
    let unknown = running.ask("DELETE /results/hall", "");
    assert!(unknown.starts_with("HTTP/1.1 404 "), "{unknown}");
    running.interrupt();
}

#[test]
fn a_check_of_run_tests_cameras_and_serves_no_client() {
    let folder = tempfile::tempdir().unwrap();
    let settings = folder.path().join("lookdown.toml");
    let start = format!(
        "[server]\nlisten = \"127.0.0.1:0\"\n[calibrations]\npath = {:?}\n",
        folder.path().join("calibrations"),
    );
    let check = |text: &str| {
        fs::write(&settings, format!("{start}{text}")).unwrap();
        lookdown(&["run", settings.to_str().unwrap(), "--check"], &[])
    };
    let output = check("[[cameras]]\nname = \"hall\"\nurl = \"rtsp://10.0.0.8/\"\n");
    let said = String::from_utf8(output.stdout).unwrap();
    assert!(said.starts_with("ready to serve on"), "{said}");
    assert!(said.ends_with("\ncameras of the settings: 1\n"), "{said}");
    for (text, parts) in [
        ("[[cameras]]\nname = \"hall\"\n", ["url", "missing"]),
        (
            "[camera]\nname = \"hall\"\n",
            ["`camera`", "use one of `[[cameras]]`"],
        ),
    ] {
        assert_fails_with(&check(text), &parts);
    }
}

#[test]
fn it_runs_without_certificates_of_authorities() {
    let folder = tempfile::tempdir().unwrap();
    let variables = [
        ("SSL_CERT_FILE", "/dev/null"),
        ("SSL_CERT_DIR", folder.path().to_str().unwrap()),
    ];
    let store = folder.path().join("counts.sqlite");
    let running = Running::start(&["run", "--store", store.to_str().unwrap()], &variables);
    running.until("/counts", "", "200 OK", || ());
    running.interrupt();
}

#[test]
fn a_camera_that_is_added_is_there_after_a_kill() {
    let folder = tempfile::tempdir().unwrap();
    let state = folder.path().join("state");
    let store = folder.path().join("counts.sqlite");
    let variables = [
        ("LOOKDOWN__STATE__PATH", state.to_str().unwrap()),
        ("LOOKDOWN__COUNTS__PATH", store.to_str().unwrap()),
    ];
    // Nothing listens there.
    let unused = TcpListener::bind("127.0.0.1:0").unwrap();
    let source = format!("http://{}/snapshot.jpg", unused.local_addr().unwrap());
    drop(unused);
    let body = format!(r#"{{"url": "{source}", "user": "viewer", "password": "geheim"}}"#);
    let running = Running::start(&["run"], &variables);
    let added = running.ask("PUT /cameras/hall", &body);
    assert!(added.starts_with("HTTP/1.1 201 "), "{added}");
    let refused = running.ask("PUT /cameras/gate", r#"{"url": "file:///etc/passwd"}"#);
    assert!(refused.starts_with("HTTP/1.1 422 "), "{refused}");
    let tested = running.ask("POST /cameras/test", &body);
    assert!(tested.contains("the camera cannot be reached"), "{tested}");
    // The answer was sent after the camera was stored.
    running.kill();

    let running = Running::start(&["run"], &variables);
    let cameras = running.until("/cameras", "", "cannot be reached", || {});
    assert!(
        cameras.contains(&source) && !cameras.contains("geheim"),
        "{cameras}"
    );
    let still = running.ask("GET /cameras/hall/frame.jpg", "");
    assert!(still.contains("the camera cannot be reached"), "{still}");
    let replaced = running.ask("PUT /cameras/hall", r#"{"user": "viewer", "paused": true}"#);
    assert!(replaced.starts_with("HTTP/1.1 204 "), "{replaced}");
    let paused = running.until("/cameras/hall", "", "\"paused\":true", || {});
    assert!(paused.contains(&source), "{paused}");
    let deleted = running.ask("DELETE /cameras/hall", "");
    assert!(deleted.starts_with("HTTP/1.1 204 "), "{deleted}");
    assert!(
        running
            .get("/cameras/hall", "")
            .starts_with("HTTP/1.1 404 ")
    );
    running.interrupt();
}

#[test]
fn settings_of_several_processes_are_refused() {
    for (key, value, parts) in [
        (
            "LOOKDOWN__RESULTS__URL",
            "redis://127.0.0.1:1",
            ["results.url", "lookdown serve", "one `lookdown count`"],
        ),
        (
            "LOOKDOWN__COUNTS__URL",
            "http://127.0.0.1:1",
            ["counts.url", "own process", "lookdown serve"],
        ),
    ] {
        assert_fails_with(&lookdown(&["run"], &[(key, value)]), &parts);
    }
}

#[test]
fn a_server_forwards_counts_with_the_key_of_the_other_host() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let url = format!("http://{}", listener.local_addr().unwrap());
    let answering = move || {
        loop {
            let (mut connection, _) = listener.accept().unwrap();
            let lines = BufReader::new(connection.try_clone().unwrap()).lines();
            let head: Vec<_> = lines
                .map(Result::unwrap)
                .take_while(|line| !line.is_empty())
                .collect();
            let answer = "HTTP/1.1 200 OK\r\ncontent-type: text/csv\r\ncontent-length: 5\r\n\
                connection: close\r\n\r\na,b\r\n";
            connection.write_all(answer.as_bytes()).unwrap();
            // The server asks for the numbers of persons, too.
            if head[0].starts_with("GET /counts/hall") {
                return head.join("\n");
            }
        }
    };
    let other = thread::Builder::new().name("other".to_owned());
    let other = other.spawn(answering).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let key_file = folder.path().join("counts.key");
    fs::write(&key_file, "0123456789abcdef0123\n").unwrap();
    let keys = format!("me:read:{KEY_DIGEST}");
    let running = Running::start(
        &["serve"],
        &[
            ("LOOKDOWN__ACCESS__KEYS", &keys),
            ("LOOKDOWN__COUNTS__URL", &url),
            ("LOOKDOWN__COUNTS__API_KEY_FILE", key_file.to_str().unwrap()),
        ],
    );
    assert!(running.get("/counts", "").starts_with("HTTP/1.1 401 "));
    let key = format!("X-API-Key: {KEY}\r\nAccept: text/csv\r\n");
    let answer = running.get("/counts/hall?step=1h", &key);
    assert!(answer.ends_with("\r\n\r\na,b\r\n"), "{answer}");
    let head = other.join().unwrap();
    assert!(
        head.starts_with("GET /counts/hall?step=1h HTTP/1.1"),
        "{head}"
    );
    assert!(
        head.contains("authorization: Bearer 0123456789abcdef0123"),
        "{head}"
    );
    assert!(
        head.contains("accept: text/csv") && !head.contains(KEY),
        "{head}"
    );
    let gone = running.get("/counts", &key);
    assert!(
        gone.starts_with("HTTP/1.1 503 ") && gone.contains("counts-unavailable"),
        "{gone}"
    );
    running.interrupt();
}

#[test]
fn settings_of_another_format_are_no_source_of_frames() {
    for command in ["run", "watch"] {
        let output = lookdown(&[command, "cameras.yaml"], &[]);
        assert_fails_with(
            &output,
            &["cameras.yaml", "not a source of frames", ".toml"],
        );
    }
}
