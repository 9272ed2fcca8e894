//! Listing models, and writing their manifests.

use std::{
    fs,
    path::{Path, PathBuf},
};

use tempfile::{TempDir, tempdir};

use crate::{assert_fails_with, lookdown};

#[test]
fn models_are_listed_with_their_size_and_license() {
    let repository = tempdir().unwrap();
    let model = repository.path().join("tiny");
    fs::create_dir(&model).unwrap();
    let manifest = "name = \"tiny\"\nonnx = \"model.onnx\"\nlicence = \"MIT\"\n";
    fs::write(model.join("model.toml"), manifest).unwrap();
    let listed = || {
        let folder = repository.path().to_str().unwrap();
        let environment = [("LOOKDOWN__MODEL__REPOSITORY", folder)];
        let output = lookdown(&["model", "list"], &environment);
        assert!(output.status.success());
        String::from_utf8(output.stdout).unwrap()
    };
    assert!(listed().contains("missing  MIT"));
    fs::write(model.join("model.onnx"), "weights").unwrap();
    assert!(listed().contains("0.0 MiB  MIT"));
}

/// Networks of random weights, each in the layout of a family.
fn families() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/models/families")
}

/// A folder with a copy of a network as `yolox_s.onnx`, without a manifest.
fn without_manifest(network: &Path) -> TempDir {
    let folder = tempdir().unwrap();
    fs::copy(network, folder.path().join("yolox_s.onnx")).unwrap();
    folder
}

fn write_manifest(folder: &TempDir) -> std::process::Output {
    let model = folder.path().join("yolox_s.onnx");
    let model = model.to_str().unwrap();
    lookdown(&["model", "check", "--write-manifest", model], &[])
}

#[test]
fn manifests_of_random_networks_are_written_with_a_warning() {
    let families = fs::read_dir(families()).unwrap();
    let families: Vec<_> = families.map(|family| family.unwrap().path()).collect();
    assert_eq!(families.len(), 6);
    for family in families {
        let folder = without_manifest(&family.join("model.onnx"));
        let output = write_manifest(&folder);
        let warning = String::from_utf8(output.stderr).unwrap();
        assert!(output.status.success(), "{warning}");
        let message = "no input finds the persons of the samples";
        assert!(warning.contains(message), "{family:?} {warning}");
    }
}

#[test]
fn manifest_of_a_network_that_detects_persons_has_its_input() {
    let installed =
        Path::new(env!("CARGO_MANIFEST_DIR")).join("models/nanodet_g_views_416/model.onnx");
    let folder = without_manifest(&installed);
    let output = write_manifest(&folder);
    let warning = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success(), "{warning}");
    assert!(!warning.contains("no input"), "{warning}");
    let printed = String::from_utf8(output.stdout).unwrap();
    assert!(printed.contains("model.toml (rgb, 0 to 255)"), "{printed}");
}

#[test]
fn a_manifest_is_written_once() {
    let folder = without_manifest(&families().join("yolox/model.onnx"));
    assert!(write_manifest(&folder).status.success());
    let written = fs::read_to_string(folder.path().join("model.toml")).unwrap();
    let manifest = "name = \"yolox_s\"\nonnx = \"yolox_s.onnx\"\n\n[input]\n\n[output]\nhead = \
                    \"yolox\"\nperson_class = 0\n";
    assert_eq!(written, manifest);
    assert_fails_with(
        &write_manifest(&folder),
        &["--write-manifest", "model.toml exists"],
    );
}

#[test]
fn folder_without_a_manifest_names_the_command_that_writes_it() {
    let folder = without_manifest(&families().join("yolox/model.onnx"));
    let output = lookdown(&["model", "check", folder.path().to_str().unwrap()], &[]);
    let model = folder.path().join("yolox_s.onnx");
    let command = format!("lookdown model check --write-manifest {}", model.display());
    assert_fails_with(&output, &["model.toml", &command]);
}
