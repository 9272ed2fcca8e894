//! Listing and fetching models.

use std::{
    fs,
    io::{Read, Write},
    net::TcpListener,
    path::Path,
    thread,
};

use sha2::{Digest, Sha256};
use tempfile::{TempDir, tempdir};

use crate::{assert_fails_with, lookdown};

const WEIGHTS: &[u8] = b"weights of a converted model";

/// A repository with the manifest of `tiny`, whose weights are missing.
fn repository() -> TempDir {
    let folder = tempdir().unwrap();
    let model = folder.path().join("tiny");
    fs::create_dir(&model).unwrap();
    let sum = format!("{:x}", Sha256::digest(WEIGHTS));
    let manifest =
        format!("name = \"tiny\"\nonnx = \"model.onnx\"\nsha256 = \"{sum}\"\nlicence = \"MIT\"\n");
    fs::write(model.join("model.toml"), manifest).unwrap();
    folder
}

fn fetch(repository: &Path, name: &str, from: &str) -> std::process::Output {
    let repository = repository.to_str().unwrap();
    lookdown(
        &["model", "fetch", name, "--from", from],
        &[("LOOKDOWN__MODEL__REPOSITORY", repository)],
    )
}

fn listed(repository: &Path) -> String {
    let repository = repository.to_str().unwrap();
    let environment = [("LOOKDOWN__MODEL__REPOSITORY", repository)];
    let output = lookdown(&["model", "list"], &environment);
    assert!(output.status.success());
    String::from_utf8(output.stdout).unwrap()
}

/// Answers one request with the weights. Returns the address and the path of the request.
fn server() -> (String, thread::JoinHandle<String>) {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = format!("http://{}/converted/", listener.local_addr().unwrap());
    let served = thread::Builder::new().name("file-server".to_owned());
    let served = served.spawn(move || {
        let (mut stream, _) = listener.accept().unwrap();
        let mut request = [0; 4096];
        let length = stream.read(&mut request).unwrap();
        let head = format!(
            "HTTP/1.1 200 OK\r\nContent-Length: {}\r\n\r\n",
            WEIGHTS.len()
        );
        stream
            .write_all(&[head.as_bytes(), WEIGHTS].concat())
            .unwrap();
        let request = String::from_utf8_lossy(&request[..length]).into_owned();
        request.split(' ').nth(1).unwrap().to_owned()
    });
    (address, served.unwrap())
}

#[test]
fn weights_are_fetched_from_a_folder() {
    let (repository, source) = (repository(), tempdir().unwrap());
    assert!(listed(repository.path()).contains("missing  MIT"));
    for place in [source.path().join("tiny"), source.path().to_owned()] {
        fs::create_dir_all(&place).unwrap();
        fs::write(place.join("model.onnx"), WEIGHTS).unwrap();
        let output = fetch(repository.path(), "tiny", source.path().to_str().unwrap());
        assert!(output.status.success(), "{output:?}");
        let weights = repository.path().join("tiny/model.onnx");
        assert_eq!(fs::read(&weights).unwrap(), WEIGHTS);
        assert!(listed(repository.path()).contains("0.0 MiB  MIT"));
        fs::remove_file(place.join("model.onnx")).unwrap();
        fs::remove_file(weights).unwrap();
    }
}

#[test]
fn weights_are_fetched_over_http() {
    let (repository, (address, served)) = (repository(), server());
    let output = fetch(repository.path(), "tiny", &address);
    assert!(output.status.success(), "{output:?}");
    assert_eq!(served.join().unwrap(), "/converted/tiny/model.onnx");
    let weights = fs::read(repository.path().join("tiny/model.onnx"));
    assert_eq!(weights.unwrap(), WEIGHTS);
}

#[test]
fn other_weights_are_refused_and_change_nothing() {
    let (repository, source) = (repository(), tempdir().unwrap());
    fs::write(source.path().join("model.onnx"), b"other weights").unwrap();
    let from = source.path().to_str().unwrap();
    let output = fetch(repository.path(), "tiny", from);
    assert_fails_with(&output, &["SHA-256", "model.toml", "make models"]);
    let files = fs::read_dir(repository.path().join("tiny")).unwrap();
    let files: Vec<_> = files.map(|file| file.unwrap().file_name()).collect();
    assert_eq!(files, ["model.toml"]);
    let missing = fetch(repository.path(), "tiny", "http://127.0.0.1:9/models");
    assert_fails_with(&missing, &["127.0.0.1:9", "--from", "make models"]);
    let unknown = fetch(repository.path(), "huge", from);
    assert_fails_with(&unknown, &["huge", "tiny"]);
}

/// A folder with a network of random weights in the layout of YOLOX, without a manifest.
fn yolox_without_manifest() -> TempDir {
    let folder = tempdir().unwrap();
    let families = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/models/families");
    let model = folder.path().join("yolox_s.onnx");
    fs::copy(families.join("yolox/model.onnx"), model).unwrap();
    folder
}

#[test]
fn check_writes_a_manifest_and_warns_without_a_person() {
    let folder = yolox_without_manifest();
    let model = folder.path().join("yolox_s.onnx");
    let write = [
        "model",
        "check",
        "--write-manifest",
        model.to_str().unwrap(),
    ];
    let output = lookdown(&write, &[]);
    let warning = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success(), "{warning}");
    assert!(warning.contains("no plausible person"), "{warning}");
    let written = fs::read_to_string(folder.path().join("model.toml")).unwrap();
    let manifest = "name = \"yolox_s\"\nonnx = \"yolox_s.onnx\"\n\n[input]\n\n[output]\nhead = \
                    \"yolox\"\nperson_class = 0\n";
    assert_eq!(written, manifest);
    assert_fails_with(
        &lookdown(&write, &[]),
        &["--write-manifest", "model.toml exists"],
    );
}

#[test]
fn folder_without_a_manifest_names_the_command_that_writes_it() {
    let folder = yolox_without_manifest();
    let output = lookdown(&["model", "check", folder.path().to_str().unwrap()], &[]);
    let model = folder.path().join("yolox_s.onnx");
    let command = format!("lookdown model check --write-manifest {}", model.display());
    assert_fails_with(&output, &["model.toml", &command]);
}
