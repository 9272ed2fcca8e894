//! The modules of every crate with their uses: a table in `docs/modules.md`, and no circle in it.

use std::{
    collections::{BTreeMap, BTreeSet},
    fmt::Write as _,
    fs,
};

use super::source_scan::{
    CRATES, absolute, code, names_crate, sources, used_paths, without_test_files, without_tests,
};

/// The parts of modules that have rows of their own.
const PARTS: [&str; 3] = ["api::http", "api::protocols", "api::routes"];

/// The crates of the workspace as code names them.
const LIBRARIES: [&str; 8] = [
    "lookdown_common",
    "lookdown_count",
    "lookdown_detect",
    "lookdown_eval",
    "lookdown_http",
    "lookdown_lens",
    "lookdown_tracking",
    "lookdown_watch",
];

/// The dependencies of a module: other modules of its crate, and crates of the workspace.
#[derive(Default)]
struct Uses {
    purpose: String,
    modules: BTreeSet<String>,
    crates: BTreeSet<String>,
}

/// Returns the row of a path: its top module, or the part of it that has a row.
fn row_of(path: &str) -> String {
    let mut parts = PARTS.into_iter();
    let part = parts.find(|part| path == *part || path.starts_with(&format!("{part}::")));
    let top = || path.split("::").next().unwrap_or_default().to_owned();
    part.map_or_else(top, str::to_owned)
}

/// Returns the first sentence of a file's documentation.
fn purpose(text: &str) -> String {
    let lines = text.lines().map_while(|line| line.strip_prefix("//!"));
    let paragraph: Vec<_> = lines
        .map(str::trim)
        .skip_while(|line| line.is_empty())
        .take_while(|line| !line.is_empty())
        .collect();
    let paragraph = paragraph.join(" ").replace("[`", "`").replace("`]", "`");
    let end = paragraph.find(". ").unwrap_or(paragraph.len());
    paragraph[..end].trim_end_matches('.').replace('|', "\\|")
}

/// Returns the modules of a crate with their uses.
fn modules(root: &str) -> BTreeMap<String, Uses> {
    let files = without_test_files(sources(root));
    let names: BTreeSet<_> = files.iter().map(|(module, _)| row_of(module)).collect();
    let mut rows: BTreeMap<String, Uses> = BTreeMap::new();
    for (module, path) in files {
        let text = fs::read_to_string(path).unwrap();
        let name = row_of(&module);
        let row = rows.entry(name.clone()).or_default();
        if module == name {
            row.purpose = purpose(&text);
        }
        let code = absolute(&module, &code(without_tests(&text)));
        let used = used_paths(&code).into_iter().map(|path| row_of(&path));
        // The root file of a module joins its parts.
        let used = used.filter(|used| {
            *used != name && names.contains(used) && !used.starts_with(&format!("{module}::"))
        });
        row.modules.extend(used);
        let used = LIBRARIES
            .into_iter()
            .filter(|name| names_crate(&code, name));
        row.crates.extend(used.map(|name| name.replace('_', "-")));
    }
    rows
}

/// Returns the table of the modules of all crates.
pub fn module_table() -> String {
    let mut table = "| crate | module | purpose | uses |\n|---|---|---|---|\n".to_owned();
    for (crate_name, root) in CRATES {
        for (name, uses) in modules(root) {
            let used = uses.modules.iter().chain(&uses.crates);
            let used: Vec<_> = used.map(|name| format!("`{name}`")).collect();
            let _ = writeln!(
                table,
                "| `{crate_name}` | `{name}` | {} | {} |",
                uses.purpose,
                used.join(", ")
            );
        }
    }
    table
}

#[test]
fn no_modules_use_each_other_in_a_circle() {
    for (_, root) in CRATES {
        let mut rows = modules(root);
        loop {
            let before = rows.len();
            let left: BTreeSet<_> = rows.keys().cloned().collect();
            for uses in rows.values_mut() {
                uses.modules.retain(|name| left.contains(name));
            }
            rows.retain(|_, uses| !uses.modules.is_empty());
            if rows.len() == before {
                break;
            }
        }
        let circle: Vec<_> = rows
            .iter()
            .map(|(name, uses)| (name, &uses.modules))
            .collect();
        assert!(circle.is_empty(), "{root}: {circle:#?}");
    }
}

#[test]
fn the_purpose_is_the_first_sentence_of_the_documentation() {
    let text = "//! Reads [`Frame`]s\n//! of cameras. More.\n//!\n//! Even more.\nuse a;";
    assert_eq!(purpose(text), "Reads `Frame`s of cameras");
}
