//! Settings: layers, limits and what is said about mistakes.
#![expect(clippy::unwrap_used, reason = "a test stops at the first surprise")]

use std::{collections::HashMap, fs, path::Path};

use lookdown::settings::{
    CalibrationPlace, RawSettings, Settings, SettingsError, find_calibrations, load,
};

fn environment(variables: &[(&str, &str)]) -> HashMap<String, String> {
    let owned = |&(name, value): &(&str, &str)| (name.to_owned(), value.to_owned());
    variables.iter().map(owned).collect()
}

fn from_environment(name: &str, value: &str) -> Result<Settings, SettingsError> {
    load(None, environment(&[(name, value)]))
}

fn from_file(text: &str) -> Result<Settings, SettingsError> {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("lookdown.toml");
    fs::write(&file, text).unwrap();
    load(Some(&file), HashMap::new())
}

fn defaults() -> Settings {
    RawSettings::default().try_into().unwrap()
}

/// The message of a refusal, which must be one line.
fn refusal(result: Result<Settings, SettingsError>) -> String {
    let message = result.unwrap_err().to_string();
    assert!(!message.contains('\n'), "{message:?} is more than a line");
    message
}

#[test]
fn the_example_file_states_every_key_at_its_default() {
    let example = concat!(env!("CARGO_MANIFEST_DIR"), "/config/lookdown.toml");
    let settings = load(Some(Path::new(example)), HashMap::new()).unwrap();
    assert_eq!(settings, defaults());
    let text = fs::read_to_string(example).unwrap();
    let stated = text.lines().filter(|line| {
        let key = line.split(" = ").next().unwrap_or_default();
        !line.starts_with('#') && line.contains(" = ") && !key.is_empty()
    });
    assert_eq!(stated.count(), 50, "a key is missing from {example}");
}

#[test]
fn the_environment_overrules_the_file_and_the_file_the_defaults() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("lookdown.toml");
    fs::write(
        &file,
        "[server]\nlisten = \"[::1]:81\"\nmax_body_bytes = 4096\n",
    )
    .unwrap();
    let variables = environment(&[("LOOKDOWN__SERVER__LISTEN", "0.0.0.0:82")]);
    let settings = load(Some(&file), variables).unwrap();
    assert_eq!(settings.server.listen.to_string(), "0.0.0.0:82");
    assert_eq!(settings.server.max_body_bytes, 4096);
    assert_eq!(settings.limits, defaults().limits);
}

#[test]
fn every_kind_of_value_can_be_given_in_the_environment() {
    let settings = load(
        None,
        environment(&[
            ("LOOKDOWN__INFERENCE__THREADS", "3"),
            ("LOOKDOWN__INFERENCE__SCORE_FLOOR", "0.25"),
            ("LOOKDOWN__MODEL__PATH", "123"),
            ("LOOKDOWN__PAPER__FIELD_OF_VIEW", "diagonal"),
        ]),
    )
    .unwrap();
    assert_eq!(settings.threads.per_session.get(), 3);
    assert!((settings.inference.score_floor - 0.25).abs() < f64::EPSILON);
    assert_eq!(settings.model.path.as_deref(), Some(Path::new("123")));
}

#[test]
fn tls_is_on_with_a_certificate_and_its_key_and_off_without() {
    assert_eq!(defaults().server.tls, None);
    let settings = load(
        None,
        environment(&[
            ("LOOKDOWN__SERVER__TLS__CERTIFICATE", "/tls/server.pem"),
            ("LOOKDOWN__SERVER__TLS__PRIVATE_KEY", "/tls/server.key"),
        ]),
    );
    let tls = settings.unwrap().server.tls.unwrap();
    assert_eq!(tls.certificate, Path::new("/tls/server.pem"));
    assert_eq!(tls.private_key, Path::new("/tls/server.key"));
    assert_eq!(tls.client_certificates, None);
}

#[test]
fn half_of_what_tls_needs_is_refused_with_the_other_half() {
    for (given, missing) in [
        ("CERTIFICATE", "server.tls.private_key is empty"),
        ("PRIVATE_KEY", "server.tls.certificate is empty"),
        ("CLIENT_CERTIFICATES", "server.tls.certificate is empty"),
    ] {
        let variable = format!("LOOKDOWN__SERVER__TLS__{given}");
        let message = refusal(from_environment(&variable, "/tls/file.pem"));
        assert!(message.contains(missing), "{message}");
        assert!(message.contains("give the "), "{message}");
    }
}

#[test]
fn a_private_key_where_its_path_belongs_is_refused_and_not_repeated() {
    let key = "-----BEGIN PRIVATE KEY-----\nc2VjcmV0\n-----END PRIVATE KEY-----";
    let message = refusal(from_environment("LOOKDOWN__SERVER__TLS__PRIVATE_KEY", key));
    assert!(
        message.contains("server.tls.private_key is PEM itself"),
        "{message}"
    );
    assert!(!message.contains("c2VjcmV0"), "{message}");
}

#[test]
fn the_variables_kubernetes_sets_for_a_service_are_ignored() {
    let variables = environment(&[
        ("LOOKDOWN_PORT", "tcp://10.0.0.1:8080"),
        ("LOOKDOWN_SERVICE_HOST", "10.0.0.1"),
        ("LOOKDOWN_PORT_8080_TCP_ADDR", "10.0.0.1"),
    ]);
    assert_eq!(load(None, variables).unwrap(), defaults());
}

#[test]
fn a_variable_set_to_nothing_counts_as_not_set() {
    let settings = from_environment("LOOKDOWN__MODEL__PATH", "").unwrap();
    assert_eq!(settings, defaults());
}

#[test]
fn draining_takes_as_long_as_a_request_may_unless_somebody_says_otherwise() {
    let request_timeout = ("LOOKDOWN__SERVER__REQUEST_TIMEOUT_MILLIS", "7000");
    let own = ("LOOKDOWN__SHUTDOWN__DRAIN_TIMEOUT_MILLIS", "200");
    let drain_millis = |variables: &[_]| {
        let settings = load(None, environment(variables)).unwrap();
        settings.shutdown.drain_timeout.as_millis()
    };
    assert_eq!(drain_millis(&[request_timeout]), 7000);
    assert_eq!(drain_millis(&[request_timeout, own]), 200);
}

#[test]
fn without_a_number_of_sessions_the_machine_decides() {
    let sessions = defaults().threads.sessions;
    assert_eq!(sessions, std::thread::available_parallelism().unwrap());
}

#[test]
fn an_unknown_key_is_refused_by_name() {
    let in_file = refusal(from_file("[server]\nlistn = \"127.0.0.1:1\"\n"));
    assert!(in_file.contains("server"), "{in_file}");
    assert!(
        in_file.contains("`listn`") && in_file.contains("`listen`"),
        "{in_file}"
    );
    let group = refusal(from_file("[sever]\nlisten = \"127.0.0.1:1\"\n"));
    assert!(
        group.contains("`sever`") && group.contains("`server`"),
        "{group}"
    );
    let variable = refusal(from_environment("LOOKDOWN__INFERENCE__THREAD", "2"));
    assert!(
        variable.contains("`thread`") && variable.contains("`threads`"),
        "{variable}"
    );
}

/// Variable, value, and what the refusal has to say: the key and a remedy.
const UNUSABLE: [(&str, &str, &str, &str); 38] = [
    (
        "SERVER__LISTEN",
        "localhost",
        "server.listen",
        "127.0.0.1:8080",
    ),
    (
        "SERVER__MAX_BODY_BYTES",
        "12",
        "server.max_body_bytes",
        "from 1024",
    ),
    (
        "SERVER__MAX_BODY_BYTES",
        "many",
        "server.max_body_bytes",
        "integer",
    ),
    (
        "SERVER__MAX_BODY_BYTES",
        "-1",
        "server.max_body_bytes",
        "integer",
    ),
    (
        "SERVER__REQUEST_TIMEOUT_MILLIS",
        "0",
        "server.request_timeout_millis",
        "from 1",
    ),
    (
        "SERVER__METRICS_LISTEN",
        "9090",
        "server.metrics_listen",
        "127.0.0.1:8080",
    ),
    (
        "SERVER__MAX_CONNECTIONS",
        "0",
        "server.max_connections",
        "from 1 to",
    ),
    (
        "SERVER__HEADER_TIMEOUT_MILLIS",
        "0",
        "server.header_timeout_millis",
        "from 1 to 600000",
    ),
    (
        "SERVER__IDLE_TIMEOUT_MILLIS",
        "600001",
        "server.idle_timeout_millis",
        "from 1 to 600000",
    ),
    (
        "SERVER__MAX_HEADER_BYTES",
        "512",
        "server.max_header_bytes",
        "from 1024 to 131072",
    ),
    (
        "SERVER__MAX_HEADERS",
        "2000",
        "server.max_headers",
        "from 16 to 1024",
    ),
    (
        "SHUTDOWN__GRACE_MILLIS",
        "600001",
        "shutdown.grace_millis",
        "from 0 to 600000",
    ),
    (
        "SHUTDOWN__GRACE_MILLIS",
        "5s",
        "shutdown.grace_millis",
        "integer",
    ),
    (
        "SHUTDOWN__DRAIN_TIMEOUT_MILLIS",
        "-1",
        "shutdown.drain_timeout_millis",
        "integer",
    ),
    (
        "SERVER__TLS__HANDSHAKE_TIMEOUT_MILLIS",
        "0",
        "server.tls.handshake_timeout_millis",
        "from 1 to 60000",
    ),
    (
        "SERVER__TLS__POLL_SECONDS",
        "100000",
        "server.tls.poll_seconds",
        "from 0 to",
    ),
    (
        "INFERENCE__THREADS",
        "100000",
        "inference.threads",
        "from 0 to",
    ),
    (
        "INFERENCE__SCORE_FLOOR",
        "2",
        "inference.score_floor",
        "from 0 to 1",
    ),
    (
        "INFERENCE__SCORE_FLOOR",
        "NaN",
        "inference.score_floor",
        "from 0 to 1",
    ),
    (
        "INFERENCE__DEVICE",
        "gpu",
        "inference.device",
        "cpu, cuda:N or tensorrt:N",
    ),
    (
        "MODEL__POLL_SECONDS",
        "100000",
        "model.poll_seconds",
        "from 0 to",
    ),
    (
        "INFERENCE__MAX_BATCH_VIEWS",
        "100000",
        "inference.max_batch_views",
        "from 0 to",
    ),
    ("INFERENCE__SESSIONS", "-1", "inference.sessions", "integer"),
    (
        "INFERENCE__MAX_QUEUE_DELAY_MILLIS",
        "1001",
        "inference.max_queue_delay_millis",
        "from 0 to 1000",
    ),
    (
        "LIMITS__MAX_IMAGE_SIDE",
        "65536",
        "limits.max_image_side",
        "65535",
    ),
    (
        "LIMITS__MAX_FRAMES_IN_FLIGHT",
        "0",
        "limits.max_frames_in_flight",
        "from 1",
    ),
    (
        "LIMITS__MAX_UPLOAD_BYTES",
        "1024",
        "limits.max_upload_bytes",
        "33554432",
    ),
    (
        "LIMITS__MIN_UPLOAD_BYTES_PER_SECOND",
        "-1",
        "limits.min_upload_bytes_per_second",
        "integer",
    ),
    (
        "LIMITS__REQUESTS_PER_SECOND",
        "0.01",
        "limits.requests_per_second",
        "0.02 to 100000",
    ),
    (
        "LIMITS__REQUESTS_PER_SECOND",
        "NaN",
        "limits.requests_per_second",
        "0.02 to 100000",
    ),
    (
        "LIMITS__REQUEST_BURST",
        "0",
        "limits.request_burst",
        "from 1",
    ),
    (
        "PAPER__FIELD_OF_VIEW",
        "wide",
        "paper.field_of_view",
        "horizontal, diagonal, literal",
    ),
    ("LOG__FORMAT", "xml", "log.format", "text, json"),
    (
        "LOG__FILTER",
        "lookdown=loud",
        "log.filter",
        "lookdown=debug",
    ),
    (
        "TELEMETRY__OTLP_ENDPOINT",
        "127.0.0.1:4318",
        "telemetry.otlp_endpoint",
        "http://127.0.0.1:4318",
    ),
    (
        "TELEMETRY__OTLP_ENDPOINT",
        "grpc://collector:4317",
        "telemetry.otlp_endpoint",
        "http://127.0.0.1:4318",
    ),
    (
        "TELEMETRY__SAMPLE_RATIO",
        "1.5",
        "telemetry.sample_ratio",
        "from 0 to 1",
    ),
    (
        "TELEMETRY__SERVICE_NAME",
        " ",
        "telemetry.service_name",
        "give a name",
    ),
];

#[test]
fn a_value_that_cannot_be_used_is_refused_with_key_value_and_remedy() {
    for (variable, value, key, remedy) in UNUSABLE {
        let message = refusal(from_environment(&format!("LOOKDOWN__{variable}"), value));
        for part in [key, value, remedy] {
            assert!(message.contains(part), "{message:?} does not say {part:?}");
        }
    }
}

#[test]
fn a_file_that_is_not_toml_is_refused_with_the_place() {
    let message = refusal(from_file("[server]\nlisten = \n"));
    assert!(message.contains("lookdown.toml"), "{message}");
    assert!(message.contains("line 2"), "{message}");
}

#[test]
fn a_file_that_is_not_there_is_refused_by_name() {
    let message = refusal(load(Some(Path::new("/nowhere/l.toml")), HashMap::new()));
    assert!(
        message.contains("/nowhere/l.toml") && message.contains("--config"),
        "{message}"
    );
}

#[test]
fn a_path_somebody_chose_must_exist() {
    let model = from_environment("LOOKDOWN__MODEL__PATH", "no/such/model").unwrap();
    let repository = from_environment("LOOKDOWN__MODEL__REPOSITORY", "no/such/models").unwrap();
    let library = from_environment("LOOKDOWN__INFERENCE__LIBRARY_PATH", "no/such.so").unwrap();
    for (refused, parts) in [
        (
            find_calibrations(Path::new("no/such/folder")).unwrap_err(),
            [
                "calibrations.path",
                "no/such/folder",
                "LOOKDOWN__CALIBRATIONS__PATH",
            ],
        ),
        (
            model.model.find_one().unwrap_err(),
            ["model.path", "no/such/model", "LOOKDOWN__MODEL__PATH"],
        ),
        (
            repository.model.find_repository().unwrap_err(),
            ["model.repository", "no/such/models", "make setup"],
        ),
        (
            library.inference.find_library().unwrap_err(),
            ["inference.library_path", "no/such.so", "make setup"],
        ),
    ] {
        for part in parts {
            assert!(
                refused.to_string().contains(part),
                "{refused} does not say {part:?}"
            );
        }
    }
    let folder = tempfile::tempdir().unwrap();
    let chosen = folder.path().to_str().unwrap();
    assert_eq!(
        place(chosen).unwrap(),
        CalibrationPlace::Folder(chosen.into())
    );
    let found = find_calibrations(folder.path()).unwrap();
    assert_eq!(found.unwrap(), folder.path());
}

fn place(path: &str) -> Result<CalibrationPlace, SettingsError> {
    let settings = from_environment("LOOKDOWN__CALIBRATIONS__PATH", path)?;
    Ok(settings.calibrations.path)
}

#[test]
fn calibrations_are_in_a_folder_or_in_the_bucket_of_a_url() {
    let folder = CalibrationPlace::Folder("/srv/calibrations".into());
    assert_eq!(place("file:///srv/calibrations").unwrap(), folder);
    for url in [
        "s3://bucket/prefix",
        "abfs://container@account.dfs.core.windows.net/prefix",
    ] {
        let found = place(url).unwrap();
        assert!(matches!(&found, CalibrationPlace::Bucket(_)), "{found:?}");
        assert_eq!(found.to_string(), url);
    }
}

#[test]
fn a_url_that_holds_credentials_is_refused_without_repeating_them() {
    for (path, part) in [
        ("s3://key:hidden@bucket/prefix", "AWS_SECRET_ACCESS_KEY"),
        ("s3://hidden@bucket/prefix", "AWS_SECRET_ACCESS_KEY"),
        (
            "abfs://container:hidden@account/prefix",
            "AWS_SECRET_ACCESS_KEY",
        ),
        (
            "https://account.blob.core.windows.net/c?sig=hidden",
            "more than a host",
        ),
        ("s3://bucket/prefix#hidden", "more than a host"),
        ("s3://key:hidden@bucket:port/prefix", "invalid port number"),
        ("file://elsewhere/srv", "file:///srv/calibrations"),
        ("", "calibrations.path is empty"),
    ] {
        let message = path.parse::<CalibrationPlace>().unwrap_err().to_string();
        assert!(
            message.contains("calibrations.path") && message.contains(part),
            "{message}"
        );
        assert!(!message.contains("hidden"), "{message}");
    }
}

#[test]
fn what_belongs_to_the_executable_is_found_from_anywhere() {
    let folders = fs::canonicalize(env!("CARGO_MANIFEST_DIR")).unwrap();
    // The models' folder is checked in, and this test's executable lies below it.
    let found = defaults().model.find_repository().unwrap();
    assert_eq!(fs::canonicalize(found).unwrap(), folders.join("models"));
}

#[test]
fn keys_and_origins_are_checked_and_a_key_in_the_wrong_place_is_not_repeated() {
    let leak = "lookdown_do-not-show-me";
    for (name, value, part) in [
        ("LOOKDOWN__ACCESS__KEYS", leak, "access.keys: key 1"),
        (
            "LOOKDOWN__ACCESS__KEYS",
            &format!("gate:detect:{leak}"),
            "never the key itself",
        ),
        (
            "LOOKDOWN__ACCESS__CORS_ORIGINS",
            "*",
            "access.cors_origins is \"*\"",
        ),
        (
            "LOOKDOWN__ACCESS__CORS_ORIGINS",
            "https://a.example, https://b.example/",
            "https://dashboard.example",
        ),
    ] {
        let message = refusal(from_environment(name, value));
        assert!(message.contains(part), "{message}");
        assert!(!message.contains("do-not-show-me"), "{message}");
    }
    let origins = "https://a.example, http://localhost:3000";
    let settings = from_environment("LOOKDOWN__ACCESS__CORS_ORIGINS", origins).unwrap();
    let expected = ["https://a.example", "http://localhost:3000"];
    assert_eq!(settings.access.cors_origins, expected);
}

#[test]
fn a_collector_s_address_with_credentials_is_refused_without_repeating_them() {
    let endpoint = "LOOKDOWN__TELEMETRY__OTLP_ENDPOINT";
    let message = refusal(from_environment(
        endpoint,
        "https://us:hidden@collector.example",
    ));
    assert!(message.contains("OTEL_EXPORTER_OTLP_HEADERS"), "{message}");
    assert!(!message.contains("hidden"), "{message}");
    let settings = from_environment(endpoint, "https://collector.example/otlp").unwrap();
    let told = settings.traces.otlp_endpoint.unwrap();
    assert_eq!(told.as_str(), "https://collector.example/otlp");
    assert_eq!(defaults().traces.otlp_endpoint, None);
}
