//! Dependencies between modules are acyclic, and only few modules use external systems.

mod file_circles;
mod module_table;
pub(crate) mod source_scan;

use std::fs;

pub use module_table::module_table;

use source_scan::{all_sources, code, names_crate, sources};

/// The crates whose use of external systems is limited to few modules.
const CHECKED: [&str; 3] = [
    "src",
    "crates/lookdown-lens/src",
    "crates/lookdown-detect/src",
];

/// Crates for external systems, and the only modules that may use them.
const MAY_USE_CRATE: [(&str, &[&str]); 27] = [
    ("ort", &["inference"]),
    ("image", &["imaging"]),
    ("axum", &["api"]),
    ("base64", &["open_inference"]),
    ("tower_http", &["api"]),
    ("utoipa", &["api", "open_inference"]),
    ("utoipa_axum", &["api"]),
    (
        "serde_json",
        &[
            "annotated_image",
            "annotation_formats",
            "api",
            "calibration",
            "calibration_store",
            "cameras",
            "cli",
            "inference",
            "open_inference",
            "mqtt",
        ],
    ),
    ("lookdown_count", &["app", "cli", "mqtt", "settings"]),
    ("lookdown_watch", &["cameras", "cli", "settings"]),
    ("clap", &["cli"]),
    ("clap_complete", &["cli"]),
    ("clap_mangen", &["cli"]),
    ("indicatif", &["cli"]),
    ("moka", &["pipeline"]),
    ("rumqttc", &["mqtt"]),
    ("secrecy", &["api", "cameras", "cli", "mqtt", "settings"]),
    ("object_store", &["calibration_store"]),
    (
        "rustls",
        &[
            "calibration",
            "calibration_store",
            "inference",
            "probe",
            "results",
            "telemetry",
            "tls",
        ],
    ),
    ("tokio_rustls", &["tls"]),
    ("x509_cert", &["tls"]),
    ("reqwest", &["api", "inference", "probe", "telemetry"]),
    ("opentelemetry", &["telemetry"]),
    ("opentelemetry_sdk", &["telemetry"]),
    ("opentelemetry_otlp", &["telemetry"]),
    ("prometheus", &["metrics"]),
    ("redis", &["results"]),
];

/// The module at the top of a path.
fn top(path: &str) -> &str {
    path.split("::").next().unwrap_or_default()
}

#[test]
fn only_listed_modules_use_crates_for_external_systems() {
    let mut breaches = Vec::new();
    for (module, path) in CHECKED.into_iter().flat_map(sources) {
        let code = code(&fs::read_to_string(&path).unwrap());
        for (name, allowed) in MAY_USE_CRATE {
            if !allowed.contains(&top(&module)) && names_crate(&code, name) {
                breaches.push(format!("{}: {module} uses {name}", path.display()));
            }
        }
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
        .filter(|path| !path.ends_with("imaging/remap_table.rs"))
        .collect();
    naming.sort();
    let ends = ["imaging/remap_table/avx2.rs", "imaging/remap_table/neon.rs"];
    assert_eq!(naming.len(), ends.len(), "{naming:?}");
    for (path, end) in naming.iter().zip(ends) {
        assert!(path.ends_with(end), "{naming:?}");
    }
}

#[test]
fn files_stay_small() {
    for (_, path) in all_sources() {
        let lines = fs::read_to_string(&path).unwrap().lines().count();
        assert!(
            lines <= 400,
            "{} has {lines} lines: split it",
            path.display()
        );
    }
}
