//! Dependencies between modules are acyclic, and only few modules use external systems.

mod file_circles;
mod module_circles;
pub(crate) mod source_scan;

use std::{collections::BTreeSet, fs};

use source_scan::{CRATES, all_sources, code, names_crate, sources, without_test_files};

/// Crates for external systems, and the only crates and modules that may use them.
const MAY_USE_CRATE: [(&str, &[&str]); 24] = [
    ("ort", &["inference"]),
    ("image", &["lookdown-imaging"]),
    (
        "axum",
        &["api", "http", "lookdown-http", "metrics_server", "run"],
    ),
    ("base64", &["lookdown-http", "open_inference", "webhooks"]),
    ("tower_http", &["api", "lookdown-http"]),
    (
        "utoipa",
        &[
            "api",
            "http",
            "lookdown-http",
            "open_inference",
            "report",
            "views",
        ],
    ),
    ("utoipa_axum", &["api", "http"]),
    (
        "serde_json",
        &[
            "annotated_image",
            "annotation_formats",
            "api",
            "lookdown-calibration",
            "calibration_store",
            "cameras",
            "cli",
            "clock_simulation",
            "follower",
            "geometry",
            "bars",
            "http_client",
            "inference",
            "lookdown-eval",
            "lookdown-http",
            "lookdown-load",
            "lookdown-python",
            "mqtt",
            "open_inference",
            "recording",
            "reference_counts",
            "remote_persons",
            "report",
            "server",
            "simulate",
            "views",
            "walks",
            "webhooks",
        ],
    ),
    ("lookdown_count", &["app", "cli", "mqtt", "settings"]),
    (
        "lookdown_watch",
        &["api", "cameras", "cli", "settings", "views"],
    ),
    ("clap", &["cli", "lookdown-load"]),
    ("clap_complete", &["cli"]),
    ("clap_mangen", &["cli"]),
    ("moka", &["pipeline"]),
    ("rumqttc", &["mqtt"]),
    (
        "secrecy",
        &[
            "cameras",
            "credentials",
            "http_client",
            "location",
            "lookdown-http",
            "options",
            "run",
            "secret",
            "settings",
            "webhooks",
        ],
    ),
    (
        "rustls",
        &[
            "http_transport",
            "inference",
            "probe",
            "rtsp_relay",
            "telemetry",
            "tls",
        ],
    ),
    ("tokio_rustls", &["rtsp_relay", "tls"]),
    (
        "reqwest",
        &[
            "api",
            "inference",
            "lookdown-common",
            "lookdown-count",
            "lookdown-watch",
            "probe",
            "telemetry",
        ],
    ),
    ("opentelemetry", &["telemetry"]),
    ("opentelemetry_sdk", &["telemetry"]),
    ("opentelemetry_otlp", &["telemetry"]),
    (
        "prometheus",
        &["lookdown-http", "metrics", "run", "watcher"],
    ),
    ("redis", &["results"]),
];

/// The module at the top of a path.
fn top(path: &str) -> &str {
    path.split("::").next().unwrap_or_default()
}

#[test]
fn only_listed_modules_use_crates_for_external_systems() {
    let mut used = BTreeSet::new();
    let mut breaches = Vec::new();
    for (crate_name, root) in CRATES {
        for (module, path) in without_test_files(sources(root)) {
            let code = code(&fs::read_to_string(&path).unwrap());
            let places = [crate_name, top(&module)];
            for (name, allowed) in MAY_USE_CRATE {
                if names_crate(&code, name) {
                    match places.into_iter().find(|place| allowed.contains(place)) {
                        Some(place) => _ = used.insert((name, place.to_owned())),
                        None => breaches.push(format!("{}: {module} uses {name}", path.display())),
                    }
                }
            }
        }
    }
    for (name, allowed) in MAY_USE_CRATE {
        let unused = allowed
            .iter()
            .filter(|user| !used.contains(&(name, (**user).to_owned())));
        breaches.extend(unused.map(|user| format!("{user} may use {name} and does not")));
    }
    assert!(breaches.is_empty(), "{}", breaches.join("\n"));
}

#[test]
fn only_vector_instructions_are_unsafe() {
    let naming = all_sources()
        .into_iter()
        .map(|(_, path)| path)
        .filter(|path| {
            let code = code(&fs::read_to_string(path).unwrap());
            code.contains("unsafe {") || code.contains("unsafe fn") || code.contains("unsafe_code")
        });
    let mut naming: Vec<_> = naming
        .filter(|path| !path.ends_with("remap_table.rs"))
        .collect();
    naming.sort();
    let ends = ["remap_table/avx2.rs", "remap_table/neon.rs"];
    assert_eq!(naming.len(), ends.len(), "{naming:?}");
    for (path, end) in naming.iter().zip(ends) {
        assert!(path.ends_with(end), "{naming:?}");
    }
}

/// One idea may need so many lines, with the methods beside their types.
#[test]
fn files_stay_small() {
    for (_, path) in all_sources() {
        let lines = fs::read_to_string(&path).unwrap().lines().count();
        assert!(
            lines <= 600,
            "{} has {lines} lines: split it",
            path.display()
        );
    }
}
