//! Folders, addresses, API keys and origins.

use std::{fs, path::Path};

use lookdown::settings::find_calibrations;

use crate::settings::{defaults, from_environment, refusal};

#[test]
fn a_path_that_is_set_must_exist() {
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
            [
                "model.repository",
                "no/such/models",
                "LOOKDOWN__MODEL__REPOSITORY",
            ],
        ),
        (
            library.inference.find_library().unwrap_err(),
            ["inference.library_path", "no/such.so", "make setup"],
        ),
    ] {
        for part in parts {
            assert!(
                refused.to_string().contains(part),
                "{refused} does not contain {part:?}"
            );
        }
    }
    let folder = tempfile::tempdir().unwrap();
    let found = find_calibrations(folder.path()).unwrap();
    assert_eq!(found.unwrap(), folder.path());
}

#[test]
fn url_as_a_path_is_refused_and_not_repeated() {
    let url = "s3://key:hidden@bucket/prefix";
    let message = refusal(from_environment("LOOKDOWN__CALIBRATIONS__PATH", url));
    let expected = "calibrations.path is a URL: give a path on this machine";
    assert!(message.starts_with(expected), "{message}");
    assert!(!message.contains("hidden"), "{message}");
}

#[test]
fn files_of_the_executable_are_found_from_any_directory() {
    let folders = fs::canonicalize(env!("CARGO_MANIFEST_DIR")).unwrap();
    // The models' folder is checked in, and this test's executable is in a folder below it.
    let found = defaults().model.find_repository().unwrap();
    assert_eq!(fs::canonicalize(found).unwrap(), folders.join("models"));
}

#[test]
fn keys_and_origins_are_checked_and_keys_are_not_repeated() {
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
fn an_invalid_address_of_a_redis_is_not_repeated() {
    let message = refusal(from_environment(
        "LOOKDOWN__RESULTS__URL",
        "http://:do-not-show-me@localhost:6379",
    ));
    let expected = "results.url is not a URL of a Redis: give redis://host:port/database";
    assert!(message.starts_with(expected), "{message}");
    assert!(!message.contains("do-not-show-me"), "{message}");
}

#[test]
fn credentials_in_a_collector_s_address_are_not_repeated() {
    let endpoint = "LOOKDOWN__TELEMETRY__OTLP_ENDPOINT";
    let message = refusal(from_environment(
        endpoint,
        "https://us:hidden@collector.example",
    ));
    assert!(message.contains("OTEL_EXPORTER_OTLP_HEADERS"), "{message}");
    assert!(!message.contains("hidden"), "{message}");
    let settings = from_environment(endpoint, "https://collector.example/otlp").unwrap();
    let collector = settings.traces.otlp_endpoint.unwrap();
    assert_eq!(collector.as_str(), "https://collector.example/otlp");
    assert_eq!(defaults().traces.otlp_endpoint, None);
}

#[test]
fn localhost_is_an_address_to_listen_on() {
    let settings = from_environment("LOOKDOWN__SERVER__LISTEN", "localhost:8081").unwrap();
    assert_eq!(settings.server.listen.to_string(), "127.0.0.1:8081");
}
