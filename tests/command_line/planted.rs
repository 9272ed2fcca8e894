//! Files of the current folder that have the names of the installation's own.

use std::{fs, os::unix::fs::symlink, path::Path, process::Command};

use tempfile::tempdir;

/// Writes the program into `folder` as a package installs it, with files of its own.
fn install(folder: &Path) -> std::path::PathBuf {
    let program = folder.join("lookdown");
    fs::create_dir(folder).unwrap();
    fs::copy(env!("CARGO_BIN_EXE_lookdown"), &program).unwrap();
    let repository = Path::new(env!("CARGO_MANIFEST_DIR"));
    for name in ["runtime", "models"] {
        symlink(repository.join(name), folder.join(name)).unwrap();
    }
    program
}

/// Writes a library and a model whose use would be an error.
fn plant(folder: &Path) {
    fs::create_dir_all(folder.join("runtime")).unwrap();
    fs::write(folder.join("runtime/libonnxruntime.so"), "not a library").unwrap();
    fs::create_dir_all(folder.join("models/planted")).unwrap();
    let manifest = "name = \"planted\"\nonnx = \"model.onnx\"\n";
    fs::write(folder.join("models/planted/model.toml"), manifest).unwrap();
}

#[test]
fn a_library_in_the_current_folder_is_not_loaded() {
    let folder = tempdir().unwrap();
    let program = install(&folder.path().join("installed"));
    plant(folder.path());
    let model = folder.path().join("installed/models/nanodet_g_views_416");
    let output = Command::new(&program)
        .args(["model", "check", model.to_str().unwrap()])
        .current_dir(folder.path())
        .output()
        .unwrap();
    assert!(output.status.success(), "{output:?}");
}

#[test]
fn models_in_the_current_folder_are_not_used() {
    let folder = tempdir().unwrap();
    let program = install(&folder.path().join("installed"));
    plant(folder.path());
    let output = Command::new(&program)
        .args(["model", "list"])
        .current_dir(folder.path())
        .output()
        .unwrap();
    let listed = String::from_utf8(output.stdout).unwrap();
    assert!(listed.contains("nanodet_g_views_416"), "{listed}");
    assert!(!listed.contains("planted"), "{listed}");
}

#[test]
fn a_program_without_files_does_not_take_planted_ones() {
    let folder = tempdir().unwrap();
    let alone = folder.path().join("alone");
    fs::create_dir(&alone).unwrap();
    let program = alone.join("lookdown");
    fs::copy(env!("CARGO_BIN_EXE_lookdown"), &program).unwrap();
    plant(folder.path());
    let output = Command::new(&program)
        .args(["model", "list"])
        .current_dir(folder.path())
        .output()
        .unwrap();
    crate::assert_fails_with(
        &output,
        &["model.repository", "LOOKDOWN__MODEL__REPOSITORY"],
    );
}

#[test]
fn a_model_from_elsewhere_without_a_sum_gets_a_warning() {
    let folder = tempdir().unwrap();
    let model = folder.path().join("model.onnx");
    let shipped = Path::new(env!("CARGO_MANIFEST_DIR")).join("models/nanodet_g_views_416");
    fs::copy(shipped.join("model.onnx"), &model).unwrap();
    let detect = |model: &Path| {
        let sample = concat!(env!("CARGO_MANIFEST_DIR"), "/samples/office.jpg");
        let model = model.to_str().unwrap();
        let environment = [("LOOKDOWN__MODEL__PATH", model)];
        let output = crate::lookdown(&["detect", sample, "--profile", "direct"], &environment);
        assert!(output.status.success(), "{output:?}");
        String::from_utf8(output.stderr).unwrap()
    };
    assert!(detect(&model).contains("no sha256"));
    assert!(!detect(&shipped).contains("no sha256"));
}
