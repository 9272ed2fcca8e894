//! Settings: layers, limits and refusals.

mod places;
mod refusals;

use std::{collections::HashMap, fs, path::Path};

use lookdown::settings::{Settings, SettingsError, ignored_variables, load};

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
    load(None, HashMap::new()).unwrap()
}

/// The message of a refusal, which must be one line.
pub(crate) fn refusal(result: Result<Settings, SettingsError>) -> String {
    let message = result.unwrap_err().to_string();
    assert!(!message.contains('\n'), "{message:?} is more than one line");
    message
}

#[test]
fn variables_override_the_file_and_the_file_overrides_defaults() {
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
            ("LOOKDOWN__CALIBRATIONS__WRITABLE", "false"),
            ("lookdown__limits__request_burst", "7"),
        ]),
    )
    .unwrap();
    assert_eq!(settings.threads.per_session.get(), 3);
    assert!((settings.inference.score_floor - 0.25).abs() < f64::EPSILON);
    assert_eq!(settings.model.path.as_deref(), Some(Path::new("123")));
    assert!(!settings.calibrations.writable);
    assert_eq!(settings.limits.request_burst.get(), 7);
}

#[test]
fn tls_is_on_with_a_certificate_and_its_key_and_off_without() {
    assert_eq!(defaults().tls, None);
    let settings = load(
        None,
        environment(&[
            ("LOOKDOWN__SERVER__TLS__CERTIFICATE", "/tls/server.pem"),
            ("LOOKDOWN__SERVER__TLS__PRIVATE_KEY", "/tls/server.key"),
        ]),
    );
    let tls = settings.unwrap().tls.unwrap();
    assert_eq!(tls.certificate, Path::new("/tls/server.pem"));
    assert_eq!(tls.private_key, Path::new("/tls/server.key"));
    assert_eq!(tls.client_certificates, None);
}

#[test]
fn incomplete_tls_settings_name_the_missing_half() {
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
fn a_private_key_in_place_of_its_path_is_not_repeated() {
    let key = "-----BEGIN PRIVATE KEY-----\nc2VjcmV0\n-----END PRIVATE KEY-----";
    let message = refusal(from_environment("LOOKDOWN__SERVER__TLS__PRIVATE_KEY", key));
    assert!(
        message.contains("server.tls.private_key: it is PEM text"),
        "{message}"
    );
    assert!(!message.contains("c2VjcmV0"), "{message}");
}

#[test]
fn variables_of_a_kubernetes_service_are_ignored_with_a_warning() {
    let variables = [
        ("LOOKDOWN_PORT", "tcp://10.0.0.1:8080"),
        ("LOOKDOWN_SERVICE_HOST", "10.0.0.1"),
        ("LOOKDOWN_PORT_8080_TCP_ADDR", "10.0.0.1"),
    ];
    assert_eq!(load(None, environment(&variables)).unwrap(), defaults());
    let names = variables.map(|(name, _)| name.to_owned());
    let warning = ignored_variables(names).unwrap();
    for (name, _) in variables {
        assert!(warning.contains(name), "{warning}");
    }
}

#[test]
fn a_warning_names_the_setting_that_was_meant() {
    let single = "LOOKDOWN_ACCESS_KEYS_FILE".to_owned();
    let warning = ignored_variables([single]).unwrap();
    assert!(warning.contains("LOOKDOWN__ACCESS__KEYS_FILE"), "{warning}");
    let settings = ["LOOKDOWN__ACCESS__KEYS_FILE", "PATH"].map(str::to_owned);
    assert_eq!(ignored_variables(settings), None);
}

#[test]
fn a_variable_with_one_underscore_for_two_is_refused() {
    let message = refusal(from_environment("LOOKDOWN_ACCESS__KEYS_FILE", "keys.toml"));
    assert!(message.contains("LOOKDOWN_ACCESS__KEYS_FILE "), "{message}");
    assert!(message.contains("LOOKDOWN__ACCESS__KEYS_FILE"), "{message}");
    let message = refusal(from_environment("LOOKDOWN_ACCESS__KEY_FILE", "keys.toml"));
    assert!(
        message.contains("`key_file`") && message.contains("`keys_file`"),
        "{message}"
    );
}

#[test]
fn an_empty_keys_file_is_refused_wherever_it_is_given() {
    for refused in [
        from_environment("LOOKDOWN__ACCESS__KEYS_FILE", ""),
        from_file("[access]\nkeys_file = \"\"\n"),
    ] {
        let message = refusal(refused);
        assert!(message.contains("access.keys_file is empty"), "{message}");
        assert!(message.contains("leave the key out"), "{message}");
    }
}

#[test]
fn lists_are_arrays_in_the_file() {
    let settings = from_file(
        "[access]\ncors_origins = [\"https://a.example\", \"http://localhost:3000\"]\n\
         [model]\nalso_load = [\"a\", \"b\"]\n[results]\nimages = [\"hall\"]\n",
    )
    .unwrap();
    let origins = ["https://a.example", "http://localhost:3000"];
    assert_eq!(settings.access.cors_origins, origins);
    assert_eq!(settings.model.also_load, ["a", "b"]);
    assert!(settings.results.images_of.include("hall"));
}

#[test]
fn a_list_in_one_string_of_the_file_is_refused() {
    for (key, value) in [
        ("[access]\ncors_origins", "\"https://a.example\""),
        ("[access]\nkeys", "\"do-not-show-me\""),
        ("[model]\nalso_load", "\"a,b\""),
        ("[results]\nimages", "[1, 2]"),
    ] {
        let message = refusal(from_file(&format!("{key} = {value}\n")));
        let (_, key) = key.split_once('\n').unwrap();
        assert!(
            message.contains(key) && message.contains("array"),
            "{message}"
        );
        assert!(!message.contains("do-not-show-me"), "{message}");
    }
}

#[test]
fn a_variable_set_to_nothing_counts_as_not_set() {
    let settings = from_environment("LOOKDOWN__MODEL__PATH", "").unwrap();
    assert_eq!(settings, defaults());
}

#[test]
fn draining_takes_as_long_as_a_request_by_default() {
    let request_timeout = ("LOOKDOWN__SERVER__REQUEST_TIMEOUT_MILLIS", "7000");
    let own = ("LOOKDOWN__SHUTDOWN__DRAIN_TIMEOUT_MILLIS", "200");
    let drain_millis = |variables: &[_]| {
        let settings = load(None, environment(variables)).unwrap();
        settings.drain_timeout().as_millis()
    };
    assert_eq!(drain_millis(&[request_timeout]), 7000);
    assert_eq!(drain_millis(&[request_timeout, own]), 200);
}

#[test]
fn floor_alerts_look_for_people_on_the_floor_by_default() {
    let floor = |text: &str| from_file(text).unwrap().detect.floor();
    assert!(!floor(""));
    assert!(floor("counts.floor_alert = true"));
    assert!(!floor(
        "counts.floor_alert = true\ndetect.floor = \"false\""
    ));
}

#[test]
fn the_default_number_of_sessions_follows_from_the_machine() {
    let sessions = defaults().threads.sessions;
    assert_eq!(sessions, std::thread::available_parallelism().unwrap());
}

#[test]
fn images_are_stored_for_the_named_cameras_only() {
    for (named, hall, stairs) in [
        ("", false, false),
        ("hall", true, false),
        (" hall , yard,", true, false),
        ("hall north", false, false),
        ("*", true, true),
        ("hall,*", true, true),
    ] {
        let settings = from_environment("LOOKDOWN__RESULTS__IMAGES", named).unwrap();
        let images_of = settings.results.images_of;
        let kept = ["hall", "stairs"].map(|camera| images_of.include(camera));
        assert_eq!(kept, [hall, stairs], "{named:?}");
    }
}
