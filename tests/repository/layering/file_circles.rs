//! No files use each other in a circle. A name that a module re-exports counts as a use of the file
//! that defines it.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::Path,
};

use super::source_scan::{CRATES, absolute, code, collect_paths, sources, without_tests};

/// Most re-exports that are followed from a name to its file.
const MAX_REEXPORTS: usize = 12;

/// The code of one file without its tests.
struct Source {
    /// The paths of its private imports, and those in its code.
    used: BTreeSet<String>,
    /// The absolute paths of all its imports by their names.
    imports: BTreeMap<String, String>,
}

/// Separates the imports of a file, each with `true` if it is private, from the rest of its code.
fn imports_and_rest(code: &str) -> (Vec<(bool, String)>, String) {
    let (mut imports, mut rest) = (Vec::new(), String::new());
    let mut lines = code.lines();
    while let Some(line) = lines.next() {
        let is_private = line.trim_start().starts_with("use ");
        let is_reexport = line.trim_start().starts_with("pub") && line.contains(" use ");
        if !is_private && !is_reexport {
            rest.push_str(line);
            rest.push('\n');
            continue;
        }
        let mut import = line.split_once("use ").unwrap().1.to_owned();
        while !import.contains(';') {
            import.push_str(lines.next().unwrap());
        }
        imports.push((is_private, import));
    }
    (imports, rest)
}

/// Returns the absolute path of a path in a module, without `crate::`. `None` for other crates.
fn absolute_path(module: &str, path: &str, modules: &BTreeSet<String>) -> Option<String> {
    if let Some(path) = path.strip_prefix("crate::") {
        return Some(path.to_owned());
    }
    let path = path.strip_prefix("self::").unwrap_or(path);
    let first = path.split("::").next()?;
    if module.is_empty() {
        return modules.contains(first).then(|| path.to_owned());
    }
    let is_part = modules.contains(&format!("{module}::{first}"));
    is_part.then(|| format!("{module}::{path}"))
}

fn read(module: &str, text: &str, modules: &BTreeSet<String>) -> Source {
    let code = absolute(module, &code(without_tests(text)));
    let (statements, rest) = imports_and_rest(&code);
    let (mut used, mut imports) = (BTreeSet::new(), BTreeMap::new());
    for (is_private, import) in statements {
        let mut paths = BTreeSet::new();
        collect_paths(&import, "", &mut paths);
        for path in paths {
            let Some(path) = absolute_path(module, &path, modules) else {
                continue;
            };
            let name = path.rsplit("::").next().unwrap_or_default().to_owned();
            if is_private {
                used.insert(path.clone());
            }
            imports.insert(name, path);
        }
    }
    // Visibilities are not uses, and the paths of a macro belong to the file that calls it.
    let rest = rest.replace("(in crate::", "(").replace("$crate::", "$");
    let is_part_of_path = |c: char| c.is_alphanumeric() || c == '_' || c == ':';
    for path in rest.split(|c| !is_part_of_path(c)) {
        let path = path.trim_end_matches(':');
        let (first, below) = path.split_once("::").unwrap_or((path, ""));
        match imports.get(first) {
            Some(imported) if !below.is_empty() => {
                used.insert(format!("{imported}::{below}"));
            }
            _ if path.contains("::") => used.extend(absolute_path(module, path, modules)),
            _ => {}
        }
    }
    Source { used, imports }
}

/// Returns the file that defines a path.
fn file_of(path: &str, sources: &BTreeMap<String, Source>, left: usize) -> Option<String> {
    let mut file = String::new();
    for (start, name) in path
        .split("::")
        .map(|name| (name.as_ptr() as usize - path.as_ptr() as usize, name))
    {
        let end = start + name.len();
        if sources.contains_key(&path[..end]) {
            path[..end].clone_into(&mut file);
            continue;
        }
        let reexported = sources.get(&file)?.imports.get(name);
        let target = reexported.filter(|target| **target != path[..end] && left > 0);
        return match target {
            Some(target) => file_of(&format!("{target}{}", &path[end..]), sources, left - 1),
            None => Some(file),
        };
    }
    Some(file)
}

#[test]
fn no_files_use_each_other_in_a_circle() {
    let circles: Vec<_> = CRATES
        .into_iter()
        .map(|(_, root)| files_in_circles(root))
        .collect();
    assert!(
        circles.iter().all(BTreeMap::is_empty),
        "define the shared types in a file of their own: {circles:#?}"
    );
}

/// Returns the files of a crate that use each other in circles, with the files that they use.
fn files_in_circles(root: &str) -> BTreeMap<String, BTreeSet<String>> {
    let mut texts: Vec<_> = sources(root)
        .into_iter()
        .map(|(module, path)| (module, fs::read_to_string(path).unwrap()))
        .collect();
    // The root of the crate, whose re-exports lead to files.
    let lib = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join(root)
        .join("lib.rs");
    texts.extend(
        fs::read_to_string(lib)
            .ok()
            .map(|text| (String::new(), text)),
    );
    // Modules of tests, and those below them.
    let mut test_modules = Vec::new();
    for (module, text) in &texts {
        for after in text.split("#[cfg(test)]\n").skip(1) {
            let declared = after.lines().next().unwrap_or_default();
            let name = declared.rsplit("mod ").next().unwrap_or_default();
            if let Some(name) = name.strip_suffix(';') {
                let path = format!("{module}::{name}");
                test_modules.push(path.trim_start_matches("::").to_owned());
            }
        }
    }
    let is_test = |module: &str| {
        test_modules
            .iter()
            .any(|test| module == test || module.starts_with(&format!("{test}::")))
    };
    let modules: BTreeSet<_> = texts.iter().map(|(module, _)| module.clone()).collect();
    let sources: BTreeMap<_, _> = texts
        .iter()
        .filter(|(module, _)| !is_test(module))
        .map(|(module, text)| (module.clone(), read(module, text, &modules)))
        .collect();
    let mut uses: BTreeMap<_, BTreeSet<_>> = sources
        .iter()
        .map(|(module, source)| {
            let files = source
                .used
                .iter()
                .filter_map(|path| file_of(path, &sources, MAX_REEXPORTS));
            (
                module.clone(),
                files.filter(|file| file != module).collect(),
            )
        })
        .collect();
    // A file that uses no other file is in no circle.
    loop {
        let before = uses.len();
        let left: BTreeSet<_> = uses.keys().cloned().collect();
        for files in uses.values_mut() {
            files.retain(|file| left.contains(file));
        }
        let targets: BTreeSet<_> = uses.values().flatten().cloned().collect();
        uses.retain(|file, files| !files.is_empty() && targets.contains(file));
        if uses.len() == before {
            return uses;
        }
    }
}
