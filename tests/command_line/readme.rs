//! The commands of the README, in a folder with the samples, against a server with the default
//! models, and the commands and requests of the other pages as far as they can be read alone.

use std::{
    env, fs,
    os::unix::fs::symlink,
    path::Path,
    process::{Command, Stdio},
};

use serde_json::Value;
use tempfile::tempdir;

use crate::serve::{NO_GRACE, Server};

const README: &str = include_str!("../../README.md");
const ROOT: &str = env!("CARGO_MANIFEST_DIR");

/// The indented lines outside of fences, without comments.
fn commands() -> Vec<&'static str> {
    let outside = README.split("```").step_by(2).flat_map(str::lines);
    let indented = outside.filter_map(|line| line.strip_prefix("    "));
    indented
        .map(|line| line.split(" # ").next().unwrap_or(line).trim())
        .collect()
}

/// The output of a command in `folder`. Commands that do not end by themselves print their help.
fn output_of(command: &str, folder: &Path, address: &str) -> Vec<u8> {
    let command = command
        .replace("localhost:8080", address.strip_prefix("http://").unwrap())
        .replace("target/quick/lookdown", env!("CARGO_BIN_EXE_lookdown"));
    let ends = !command.contains(" run ");
    let script = if ends {
        command
    } else {
        format!("{command} --help")
    };
    let output = Command::new("sh")
        .args(["-ec", &script])
        .current_dir(folder)
        .output()
        .unwrap();
    assert!(output.status.success(), "{script}: {output:?}");
    output.stdout
}

#[test]
fn commands_of_the_readme_run_and_answer_as_shown() {
    let makefile = fs::read_to_string(Path::new(ROOT).join("Makefile")).unwrap();
    let server = Server::start("unset LOOKDOWN__MODEL__PATH", &[NO_GRACE]);
    let folder = tempdir().unwrap();
    symlink(
        Path::new(ROOT).join("samples"),
        folder.path().join("samples"),
    )
    .unwrap();
    let mut answers = Vec::new();
    for command in commands() {
        match command.split_once(' ').unwrap() {
            ("make", target) => assert!(makefile.contains(&format!("\n{target}: "))),
            ("apt-get", _) => {}
            _ => answers.push(output_of(command, folder.path(), &server.address())),
        }
    }
    assert_eq!(answers.len(), 5);
    let annotated = fs::read(folder.path().join("annotated.jpg")).unwrap();
    assert!(annotated.starts_with(&[0xff, 0xd8]), "no JPEG");

    let shown = README.split("```json").nth(1).unwrap();
    let shown: Value = serde_json::from_str(shown.split("```").next().unwrap()).unwrap();
    let report: Value = serde_json::from_slice(&answers[0]).unwrap();
    assert_eq!(report["persons"].as_array().unwrap().len(), 6);
    let (shown, first) = (&shown["persons"][0], &report["persons"][0]);
    let near = |path: &str, within: f64| {
        let [a, b] = [shown, first].map(|person| person.pointer(path).unwrap().as_f64().unwrap());
        assert!((a - b).abs() <= within, "{path}: {a} and {b}");
    };
    for side in ["x_min", "y_min", "x_max", "y_max"] {
        near(&format!("/box/{side}"), 2.0);
    }
    near("/score", 0.03);
}

/// The commands of a page of docs/ that begin with one of the `programs`, joined over continued
/// lines, without comments.
fn commands_of_page(page: &str, programs: &[&str]) -> Vec<String> {
    let joined = page.replace("\\\n", " ");
    let mut found = Vec::new();
    for line in joined.lines() {
        let line = line.strip_prefix("    ").unwrap_or(line);
        let line = line.split(" # ").next().unwrap_or(line).trim();
        let mut words = line.split(' ');
        let program = words.find(|word| !word.contains('=') || word.contains('/'));
        if program.is_some_and(|program| programs.contains(&program)) {
            found.push(line.to_owned());
        }
    }
    found
}

fn pages() -> Vec<(String, String)> {
    let mut pages = Vec::new();
    for entry in fs::read_dir(Path::new(ROOT).join("docs")).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|extension| extension == "md") {
            let name = path.file_name().unwrap().to_string_lossy().into_owned();
            pages.push((name, fs::read_to_string(path).unwrap()));
        }
    }
    pages
}

#[test]
fn commands_of_all_pages_have_known_options() {
    let program = Path::new(env!("CARGO_BIN_EXE_lookdown"));
    let system = env::var("PATH").unwrap();
    let path = format!("{}:{system}", program.parent().unwrap().display());
    let mut tried = 0;
    for (page, text) in pages() {
        for command in commands_of_page(&text, &["lookdown"]) {
            let (command, _) = command.split_once(" > ").unwrap_or((&command, ""));
            let command = command.replace("FILE|FOLDER", "FOLDER");
            let output = Command::new("sh")
                .args(["-c", &format!("{command} --help")])
                .env("PATH", &path)
                .stdin(Stdio::null())
                .output()
                .unwrap();
            let said = String::from_utf8_lossy(&output.stderr);
            assert!(output.status.success(), "{page}: {command}: {said}");
            tried += 1;
        }
    }
    assert!(tried > 25, "{tried} commands");
}

#[test]
fn requests_of_all_pages_are_in_the_openapi_document() {
    let document = fs::read(Path::new(ROOT).join("openapi/openapi.json")).unwrap();
    let document: Value = serde_json::from_slice(&document).unwrap();
    let counts = fs::read(Path::new(ROOT).join("openapi/counts.json")).unwrap();
    let counts: Value = serde_json::from_slice(&counts).unwrap();
    let mut tried = 0;
    for (page, text) in pages() {
        for command in commands_of_page(&text, &["curl"]) {
            let Some((_, request)) = command.split_once("localhost:8080") else {
                continue;
            };
            let path = request.split(['?', ' ', '\'', '"']).next().unwrap();
            let mut words = command.split(' ');
            let method = if words.clone().any(|word| word == "-T") {
                "put"
            } else if words.clone().any(|word| word == "-F") {
                "post"
            } else if words.any(|word| word == "-X") {
                words.next().unwrap()
            } else {
                "get"
            };
            let has_route = |document: &Value| {
                let routes = document["paths"].as_object().unwrap();
                routes.iter().any(|(route, methods)| {
                    is_of_route(path, route) && methods.get(method.to_lowercase()).is_some()
                })
            };
            assert!(
                has_route(&document) || has_route(&counts),
                "{page}: {command}: no route {method} {path}"
            );
            tried += 1;
        }
    }
    assert!(tried > 20, "{tried} requests");
}

/// Returns true if `path` is one of those of a route with names in braces.
fn is_of_route(path: &str, route: &str) -> bool {
    let (path, route) = (path.split('/'), route.split('/'));
    path.clone().count() == route.clone().count()
        && path
            .zip(route)
            .all(|(word, name)| word == name || name.starts_with('{'))
}
