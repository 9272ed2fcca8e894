//! Dependencies between modules are acyclic, and only few modules use external systems.
#![expect(clippy::unwrap_used, reason = "a failed call fails the test")]

use std::{
    collections::BTreeSet,
    fs,
    path::{Path, PathBuf},
};

/// Every module, and the modules of this crate it may use.
const MAY_USE: [(&str, &[&str]); 29] = [
    ("plain_name", &[]),
    ("quoted", &[]),
    ("watched_file", &[]),
    ("access", &["plain_name", "watched_file"]),
    ("revision", &[]),
    ("warning", &[]),
    ("geometry", &[]),
    ("detection", &[]),
    ("metrics", &[]),
    ("shutdown", &[]),
    ("poller", &[]),
    ("results", &["quoted", "tls"]),
    ("open_inference", &[]),
    ("imaging", &["geometry"]),
    (
        "calibration",
        &["geometry", "plain_name", "quoted", "revision", "warning"],
    ),
    (
        "inference",
        &[
            "detection",
            "imaging",
            "open_inference",
            "quoted",
            "revision",
        ],
    ),
    ("tls", &["metrics", "watched_file"]),
    ("server", &["metrics", "shutdown", "tls"]),
    ("mqtt", &["metrics", "results", "tls"]),
    (
        "settings",
        &["access", "inference", "mqtt", "results", "server", "tls"],
    ),
    ("telemetry", &["settings"]),
    ("probe", &["settings"]),
    (
        "pipeline",
        &[
            "geometry",
            "detection",
            "imaging",
            "calibration",
            "inference",
            "quoted",
            "revision",
            "warning",
        ],
    ),
    (
        "evaluation",
        &[
            "geometry",
            "detection",
            "imaging",
            "calibration",
            "inference",
            "pipeline",
        ],
    ),
    ("annotation_formats", &["geometry", "detection", "pipeline"]),
    ("annotated_image", &["geometry", "imaging", "pipeline"]),
    (
        "api",
        &[
            "access",
            "annotated_image",
            "annotation_formats",
            "geometry",
            "detection",
            "imaging",
            "calibration",
            "inference",
            "open_inference",
            "pipeline",
            "metrics",
            "quoted",
            "results",
            "revision",
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
            "inference",
            "pipeline",
            "evaluation",
            "probe",
            "settings",
            "shutdown",
            "telemetry",
            "api",
            "app",
        ],
    ),
];

/// Crates for external systems, and the only modules that may use them.
const MAY_USE_CRATE: [(&str, &[&str]); 27] = [
    ("ort", &["inference"]),
    ("image", &["imaging"]),
    ("axum", &["api"]),
    ("base64", &["open_inference"]),
    ("hyper", &["server"]),
    ("hyper_util", &["server"]),
    ("tower_http", &["api"]),
    ("utoipa", &["api"]),
    ("utoipa_axum", &["api"]),
    (
        "serde_json",
        &[
            "annotated_image",
            "annotation_formats",
            "api",
            "calibration",
            "cli",
            "evaluation",
            "inference",
            "open_inference",
            "mqtt",
        ],
    ),
    ("clap", &["cli"]),
    ("clap_complete", &["cli"]),
    ("clap_mangen", &["cli"]),
    ("indicatif", &["cli"]),
    ("plotters", &["evaluation"]),
    ("rumqttc", &["mqtt"]),
    ("secrecy", &["settings"]),
    ("object_store", &["calibration"]),
    (
        "rustls",
        &[
            "calibration",
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

/// Every source file of the library with its top-level module.
fn sources() -> Vec<(String, PathBuf)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut folders = vec![root.clone()];
    let mut files = Vec::new();
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|ending| ending == "rs") {
                let below = path.strip_prefix(&root).unwrap();
                let module = below.iter().next().unwrap().to_str().unwrap();
                files.push((module.trim_end_matches(".rs").to_owned(), path));
            }
        }
    }
    files.retain(|(module, _)| module != "lib" && module != "main");
    files
}

/// Returns the code of a file without comments.
fn code(text: &str) -> String {
    let lines = text
        .lines()
        .map(|line| line.split("//").next().unwrap_or_default());
    lines.collect::<Vec<_>>().join("\n")
}

fn leading_name(text: &str) -> &str {
    let end = text.find(|c: char| !c.is_alphanumeric() && c != '_');
    &text[..end.unwrap_or(text.len())]
}

/// The modules after `crate::`, also in a list of imports.
fn used_modules(code: &str) -> BTreeSet<&str> {
    let mut used = BTreeSet::new();
    for (start, name) in code.match_indices("crate::") {
        let before = code[..start].chars().next_back();
        if before.is_some_and(|c| c.is_alphanumeric() || c == '_' || c == '$') {
            continue;
        }
        let rest = &code[start + name.len()..];
        let Some(list) = rest.strip_prefix('{') else {
            used.insert(leading_name(rest));
            continue;
        };
        let mut depth = 1;
        let mut at_name = true;
        for (index, character) in list.char_indices() {
            match character {
                '{' => depth += 1,
                '}' => depth -= 1,
                ',' => at_name = depth == 1,
                c if c.is_whitespace() => {}
                _ if at_name => {
                    used.insert(leading_name(&list[index..]));
                    at_name = false;
                }
                _ => {}
            }
            if depth == 0 {
                break;
            }
        }
    }
    used
}

/// Returns true if a path in the code begins with this crate.
fn names_crate(code: &str, name: &str) -> bool {
    code.match_indices(&format!("{name}::")).any(|(start, _)| {
        let before = code[..start].chars().next_back();
        !before.is_some_and(|c| c.is_alphanumeric() || c == '_' || c == ':')
    })
}

#[test]
fn every_module_uses_only_what_lies_below_it() {
    let mut breaches = Vec::new();
    for (module, path) in sources() {
        let code = code(&fs::read_to_string(&path).unwrap());
        let Some((_, allowed)) = MAY_USE.iter().find(|(name, _)| *name == module) else {
            breaches.push(format!("{module} has no entry in MAY_USE"));
            continue;
        };
        for used in used_modules(&code) {
            if used != module && !allowed.contains(&used) {
                breaches.push(format!("{}: {module} → {used}", path.display()));
            }
        }
    }
    assert!(breaches.is_empty(), "{}", breaches.join("\n"));
}

#[test]
fn only_listed_modules_use_crates_for_external_systems() {
    let mut breaches = Vec::new();
    for (module, path) in sources() {
        let code = code(&fs::read_to_string(&path).unwrap());
        for (name, allowed) in MAY_USE_CRATE {
            if !allowed.contains(&module.as_str()) && names_crate(&code, name) {
                breaches.push(format!("{}: {module} uses {name}", path.display()));
            }
        }
    }
    assert!(breaches.is_empty(), "{}", breaches.join("\n"));
}

#[test]
fn one_file_may_be_unsafe() {
    let naming = sources().into_iter().map(|(_, path)| path).filter(|path| {
        let code = code(&fs::read_to_string(path).unwrap());
        code.contains("unsafe {") || code.contains("unsafe fn") || code.contains("unsafe_code")
    });
    let naming: Vec<_> = naming
        .filter(|path| !path.ends_with("imaging/remap_table.rs"))
        .collect();
    assert_eq!(naming.len(), 1, "{naming:?}");
    assert!(
        naming[0].ends_with("imaging/remap_table/vector.rs"),
        "{naming:?}"
    );
}

#[test]
fn files_stay_small() {
    for (_, path) in sources() {
        let lines = fs::read_to_string(&path).unwrap().lines().count();
        assert!(
            lines <= 400,
            "{} has {lines} lines: split it",
            path.display()
        );
    }
}

#[test]
fn the_scan_recognises_all_forms_of_imports() {
    let found = used_modules(
        "use crate::api; use crate::{\n    cli::{self, run},\n    metrics,\n};\nlet x = crate::app::f();",
    );
    assert_eq!(found, BTreeSet::from(["api", "app", "cli", "metrics"]));
    assert!(used_modules("use $crate::routes; use other_crate::api;").is_empty());
    assert!(used_modules(&code("// use crate::api;")).is_empty());
    assert!(names_crate("use ort::session::Session;", "ort"));
    assert!(!names_crate(
        "use crate::ort::Session; use support::x;",
        "ort"
    ));
}
