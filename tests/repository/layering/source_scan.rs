//! A scan of the source files for the modules and crates that they use.

use std::{
    collections::BTreeSet,
    fs,
    path::{Path, PathBuf},
};

/// The crates of the workspace with the folders of their sources.
pub const CRATES: [(&str, &str); 16] = [
    ("lookdown-common", "crates/lookdown-common/src"),
    ("lookdown-lens", "crates/lookdown-lens/src"),
    ("lookdown-calibration", "crates/lookdown-calibration/src"),
    ("lookdown-imaging", "crates/lookdown-imaging/src"),
    ("lookdown-tracking", "crates/lookdown-tracking/src"),
    ("lookdown-detect", "crates/lookdown-detect/src"),
    ("lookdown-eval", "crates/lookdown-eval/src"),
    ("lookdown-watch", "crates/lookdown-watch/src"),
    ("lookdown-http", "crates/lookdown-http/src"),
    ("lookdown-count", "crates/lookdown-count/src"),
    ("lookdown", "src"),
    ("lookdown-python", "crates/lookdown-python/src"),
    ("lookdown-load", "lab/benches/load"),
    ("lookdown-paper", "lab/benches/paper"),
    ("simulate", "lab/benches/simulate"),
    ("walks", "lab/benches/walks"),
];

/// Every source file of a crate with its module path, such as `api::http::csrf`.
pub fn sources(root: &str) -> Vec<(String, PathBuf)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join(root);
    let mut files = Vec::new();
    let mut folders = vec![root.clone()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|ending| ending == "rs") {
                let below = path.strip_prefix(&root).unwrap().with_extension("");
                let parts: Vec<_> = below.iter().map(|part| part.to_str().unwrap()).collect();
                files.push((parts.join("::"), path));
            }
        }
    }
    files.retain(|(module, _)| module != "lib" && module != "main");
    files
}

/// The files of all crates.
pub fn all_sources() -> Vec<(String, PathBuf)> {
    CRATES
        .into_iter()
        .flat_map(|(_, root)| sources(root))
        .collect()
}

/// Returns the modules without those of tests.
pub fn without_test_files(mut modules: Vec<(String, PathBuf)>) -> Vec<(String, PathBuf)> {
    modules.retain(|(module, _)| {
        let name = module.rsplit("::").next().unwrap_or_default();
        name != "tests" && !name.starts_with("test_")
    });
    modules
}

/// Returns a file without its module of tests.
pub fn without_tests(text: &str) -> &str {
    text.split("#[cfg(test)]\nmod tests {")
        .next()
        .unwrap_or(text)
}

/// Returns the code of a file without comments.
pub fn code(text: &str) -> String {
    let lines = text
        .lines()
        .map(|line| line.split("//").next().unwrap_or_default());
    lines.collect::<Vec<_>>().join("\n")
}

/// Replaces `super::` by the absolute path.
pub fn absolute(module: &str, code: &str) -> String {
    let mut code = code.to_owned();
    let parents: Vec<_> = module
        .match_indices("::")
        .map(|(end, _)| &module[..end])
        .collect();
    for depth in (1..=parents.len()).rev() {
        let parent = parents[parents.len() - depth];
        code = code.replace(&"super::".repeat(depth), &format!("crate::{parent}::"));
    }
    code
}

/// The paths after `crate::`, also in lists of imports.
pub fn used_paths(code: &str) -> BTreeSet<String> {
    let mut used = BTreeSet::new();
    for (start, name) in code.match_indices("crate::") {
        let before = &code[..start];
        let ends_name = |c: char| c.is_alphanumeric() || c == '_' || c == '$';
        // A visibility is not a use.
        if !before.ends_with(ends_name) && !before.ends_with("(in ") {
            collect_paths(&code[start + name.len()..], "", &mut used);
        }
    }
    used
}

/// Adds the paths at the start of `code`, a path or a list of paths in braces. Returns the rest.
pub fn collect_paths<'a>(code: &'a str, parent: &str, used: &mut BTreeSet<String>) -> &'a str {
    let code = code.trim_start();
    if let Some(mut rest) = code.strip_prefix('{') {
        loop {
            rest = collect_paths(rest, parent, used).trim_start();
            match rest.strip_prefix(',') {
                Some(next) if !next.trim_start().starts_with('}') => rest = next,
                Some(next) => return next.trim_start().split_at(1).1,
                None => return rest.strip_prefix('}').unwrap_or(rest),
            }
        }
    }
    let is_name = |c: char| c.is_alphanumeric() || c == '_';
    let end = code.find(|c| !is_name(c)).unwrap_or(code.len());
    let path = match (parent, &code[..end]) {
        ("", name) => name.to_owned(),
        (parent, "" | "self") => parent.to_owned(),
        (parent, name) => format!("{parent}::{name}"),
    };
    let rest = &code[end..];
    if let Some(below) = rest.strip_prefix("::") {
        return collect_paths(below, &path, used);
    }
    used.insert(path);
    // After a renamed import or a glob.
    let rest = rest.strip_prefix('*').unwrap_or(rest).trim_start();
    match rest.strip_prefix("as ") {
        Some(alias) => alias.trim_start().trim_start_matches(is_name),
        None => rest,
    }
}

/// Returns true if a path in the code begins with this crate.
pub fn names_crate(code: &str, name: &str) -> bool {
    code.match_indices(&format!("{name}::")).any(|(start, _)| {
        let before = code[..start].chars().next_back();
        !before.is_some_and(|c| c.is_alphanumeric() || c == '_' || c == ':')
    })
}

#[test]
fn the_scan_recognizes_all_forms_of_imports() {
    let found = used_paths(
        "use crate::api; use crate::{\n    cli::{self, run as go},\n    metrics::*,\n};\nlet x = crate::app::f();",
    );
    let expected = ["api", "app::f", "cli", "cli::run", "metrics"];
    assert_eq!(found, expected.map(str::to_owned).into());
    let relative = absolute(
        "api::http::csrf",
        "use super::host; use super::super::state;",
    );
    let expected = ["api::http::host", "api::state"];
    assert_eq!(used_paths(&relative), expected.map(str::to_owned).into());
    assert!(used_paths("use $crate::routes; use other_crate::api;").is_empty());
    assert!(used_paths(&code("// use crate::api;")).is_empty());
    assert!(names_crate("use ort::session::Session;", "ort"));
    assert!(!names_crate(
        "use crate::ort::Session; use support::x;",
        "ort"
    ));
}
