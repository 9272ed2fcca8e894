//! Dependencies between modules are acyclic, and only few modules use external systems.

mod file_circles;
pub mod source_scan;

use std::fs;

use source_scan::{CRATES, absolute, all_sources, code, names_crate, sources, used_paths};

/// The modules of a crate, each with the modules that it may use, of the crate and of the libraries
/// below it. A row for a part of a module replaces the row of the module for the files of that part.
type Table = &'static [(&'static str, &'static [&'static str])];

/// The libraries. Cargo keeps them from using the server.
const LENS: Table = &[
    ("plain_name", &[]),
    ("quoted", &[]),
    ("revision", &[]),
    ("warning", &[]),
    ("geometry", &[]),
    (
        "calibration",
        &["geometry", "plain_name", "quoted", "revision", "warning"],
    ),
];

/// See [`LENS`].
const DETECT: Table = &[
    ("fairness", &[]),
    ("detection", &[]),
    ("metrics", &[]),
    ("open_inference", &[]),
    ("imaging", &["geometry"]),
    (
        "parameters",
        &["calibration", "detection", "fairness", "geometry", "quoted"],
    ),
    (
        "inference",
        &[
            "detection",
            "imaging",
            "metrics",
            "open_inference",
            "quoted",
            "revision",
        ],
    ),
    (
        "pipeline",
        &[
            "fairness",
            "geometry",
            "detection",
            "imaging",
            "calibration",
            "inference",
            "metrics",
            "parameters",
            "quoted",
            "revision",
            "warning",
        ],
    ),
    (
        "detector",
        &[
            "calibration",
            "geometry",
            "imaging",
            "inference",
            "metrics",
            "parameters",
            "pipeline",
            "warning",
        ],
    ),
];

const SERVER: Table = &[
    ("metrics", &[]),
    ("access", &["fairness", "plain_name"]),
    ("rounding", &[]),
    ("shutdown", &[]),
    ("poller", &[]),
    ("results", &["fairness", "metrics", "quoted", "tls"]),
    (
        "calibration_store",
        &[
            "calibration",
            "metrics",
            "parameters",
            "plain_name",
            "quoted",
            "revision",
            "warning",
            "pipeline",
        ],
    ),
    ("tls", &["metrics"]),
    ("server", &["metrics", "shutdown", "tls"]),
    ("mqtt", &["fairness", "metrics", "results", "tls"]),
    (
        "settings",
        &[
            "access",
            "imaging",
            "inference",
            "mqtt",
            "parameters",
            "pipeline",
            "results",
            "server",
            "tls",
        ],
    ),
    ("telemetry", &["settings"]),
    ("probe", &["settings"]),
    (
        "annotation_formats",
        &["geometry", "detection", "pipeline", "rounding"],
    ),
    ("annotated_image", &["geometry", "imaging", "pipeline"]),
    (
        "api::http",
        &[
            "access",
            "calibration",
            "calibration_store",
            "fairness",
            "imaging",
            "metrics",
            "pipeline",
            "telemetry",
        ],
    ),
    (
        "api::routes",
        &[
            "annotated_image",
            "api",
            "api::http",
            "calibration",
            "calibration_store",
            "fairness",
            "metrics",
            "pipeline",
            "quoted",
            "results",
            "revision",
            "rounding",
            "telemetry",
        ],
    ),
    (
        "api::protocols",
        &[
            "access",
            "api",
            "api::http",
            "calibration",
            "calibration_store",
            "fairness",
            "inference",
            "open_inference",
            "pipeline",
            "quoted",
            "telemetry",
        ],
    ),
    (
        "api",
        &[
            "api::http",
            "access",
            "annotated_image",
            "annotation_formats",
            "fairness",
            "geometry",
            "detection",
            "imaging",
            "calibration",
            "calibration_store",
            "inference",
            "open_inference",
            "pipeline",
            "metrics",
            "quoted",
            "results",
            "revision",
            "rounding",
            "telemetry",
            "warning",
        ],
    ),
    (
        "app",
        &[
            "access",
            "geometry",
            "detection",
            "imaging",
            "calibration",
            "calibration_store",
            "inference",
            "pipeline",
            "metrics",
            "mqtt",
            "poller",
            "results",
            "server",
            "settings",
            "shutdown",
            "telemetry",
            "tls",
            "api",
        ],
    ),
    (
        "cli",
        &[
            "access",
            "annotated_image",
            "annotation_formats",
            "geometry",
            "detection",
            "imaging",
            "calibration",
            "calibration_store",
            "inference",
            "pipeline",
            "evaluation",
            "fairness",
            "probe",
            "settings",
            "shutdown",
            "telemetry",
            "mqtt",
            "api",
            "app",
        ],
    ),
];

/// The parts of modules whose own parts do not use each other.
const WITH_INDEPENDENT_PARTS: [&str; 2] = ["api::routes", "api::protocols"];

/// Crates for external systems, and the only modules that may use them.
const MAY_USE_CRATE: [(&str, &[&str]); 30] = [
    ("ort", &["inference"]),
    ("image", &["imaging"]),
    ("axum", &["api"]),
    ("base64", &["open_inference"]),
    ("hyper", &["server"]),
    ("hyper_util", &["server"]),
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
            "cli",
            "inference",
            "open_inference",
            "mqtt",
        ],
    ),
    ("lookdown_common", &["cli", "mqtt"]),
    ("lookdown_count", &["cli", "mqtt"]),
    ("lookdown_watch", &["cli"]),
    ("clap", &["cli"]),
    ("clap_complete", &["cli"]),
    ("clap_mangen", &["cli"]),
    ("indicatif", &["cli"]),
    ("moka", &["pipeline"]),
    ("rumqttc", &["mqtt"]),
    ("secrecy", &["settings"]),
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
    ("reqwest", &["inference", "probe", "telemetry"]),
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

/// Returns `true` if a path is a module or lies in it.
fn is_in(path: &str, module: &str) -> bool {
    let rest = path.strip_prefix(module);
    rest.is_some_and(|rest| rest.is_empty() || rest.starts_with("::"))
}

/// The row of a table for a module or a path in it.
fn row_of(table: Table, path: &str) -> Option<(&'static str, &'static [&'static str])> {
    let rows = table.iter().copied().filter(|(name, _)| is_in(path, name));
    rows.max_by_key(|(name, _)| name.len())
}

/// The part of a module with independent parts to which a path belongs.
fn independent_part(path: &str) -> Option<&str> {
    let module = WITH_INDEPENDENT_PARTS
        .into_iter()
        .find(|module| is_in(path, module))?;
    let rest = path[module.len()..].strip_prefix("::")?;
    Some(&path[..path.len() - rest.len() + top(rest).len()])
}

#[test]
fn every_module_uses_only_what_lies_below_it() {
    let [server, lens, detect, _] = CRATES;
    let tables = [(lens, LENS), (detect, DETECT), (server, SERVER)];
    let breaches: Vec<_> = tables
        .into_iter()
        .flat_map(|(root, table)| breaches(root, table))
        .collect();
    assert!(breaches.is_empty(), "{}", breaches.join("\n"));
}

/// Returns the uses in a crate that its table does not allow.
fn breaches(root: &str, table: Table) -> Vec<String> {
    let mut breaches = Vec::new();
    for (module, path) in sources(root) {
        let code = absolute(&module, &code(&fs::read_to_string(&path).unwrap()));
        let Some((row, allowed)) = row_of(table, &module) else {
            breaches.push(format!("{root}: {module} has no row in its table"));
            continue;
        };
        for used in used_paths(&code) {
            // A module without a row belongs to a library.
            let used_row = row_of(table, &used).map_or_else(|| top(&used), |(name, _)| name);
            // The root file of a module joins its parts.
            if used_row != row && !allowed.contains(&used_row) && !is_in(used_row, &module) {
                breaches.push(format!("{}: {row} → {used}", path.display()));
            }
            let parts = (independent_part(&module), independent_part(&used));
            if matches!(parts, (Some(part), Some(other)) if part != other && row == used_row) {
                breaches.push(format!("{}: {module} → {used}", path.display()));
            }
        }
    }
    breaches
}

#[test]
fn only_listed_modules_use_crates_for_external_systems() {
    let mut breaches = Vec::new();
    for (module, path) in CRATES[..3].iter().copied().flat_map(sources) {
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
