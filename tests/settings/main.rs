//! Settings: layers, limits and what is said about mistakes.
#![expect(clippy::unwrap_used, reason = "a test stops at the first surprise")]

mod places;
mod refusals;

use std::{collections::HashMap, fs, path::Path};

use lookdown::settings::{RawSettings, Settings, SettingsError, load};

pub(crate) fn environment(variables: &[(&str, &str)]) -> HashMap<String, String> {
    let owned = |&(name, value): &(&str, &str)| (name.to_owned(), value.to_owned());
    variables.iter().map(owned).collect()
}

pub(crate) fn from_environment(name: &str, value: &str) -> Result<Settings, SettingsError> {
    load(None, environment(&[(name, value)]))
}

pub(crate) fn from_file(text: &str) -> Result<Settings, SettingsError> {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("lookdown.toml");
    fs::write(&file, text).unwrap();
    load(Some(&file), HashMap::new())
}

pub(crate) fn defaults() -> Settings {
    RawSettings::default().try_into().unwrap()
}

/// The message of a refusal, which must be one line.
pub(crate) fn refusal(result: Result<Settings, SettingsError>) -> String {
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
    assert_eq!(stated.count(), 72, "a key is missing from {example}");
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
fn pictures_are_kept_of_the_cameras_that_are_named_and_of_nobody_else() {
    for (named, hall, stairs) in [
        ("", false, false),
        ("hall", true, false),
        (" hall , yard,", true, false),
        ("hall north", false, false),
        ("*", true, true),
        ("hall,*", true, true),
    ] {
        let settings = from_environment("LOOKDOWN__RESULTS__PICTURES", named).unwrap();
        let pictures_of = settings.results.pictures_of;
        let kept = ["hall", "stairs"].map(|camera| pictures_of.include(camera));
        assert_eq!(kept, [hall, stairs], "{named:?}");
    }
}
