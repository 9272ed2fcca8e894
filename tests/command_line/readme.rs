//! The commands of the README, in a folder with the samples, against a server with the default
//! models.

use std::{fs, os::unix::fs::symlink, path::Path, process::Command};

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
