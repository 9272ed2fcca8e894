//! Environment variables that the documentation and the configuration files name.

use std::{collections::BTreeSet, fs, path::Path};

use lookdown::settings::load;

/// The folders and files that tell users how to set variables.
const PLACES: [&str; 11] = [
    "CONTRIBUTING.md",
    "Makefile",
    "README.md",
    "SECURITY.md",
    "docker",
    "docs",
    "k8s",
    "lab/benches",
    "lab/training",
    "packaging",
    "web",
];
const PREFIX: &str = "LOOKDOWN__";

/// Adds the variables in a file, or in the files of a folder, with the file.
fn collect(path: &Path, found: &mut BTreeSet<(String, String)>) {
    if path.is_dir() {
        for entry in fs::read_dir(path).unwrap() {
            collect(&entry.unwrap().path(), found);
        }
        return;
    }
    let text = fs::read(path).unwrap();
    let text = String::from_utf8_lossy(&text);
    for (start, _) in text.match_indices(PREFIX) {
        let is_name = |c: char| c.is_ascii_uppercase() || c.is_ascii_digit() || c == '_';
        let name = &text[start..];
        let name = &name[..name.find(|c| !is_name(c)).unwrap_or(name.len())];
        // `LOOKDOWN__…` stands for every setting.
        if name != PREFIX {
            found.insert((name.to_owned(), path.display().to_string()));
        }
    }
}

#[test]
fn every_documented_variable_is_a_setting() {
    let mut found = BTreeSet::new();
    for place in PLACES {
        collect(
            &Path::new(env!("CARGO_MANIFEST_DIR")).join(place),
            &mut found,
        );
    }
    assert!(found.len() > 50, "{}", found.len());
    for (name, file) in found {
        // Only the name is checked: an empty value counts as not set, or is refused.
        let refused = load(None, [(name.clone(), String::new())]).err();
        let problem = refused.map_or_else(String::new, |error| error.to_string());
        // An example of a wrong name says so.
        let is_unknown = problem.contains("there is no") || problem.contains("rename it");
        assert!(!is_unknown, "{file}: {problem}");
    }
}
