//! `lookdown serve` as a process: the errors at its start, and its shutdown.

use std::{
    fs,
    io::{BufRead, BufReader, Lines, Read, Write},
    net::{TcpListener, TcpStream},
    path::Path,
    process::{Child, ChildStderr, Command, Output, Stdio},
};

use crate::SMALL_MODEL;

const LOOKDOWN: &str = env!("CARGO_BIN_EXE_lookdown");
const FREE_ADDRESS: (&str, &str) = ("LOOKDOWN__SERVER__LISTEN", "127.0.0.1:0");
pub(super) const NO_GRACE: (&str, &str) = ("LOOKDOWN__SHUTDOWN__GRACE_MILLIS", "0");
const LONG_GRACE: (&str, &str) = ("LOOKDOWN__SHUTDOWN__GRACE_MILLIS", "600000");

fn run(arguments: &[&str], environment: &[(&str, &str)]) -> Output {
    Command::new(LOOKDOWN)
        .args(arguments)
        // The log may hold more about the same error, for example of a model that cannot be loaded.
        .envs([FREE_ADDRESS, ("LOOKDOWN__LOG__FILTER", "off")])
        .envs(environment.iter().copied())
        .output()
        .unwrap()
}

/// The error sentence of the start. There must be no other output.
#[track_caller]
fn refusal(output: &Output) -> String {
    let message = String::from_utf8(output.stderr.clone()).unwrap();
    assert_eq!(output.status.code(), Some(1), "{message}");
    assert!(output.stdout.is_empty(), "{output:?}");
    assert_eq!(message.lines().count(), 1, "{message}");
    message
}

#[test]
fn every_invalid_setting_ends_the_start_with_a_sentence() {
    let taken = TcpListener::bind("127.0.0.1:0").unwrap();
    let taken = taken.local_addr().unwrap().to_string();
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let text = path("notes.txt");
    fs::write(&text, "nothing of use").unwrap();
    let other_sum = path("other_sum");
    fs::create_dir(&other_sum).unwrap();
    let fixture = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/models/pairs.onnx");
    fs::copy(fixture, Path::new(&other_sum).join("model.onnx")).unwrap();
    let manifest = format!(
        "name = \"other_sum\"\nonnx = \"model.onnx\"\nsha256 = \"{}\"\n",
        "0".repeat(64)
    );
    fs::write(Path::new(&other_sum).join("model.toml"), manifest).unwrap();

    let cases: [(&str, &str, &[&str]); 18] = [
        ("SERVER__LISTN", "127.0.0.1:1", &["server", "`listn`"]),
        (
            "SERVER__LISTEN",
            "localhost",
            &["server.listen", "127.0.0.1:8080"],
        ),
        (
            "SERVER__LISTEN",
            &taken,
            &["server.listen", &taken, "in use"],
        ),
        (
            "SERVER__LISTEN",
            "192.0.2.1:80",
            &["server.listen", "192.0.2.1:80"],
        ),
        (
            "SERVER__LISTEN",
            "0.0.0.0:0",
            &["0.0.0.0:0", "access.keys_file", "access.open"],
        ),
        (
            "SERVER__METRICS_LISTEN",
            &taken,
            &["server.metrics_listen", &taken, "in use"],
        ),
        (
            "SERVER__MAX_CONNECTIONS",
            "0",
            &["server.max_connections", "from 1"],
        ),
        (
            "CALIBRATIONS__PATH",
            "/nowhere",
            &["calibrations.path", "/nowhere"],
        ),
        ("CALIBRATIONS__PATH", &text, &["calibrations.path", &text]),
        (
            "ACCESS__KEYS_FILE",
            "/nowhere",
            &["access.keys_file", "/nowhere"],
        ),
        ("ACCESS__KEYS_FILE", &text, &["access.keys_file", &text]),
        (
            "INFERENCE__LIBRARY_PATH",
            "/nowhere.so",
            &["inference.library_path", "make setup"],
        ),
        (
            "INFERENCE__LIBRARY_PATH",
            &text,
            &["inference.library_path", &text],
        ),
        ("MODEL__PATH", "/nowhere", &["model.path", "/nowhere"]),
        ("MODEL__PATH", &text, &[&text]),
        (
            "MODEL__PATH",
            &other_sum,
            &["other_sum", "SHA-256", "fetch it again"],
        ),
        (
            "MODEL__REPOSITORY",
            "/nowhere",
            &["model.repository", "LOOKDOWN__MODEL__REPOSITORY"],
        ),
        ("MODEL__ALSO_LOAD", "no_such_model", &["no_such_model"]),
    ];
    for (variable, value, parts) in cases {
        let variable = format!("LOOKDOWN__{variable}");
        for arguments in [&["serve"][..], &["serve", "--check"]] {
            let message = refusal(&run(arguments, &[(&variable, value)]));
            for part in parts {
                assert!(
                    message.contains(part),
                    "{variable}: {message:?} lacks {part:?}"
                );
            }
        }
    }
    let message = refusal(&run(&["serve", "--config", "/nowhere.toml"], &[]));
    assert!(
        message.contains("/nowhere.toml") && message.contains("--config"),
        "{message}"
    );
}

#[test]
fn a_check_reports_models_and_access_and_serves_no_client() {
    let address = TcpListener::bind("127.0.0.1:0")
        .unwrap()
        .local_addr()
        .unwrap();
    let listen = address.to_string();
    let check = |variables: &[(&str, &str)]| {
        let mut variables = variables.to_vec();
        variables.push(("LOOKDOWN__SERVER__LISTEN", &listen));
        let output = run(&["serve", "--check"], &variables);
        assert!(output.status.success(), "{output:?}");
        assert!(output.stderr.is_empty(), "{output:?}");
        String::from_utf8(output.stdout).unwrap()
    };
    let open = check(&[]);
    assert!(
        open.starts_with(&format!("ready to serve on {listen}: ")),
        "{open}"
    );
    assert!(open.contains("nanodet_g_views_416"), "{open}");
    assert!(open.contains("access: open, without API keys"), "{open}");
    let keys = format!(
        "gate:detect+read:{:064},alarm:detect:{:064}:1,batch:admin:{:064}:8,dash:read:{:064}",
        7, 8, 9, 10
    );
    let keyed = check(&[("LOOKDOWN__ACCESS__KEYS", &keys)]);
    let expected = format!(
        "access: {listen} needs an API key; 4 known\n  gate: detect, read; priorities 4 to 9\n  \
         alarm: detect; priorities 1 to 9\n  batch: admin; priorities 7 to 9\n  dash: read\n"
    );
    assert!(keyed.contains(&expected), "{keyed}");
}

#[test]
fn only_keys_or_access_open_let_a_server_start_on_a_network() {
    const NETWORK: (&str, &str) = ("LOOKDOWN__SERVER__LISTEN", "0.0.0.0:0");
    const OPEN: (&str, &str) = ("LOOKDOWN__ACCESS__OPEN", "true");
    let check = |variables: &[(&str, &str)]| {
        let output = run(&["serve", "--check"], variables);
        assert!(output.status.success(), "{output:?}");
        String::from_utf8(output.stdout).unwrap()
    };
    let open = check(&[NETWORK, OPEN]);
    assert!(
        open.contains("access: open (access.open), without API keys"),
        "{open}"
    );
    assert!(open.contains("changes are refused"), "{open}");
    let keys = format!("gate:detect+read:{:064}", 7);
    let keys = ("LOOKDOWN__ACCESS__KEYS", &*keys);
    // With keys, `access.open` has no effect.
    for variables in [&[NETWORK, keys][..], &[NETWORK, keys, OPEN]] {
        let keyed = check(variables);
        assert!(keyed.contains("needs an API key; 1 known"), "{keyed}");
    }
    // The address of metrics and probes needs neither.
    check(&[("LOOKDOWN__SERVER__METRICS_LISTEN", "0.0.0.0:0")]);
}

#[test]
fn an_open_server_refuses_changes_and_warns_at_the_start() {
    let open = ("LOOKDOWN__ACCESS__OPEN", "true");
    let server = Server::start("", &[NO_GRACE, open]);
    assert!(server.get("/calibrations", "").contains(" 200 "));
    let refused = server.ask("DELETE /calibrations/lobby", "");
    assert!(
        refused.contains(" 403 ") && refused.contains("access.keys_file"),
        "{refused}"
    );
    let before = server.before_ready.join("\n");
    assert_eq!(before.matches("access.open is true").count(), 1, "{before}");
    server.signal("TERM");
    server.has_ended();
}

#[test]
fn a_server_without_keys_names_its_clients_at_the_start() {
    let server = Server::start("", &[NO_GRACE]);
    let before = server.before_ready.join("\n");
    for part in ["no API keys are set", "tunnel", "access.keys_file"] {
        assert_eq!(before.matches(part).count(), 1, "{part}: {before}");
    }
    server.signal("TERM");
    server.has_ended();
}

#[test]
fn freed_memory_is_returned_unless_the_operator_decides() {
    for given in [None, Some("65536")] {
        let mut environment = vec![NO_GRACE];
        environment.extend(given.map(|value| ("MALLOC_MMAP_THRESHOLD_", value)));
        let server = Server::start("", &environment);
        let environment = fs::read(format!("/proc/{}/environ", server.process.id())).unwrap();
        let expected = format!("MALLOC_MMAP_THRESHOLD_={}", given.unwrap_or("131072"));
        let mut variables = environment.split(|&byte| byte == 0);
        assert!(variables.any(|variable| variable == expected.as_bytes()));
        server.signal("TERM");
        server.has_ended();
    }
}

/// A running server.
pub(super) struct Server {
    process: Child,
    log: Lines<BufReader<ChildStderr>>,
    port: String,
    /// The log lines between the start to listen and readiness.
    before_ready: Vec<String>,
}

impl Server {
    /// Starts a server by a shell after `preparation`, and waits until it is ready.
    pub(super) fn start(preparation: &str, environment: &[(&str, &str)]) -> Self {
        let mut server = Self::listening(preparation, environment);
        server.becomes_ready();
        server
    }

    /// Starts a server by a shell after `preparation`, and waits until it listens.
    fn listening(preparation: &str, environment: &[(&str, &str)]) -> Self {
        let mut process = Command::new("sh")
            .args(["-c", &format!("{preparation}\nexec {LOOKDOWN} serve")])
            .envs([FREE_ADDRESS, SMALL_MODEL])
            .envs(environment.iter().copied())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let log = BufReader::new(process.stderr.take().unwrap()).lines();
        let mut server = Self {
            process,
            log,
            port: String::new(),
            before_ready: Vec::new(),
        };
        let line = server.says("listening on http");
        let (_, rest) = line.split_once("://127.0.0.1:").unwrap();
        rest.split_once(',').unwrap().0.clone_into(&mut server.port);
        server
    }

    /// Waits until the server is ready.
    fn becomes_ready(&mut self) {
        let lines = self.log.by_ref().map(Result::unwrap);
        self.before_ready = lines
            .take_while(|line| !line.contains("ready: the page is"))
            .collect();
    }

    /// The next log line that contains this text.
    fn says(&mut self, part: &str) -> String {
        let mut lines = self.log.by_ref().map(Result::unwrap);
        let line = lines.find(|line| line.contains(part));
        line.unwrap_or_else(|| panic!("the log does not say {part:?}"))
    }

    /// The address for clients.
    pub(super) fn address(&self) -> String {
        format!("http://127.0.0.1:{}", self.port)
    }

    fn connect(&self) -> TcpStream {
        TcpStream::connect(format!("127.0.0.1:{}", self.port)).unwrap()
    }

    /// Sends a GET request with these header lines, and returns the response.
    fn get(&self, path: &str, headers: &str) -> String {
        self.ask(&format!("GET {path}"), headers)
    }

    fn ask(&self, request: &str, headers: &str) -> String {
        let head =
            format!("{request} HTTP/1.1\r\nHost: lookdown\r\nConnection: close\r\n{headers}\r\n");
        let mut connection = self.connect();
        connection.write_all(head.as_bytes()).unwrap();
        let mut answer = String::new();
        connection.read_to_string(&mut answer).unwrap();
        answer
    }

    pub(super) fn signal(&self, name: &str) {
        let kill = format!("kill -{name} {}", self.process.id());
        let sent = Command::new("sh").args(["-c", &kill]).status();
        assert!(sent.unwrap().success());
    }

    /// Waits for a successful exit, and returns the rest of the log.
    pub(super) fn has_ended(mut self) -> Vec<String> {
        let rest = self.log.by_ref().map(Result::unwrap).collect();
        assert!(self.process.wait().unwrap().success());
        rest
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        // It still runs only if a test has failed.
        let _ = self.process.kill();
    }
}

#[test]
fn sigterm_shuts_down_gracefully() {
    let mut server = Server::start("", &[NO_GRACE]);
    server.signal("TERM");
    server.says("stopping");
    let rest = server.has_ended();
    assert!(rest.last().unwrap().contains("stopped"), "{rest:?}");
}

#[test]
fn sigint_shuts_down_without_a_grace_period() {
    let server = Server::start("", &[LONG_GRACE]);
    server.signal("INT");
    server.has_ended();
}

#[test]
fn sighup_reloads_the_keys_and_does_not_end_the_server() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("keys.toml");
    let (first, second) = (lookdown_key("first"), lookdown_key("second"));
    fs::write(&file, &first.line).unwrap();
    let keys_file = ("LOOKDOWN__ACCESS__KEYS_FILE", file.to_str().unwrap());
    let never = ("LOOKDOWN__ACCESS__POLL_SECONDS", "0");
    let mut server = Server::start("", &[NO_GRACE, keys_file, never]);
    let status = |server: &Server, key: &str| {
        let answer = server.get("/calibrations", &format!("X-API-Key: {key}\r\n"));
        answer.split(' ').nth(1).unwrap().to_owned()
    };
    assert_eq!(status(&server, &first.key), "200");
    fs::write(&file, &second.line).unwrap();
    for _ in 0..2 {
        server.signal("HUP");
        server.says("SIGHUP");
        assert_eq!(status(&server, &first.key), "401");
        assert_eq!(status(&server, &second.key), "200");
    }
    server.signal("TERM");
    server.has_ended();
}

/// A new API key, and its line for the file of keys.
struct Key {
    key: String,
    line: String,
}

fn lookdown_key(name: &str) -> Key {
    let output = run(&["key", "new", "--name", name, "--scope", "read"], &[]);
    let text = String::from_utf8(output.stdout).unwrap();
    let mut lines = text.lines().filter(|line| !line.starts_with('#'));
    let mut next = || lines.find(|line| !line.is_empty()).unwrap().to_owned();
    Key {
        key: next(),
        line: next(),
    }
}

#[test]
fn signals_without_a_meaning_do_not_end_the_server() {
    let server = Server::start("", &[NO_GRACE]);
    for signal in ["USR1", "USR2", "PIPE", "HUP"] {
        server.signal(signal);
        assert!(server.get("/livez", "").contains(" 200 "), "{signal}");
    }
    server.signal("TERM");
    server.has_ended();
}

#[test]
fn a_second_signal_ends_the_server_at_once() {
    let mut server = Server::start("", &[LONG_GRACE]);
    server.signal("TERM");
    server.says("stopping");
    // A model is still being loaded, which must not crash the process.
    server.signal("TERM");
    // The process ends before the grace period is over.
    server.has_ended();
}

#[test]
fn the_process_may_open_as_many_files_as_its_hard_limit() {
    let server = Server::start("ulimit -Sn 256; ulimit -Hn 600", &[NO_GRACE]);
    let limits = fs::read_to_string(format!("/proc/{}/limits", server.process.id())).unwrap();
    let limit = limits
        .lines()
        .find(|line| line.starts_with("Max open files"));
    let numbers = limit.unwrap().split_whitespace().skip(3).take(2);
    assert_eq!(numbers.collect::<Vec<_>>(), ["600", "600"]);
    server.signal("TERM");
    server.has_ended();
}

#[test]
fn lack_of_file_descriptors_is_logged_once_and_recovered_from() {
    // With a single model, a ready server opens no more files.
    let model = ("LOOKDOWN__MODEL__PATH", "models/nanodet_g_views_416");
    let mut server = Server::start("ulimit -n 64", &[NO_GRACE, model]);
    let held: Vec<_> = (0..100).map(|_| server.connect()).collect();
    let complaint = "connections cannot be accepted";
    server.says(complaint);
    drop(held);
    let answer = server.get("/livez", "");
    assert!(answer.contains("200 OK"), "{answer}");
    server.signal("TERM");
    let rest = server.has_ended();
    assert!(
        !rest.iter().any(|line| line.contains(complaint)),
        "{rest:?}"
    );
}

#[test]
fn health_check_over_tls_accepts_any_certificate_name() {
    let pair = rcgen::generate_simple_self_signed(["lookdown.example".to_owned()]).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let written = |name: &str, content: String| {
        let path = folder.path().join(name);
        fs::write(&path, content).unwrap();
        path.to_str().unwrap().to_owned()
    };
    let certificate = written("server.pem", pair.cert.pem());
    let private_key = written("server.key", pair.signing_key.serialize_pem());
    let tls = [
        ("LOOKDOWN__SERVER__TLS__CERTIFICATE", &*certificate),
        ("LOOKDOWN__SERVER__TLS__PRIVATE_KEY", &*private_key),
    ];
    let server = Server::start("", &[NO_GRACE, tls[0], tls[1]]);
    let address = format!("127.0.0.1:{}", server.port);
    let output = run(
        &["health"],
        &[("LOOKDOWN__SERVER__LISTEN", &address), tls[0], tls[1]],
    );
    assert!(output.status.success(), "{output:?}");
    server.signal("TERM");
    server.has_ended();
}
