//! Local links and file names in the documents lead to files.

use std::{
    fs,
    path::{Path, PathBuf},
};

/// The folders whose files documents name in code style.
const FOLDERS: [&str; 8] = [
    "src/",
    "crates/",
    "tests/",
    "docs/",
    "docker/",
    "k8s/",
    "web/",
    "packaging/",
];

/// Adds the Markdown files of a folder.
fn documents(folder: &Path, found: &mut Vec<PathBuf>) {
    const SKIPPED: [&str; 5] = ["target", "node_modules", ".setup", ".git", "raw"];
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        if path.is_dir() && !path.is_symlink() && !SKIPPED.contains(&&*name) {
            documents(&path, found);
        } else if name.ends_with(".md") {
            found.push(path);
        }
    }
}

/// Returns the targets of the links in a text.
fn links(text: &str) -> impl Iterator<Item = &str> {
    text.split("](").skip(1).filter_map(|rest| {
        let target = rest.split(')').next()?;
        let is_local = !target.contains("://") && !target.starts_with(['#', '/', '<']);
        (is_local && !target.starts_with("mailto:")).then(|| target.split('#').next())?
    })
}

/// Returns the file names in code style, without those that stand for several.
fn named_files(text: &str) -> impl Iterator<Item = &str> {
    text.split('`').skip(1).step_by(2).filter(|name| {
        let is_plain = |c: char| c.is_ascii_alphanumeric() || "/._-".contains(c);
        FOLDERS.iter().any(|folder| name.starts_with(folder))
            && name.chars().all(is_plain)
            && name.contains('.')
    })
}

#[test]
fn local_links_and_named_files_exist() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut files = Vec::new();
    documents(root, &mut files);
    let mut missing = Vec::new();
    for file in files {
        let text = fs::read_to_string(&file).unwrap();
        let folder = file.parent().unwrap();
        let linked =
            links(&text).filter(|target| !target.is_empty() && !folder.join(target).exists());
        missing.extend(linked.map(|target| format!("{}: {target}", file.display())));
        let named = named_files(&text).filter(|name| !root.join(name).exists());
        missing.extend(named.map(|name| format!("{}: `{name}`", file.display())));
    }
    assert!(missing.is_empty(), "{}", missing.join("\n"));
}

#[test]
fn links_and_files_are_recognized() {
    let text = "[a](b.md#c) [d](https://e) [f](#g) `src/x.rs` `src/*.rs` `crates/a/b`";
    assert_eq!(links(text).collect::<Vec<_>>(), ["b.md"]);
    assert_eq!(named_files(text).collect::<Vec<_>>(), ["src/x.rs"]);
}
