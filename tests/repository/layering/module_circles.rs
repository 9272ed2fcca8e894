//! No modules of a crate use each other in a circle.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
};

use super::source_scan::{
    CRATES, absolute, code, sources, used_paths, without_test_files, without_tests,
};

/// The parts of modules that count as modules of their own.
const PARTS: [&str; 3] = ["api::http", "api::protocols", "api::routes"];

/// Returns the module of a path: its top module, or the part of it in [`PARTS`].
fn module_of(path: &str) -> String {
    let mut parts = PARTS.into_iter();
    let part = parts.find(|part| path == *part || path.starts_with(&format!("{part}::")));
    let top = || path.split("::").next().unwrap_or_default().to_owned();
    part.map_or_else(top, str::to_owned)
}

/// Returns the modules of a crate with the other modules that each uses.
fn modules(root: &str) -> BTreeMap<String, BTreeSet<String>> {
    let files = without_test_files(sources(root));
    let names: BTreeSet<_> = files.iter().map(|(module, _)| module_of(module)).collect();
    let mut rows: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for (module, path) in files {
        let text = fs::read_to_string(path).unwrap();
        let name = module_of(&module);
        let code = absolute(&module, &code(without_tests(&text)));
        let used = used_paths(&code).into_iter().map(|path| module_of(&path));
        // The root file of a module joins its parts.
        let used = used.filter(|used| {
            *used != name && names.contains(used) && !used.starts_with(&format!("{module}::"))
        });
        rows.entry(name.clone()).or_default().extend(used);
    }
    rows
}

#[test]
fn no_modules_use_each_other_in_a_circle() {
    for (_, root) in CRATES {
        let mut rows = modules(root);
        loop {
            let before = rows.len();
            let left: BTreeSet<_> = rows.keys().cloned().collect();
            for used in rows.values_mut() {
                used.retain(|name| left.contains(name));
            }
            rows.retain(|_, used| !used.is_empty());
            if rows.len() == before {
                break;
            }
        }
        assert!(rows.is_empty(), "{root}: {rows:#?}");
    }
}
