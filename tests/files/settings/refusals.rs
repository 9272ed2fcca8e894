//! Refusals of settings that cannot be used.

use std::{collections::HashMap, path::Path};

use lookdown::settings::load;

use crate::settings::{environment, from_environment, from_file, refusal};

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

/// Variable, value, and parts of the refusal: the key and a remedy.
const UNUSABLE: [(&str, &str, &str, &str); 48] = [
    (
        "RESULTS__KEY_PREFIX",
        "a:b",
        "results.key_prefix",
        "1 to 64",
    ),
    (
        "RESULTS__MAX_AGE_SECONDS",
        "59",
        "results.max_age_seconds",
        "from 60",
    ),
    (
        "MQTT__TOPIC_PREFIX",
        "home/#",
        "mqtt.topic_prefix",
        "lookdown",
    ),
    ("MQTT__TOPIC_PREFIX", "/home", "mqtt.topic_prefix", "topic"),
    (
        "MQTT__DISCOVERY_PREFIX",
        "$SYS",
        "mqtt.discovery_prefix",
        "topic",
    ),
    ("MQTT__MAX_CAMERAS", "0", "mqtt.max_cameras", "from 1"),
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
        "from 1024",
    ),
    (
        "SERVER__MAX_BODY_BYTES",
        "-1",
        "server.max_body_bytes",
        "from 1024",
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
        "from 0",
    ),
    (
        "SHUTDOWN__DRAIN_TIMEOUT_MILLIS",
        "-1",
        "shutdown.drain_timeout_millis",
        "from 0",
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
        "cpu, cuda:N or tensorrt:N, with N the GPU's number from 0, or openvino:cpu",
    ),
    (
        "INFERENCE__BACKEND",
        "grpc",
        "inference.backend",
        "onnx, v2",
    ),
    (
        "INFERENCE__URL",
        "http://127.0.0.1:8000",
        "inference.url",
        "inference.backend",
    ),
    (
        "INFERENCE__TIMEOUT_MILLIS",
        "0",
        "inference.timeout_millis",
        "from 1 to",
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
    ("INFERENCE__SESSIONS", "-1", "inference.sessions", "from 0"),
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
        "from 0",
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
    (
        "RESULTS__MAX_BYTES",
        "1000",
        "results.max_bytes",
        "from 8388608",
    ),
    (
        "RESULTS__MAX_LISTENERS",
        "0",
        "results.max_listeners",
        "from 1",
    ),
];

#[test]
fn an_invalid_value_is_refused_with_key_value_and_remedy() {
    for (variable, value, key, remedy) in UNUSABLE {
        let message = refusal(from_environment(&format!("LOOKDOWN__{variable}"), value));
        for part in [key, value, remedy] {
            assert!(
                message.contains(part),
                "{message:?} does not contain {part:?}"
            );
        }
    }
}

#[test]
fn a_value_of_the_wrong_toml_type_is_refused() {
    for (line, parts) in [
        (
            "[server]\nlisten = 8080",
            ["server.listen is 8080", "IP address"],
        ),
        (
            "[calibrations]\nwritable = 3",
            ["calibrations.writable is 3", "true or false"],
        ),
        ("[results]\nurl = 3", ["results.url", "string"]),
        ("server = 3", ["server", "`shutdown`"]),
        ("[server.listen]\nport = 1", ["server.listen", "IP address"]),
        (
            "[server]\nmax_headers = 16.5",
            ["server.max_headers is 16.5", "from 16"],
        ),
    ] {
        let message = refusal(from_file(line));
        for part in parts {
            assert!(message.contains(part), "{message:?} lacks {part:?}");
        }
    }
}

#[test]
fn a_file_that_is_not_toml_is_refused_with_the_line() {
    let message = refusal(from_file("[server]\nlisten = \n"));
    assert!(message.contains("lookdown.toml"), "{message}");
    assert!(message.contains("line 2"), "{message}");
}

#[test]
fn a_missing_file_is_refused_by_name() {
    let message = refusal(load(Some(Path::new("/nowhere/l.toml")), HashMap::new()));
    assert!(
        message.contains("/nowhere/l.toml") && message.contains("--config"),
        "{message}"
    );
}

#[test]
fn the_password_of_a_broker_is_neither_shown_nor_repeated() {
    let url = "mqtt://home:s3cret@broker:1883";
    let settings = from_environment("LOOKDOWN__MQTT__URL", url).unwrap();
    let shown = format!("{settings:?}");
    assert!(shown.contains("broker:1883"), "{shown}");
    assert!(!shown.contains("s3cret"), "{shown}");
    let refused = refusal(from_environment("LOOKDOWN__MQTT__URL", &format!("{url}/x")));
    assert!(refused.contains("mqtt.url"), "{refused}");
    assert!(!refused.contains("s3cret"), "{refused}");
}

#[test]
fn the_password_of_a_broker_has_a_variable_of_its_own() {
    let url = ("LOOKDOWN__MQTT__URL", "mqtt://home@broker");
    let password = ("LOOKDOWN__MQTT__PASSWORD", "s3cret");
    let settings = load(None, environment(&[url, password])).unwrap();
    assert!(settings.mqtt.is_some());
    assert!(!format!("{settings:?}").contains("s3cret"));
    for (url, remedy) in [
        ("mqtt://broker", "mqtt://user@host"),
        ("mqtt://home:other@broker", "remove one"),
    ] {
        let variables = [("LOOKDOWN__MQTT__URL", url), password];
        let refused = refusal(load(None, environment(&variables)));
        let names_key = refused.contains("mqtt.password");
        assert!(names_key && refused.contains(remedy), "{refused}");
        assert!(!refused.contains("s3cret"), "{refused}");
    }
}

#[test]
fn an_inference_server_url_must_not_have_a_password() {
    let with_url = |url: &str| {
        let text = format!("[inference]\nbackend = \"v2\"\nmodel = \"m\"\nurl = \"{url}\"\n");
        from_file(&text)
    };
    for url in [
        "",
        "127.0.0.1:8000",
        "grpc://127.0.0.1:8001",
        "http://a/?b",
        "http://me:secret@host",
    ] {
        let message = refusal(with_url(url));
        assert!(
            message.contains("inference.url") && message.contains("http://"),
            "{message}"
        );
        assert!(!message.contains("secret"), "{message}");
    }
    let with_token = |token: &str| {
        let rest = "backend = \"v2\"\nmodel = \"m\"\nurl = \"http://host:8000\"";
        from_file(&format!(
            "[inference]\n{rest}\nbearer_token = \"{token}\"\n"
        ))
    };
    let remote = with_token("s3cret.+/=").unwrap().remote.unwrap();
    assert_eq!(remote.token, Some("s3cret.+/=".parse().unwrap()));
    assert!(!format!("{remote:?}").contains("s3cret"), "{remote:?}");
    let unused = from_environment("LOOKDOWN__INFERENCE__BEARER_TOKEN", "s3cret");
    for message in [refusal(with_token("Bearer s3cret")), refusal(unused)] {
        assert!(message.contains("inference.bearer_token"), "{message}");
        assert!(!message.contains("s3cret"), "{message}");
    }
    let nameless = refusal(from_environment("LOOKDOWN__INFERENCE__BACKEND", "v2"));
    assert!(
        nameless.contains("inference.model") && nameless.contains("model.path"),
        "{nameless}"
    );
    let settings = with_url("https://host:8000/prefix").unwrap();
    let remote = settings.remote.unwrap();
    assert_eq!(remote.url.as_str(), "https://host:8000/prefix");
    assert_eq!(settings.threads.batch_views.get(), 8);
    assert_eq!(settings.threads.sessions.get(), 2);
}
