//! Listing and fetching models.

use std::{
    fs,
    io::{Cursor, Read, Write},
    net::TcpListener,
    path::{Path, PathBuf},
    thread,
};

use sha2::{Digest, Sha256};
use tempfile::{TempDir, tempdir};
use zip::{ZipWriter, write::SimpleFileOptions};

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

/// Answers each request with the weights after this number of redirections. Returns the address,
/// and the paths of the requests once the last one is answered.
fn server(redirections: usize, location: &str) -> (String, thread::JoinHandle<Vec<String>>) {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = format!("http://{}/converted/", listener.local_addr().unwrap());
    let moved = format!(
        "HTTP/1.1 302 Found\r\nLocation: {location}\r\nContent-Length: 0\r\nConnection: close\r\n\r\n"
    );
    let found = format!(
        "HTTP/1.1 200 OK\r\nContent-Length: {}\r\nConnection: close\r\n\r\n",
        WEIGHTS.len()
    );
    let answers =
        std::iter::repeat_n(moved.into_bytes(), redirections)
            .chain([[found.as_bytes(), WEIGHTS].concat()]);
    let served = thread::Builder::new().name("file-server".to_owned());
    let served = served.spawn(move || {
        let answer_one = |answer: Vec<u8>| {
            let (mut stream, _) = listener.accept().unwrap();
            let mut request = [0; 4096];
            let length = stream.read(&mut request).unwrap();
            stream.write_all(&answer).unwrap();
            let request = String::from_utf8_lossy(&request[..length]).into_owned();
            request.split(' ').nth(1).unwrap().to_owned()
        };
        answers.map(answer_one).collect()
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
    let (repository, (address, served)) = (repository(), server(0, ""));
    let output = fetch(repository.path(), "tiny", &address);
    assert!(output.status.success(), "{output:?}");
    assert_eq!(served.join().unwrap(), ["/converted/tiny/model.onnx"]);
    let weights = fs::read(repository.path().join("tiny/model.onnx"));
    assert_eq!(weights.unwrap(), WEIGHTS);
}

#[test]
fn weights_are_fetched_from_another_path_of_the_same_host() {
    let (repository, (address, served)) = (repository(), server(1, "/moved"));
    let output = fetch(repository.path(), "tiny", &address);
    assert!(output.status.success(), "{output:?}");
    assert_eq!(
        served.join().unwrap(),
        ["/converted/tiny/model.onnx", "/moved"]
    );
}

#[test]
fn redirections_to_another_host_or_without_end_are_refused() {
    let other = TcpListener::bind("127.0.0.1:0").unwrap();
    other.set_nonblocking(true).unwrap();
    let location = format!("http://{}/tiny/model.onnx", other.local_addr().unwrap());
    let repository = repository();
    let (address, _) = server(1, &location);
    let output = fetch(repository.path(), "tiny", &address);
    assert_fails_with(&output, &["redirects to another host"]);
    assert!(other.accept().is_err(), "the other host got a request");
    let (address, _) = server(100, "/moved");
    let output = fetch(repository.path(), "tiny", &address);
    assert_fails_with(&output, &["too many redirections"]);
    let files = fs::read_dir(repository.path().join("tiny")).unwrap();
    assert_eq!(files.count(), 1);
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
        Path::new(env!("CARGO_MANIFEST_DIR")).join("models/nanodet_g_views_416_int8/model.onnx");
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

/// A network in the layout of the published `RTMDet`, with suppression of overlaps inside.
fn published() -> Vec<u8> {
    let fixtures = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/models");
    fs::read(fixtures.join("rtmdet_end2end/model.onnx")).unwrap()
}

/// An archive with the published network, and `members` of the same name.
fn archive(members: &[&str]) -> Vec<u8> {
    let mut archive = ZipWriter::new(Cursor::new(Vec::new()));
    for member in members {
        let options = SimpleFileOptions::default();
        archive.start_file(*member, options).unwrap();
        archive.write_all(&published()).unwrap();
    }
    archive.finish().unwrap().into_inner()
}

/// A repository with the manifest of `rtmdet`, and a mirror with the content of its archive.
fn with_upstream(sum: Option<&str>, content: &[u8]) -> (TempDir, TempDir) {
    let (repository, mirror) = (tempdir().unwrap(), tempdir().unwrap());
    fs::create_dir(repository.path().join("rtmdet")).unwrap();
    fs::create_dir(mirror.path().join("rtmdet")).unwrap();
    let sum = sum.map_or_else(String::new, |sum| format!("sha256 = \"{sum}\"\n"));
    let manifest = format!(
        "name = \"rtmdet\"\nonnx = \"model.onnx\"\n[output]\nhead = \"boxes_scores\"\nboxes = \
         \"1442\"\nscores = \"1415\"\n[upstream]\nurl = \"https://127.0.0.1:9/files/net.zip\"\n\
         member = \"end2end.onnx\"\ncut = true\n{sum}"
    );
    fs::write(repository.path().join("rtmdet/model.toml"), manifest).unwrap();
    fs::write(mirror.path().join("rtmdet/net.zip"), content).unwrap();
    (repository, mirror)
}

fn files_of(repository: &TempDir) -> Vec<std::ffi::OsString> {
    let files = fs::read_dir(repository.path().join("rtmdet")).unwrap();
    let mut files: Vec<_> = files.map(|file| file.unwrap().file_name()).collect();
    files.sort();
    files
}

/// Runs `model check` on the installed model.
fn check(repository: &TempDir) -> std::process::Output {
    let folder = repository.path().join("rtmdet");
    lookdown(&["model", "check", folder.to_str().unwrap()], &[])
}

#[test]
fn published_archive_is_cut_and_loads() {
    let sum = format!("{:x}", Sha256::digest(published()));
    let content = archive(&["2023/README", "2023/rtmdet/end2end.onnx"]);
    let (repository, mirror) = with_upstream(Some(&sum), &content);
    assert!(listed(repository.path()).contains("missing  -  (lookdown model fetch rtmdet)"));
    let output = fetch(repository.path(), "rtmdet", mirror.path().to_str().unwrap());
    assert!(output.status.success(), "{output:?}");
    let printed = String::from_utf8(output.stdout).unwrap();
    assert!(printed.contains(&sum), "{printed}");
    assert!(printed.contains("office.jpg: "), "{printed}");
    let checked = check(&repository);
    assert!(checked.status.success(), "{checked:?}");
    let description = String::from_utf8(checked.stdout).unwrap();
    assert!(description.contains("1442"), "{description}");
    assert!(!description.contains("dets"), "{description}");
}

#[test]
fn changed_file_of_an_installed_model_is_refused() {
    let sum = format!("{:x}", Sha256::digest(published()));
    let (repository, mirror) = with_upstream(Some(&sum), &archive(&["end2end.onnx"]));
    let output = fetch(repository.path(), "rtmdet", mirror.path().to_str().unwrap());
    assert!(output.status.success(), "{output:?}");
    fs::write(repository.path().join("rtmdet/model.onnx"), published()).unwrap();
    assert_fails_with(&check(&repository), &["SHA-256", &sum]);
}

#[test]
fn published_file_without_a_known_sum_needs_the_accepted_one() {
    let sum = format!("{:x}", Sha256::digest(published()));
    let (repository, mirror) = with_upstream(None, &archive(&["end2end.onnx"]));
    let from = mirror.path().to_str().unwrap();
    let refused = fetch(repository.path(), "rtmdet", from);
    assert_fails_with(&refused, &[&format!("--accept-sha256 {sum}")]);
    assert_eq!(files_of(&repository), ["model.toml"]);
    let accept = |sum: &str| {
        let arguments = ["model", "fetch", "rtmdet", "--from", from];
        let arguments = [&arguments[..], &["--accept-sha256", sum]].concat();
        let repository = repository.path().to_str().unwrap();
        lookdown(&arguments, &[("LOOKDOWN__MODEL__REPOSITORY", repository)])
    };
    assert_fails_with(&accept(&"0".repeat(64)), &["--accept-sha256", &sum]);
    let accepted = accept(&sum);
    assert!(accepted.status.success(), "{accepted:?}");
    assert_eq!(
        files_of(&repository),
        ["model.onnx", "model.onnx.sha256", "model.toml"]
    );
}

#[test]
fn unusable_published_file_is_refused_and_changes_nothing() {
    let sum = format!("{:x}", Sha256::digest(published()));
    let ambiguous = archive(&["a/end2end.onnx", "b/end2end.onnx"]);
    let other_sum = "0".repeat(64);
    for (content, wanted, causes) in [
        (ambiguous, &sum, ["end2end.onnx", "upstream"]),
        (published(), &sum, ["archive", "upstream"]),
        (
            archive(&["end2end.onnx"]),
            &other_sum,
            ["SHA-256", &other_sum],
        ),
    ] {
        let (repository, mirror) = with_upstream(Some(wanted), &content);
        let from = mirror.path().to_str().unwrap();
        assert_fails_with(&fetch(repository.path(), "rtmdet", from), &causes);
        assert_eq!(files_of(&repository), ["model.toml"]);
    }
}

#[test]
fn fetch_without_a_place_uses_the_address_of_the_manifest() {
    let (repository, _mirror) = with_upstream(None, b"");
    let folder = repository.path().to_str().unwrap();
    let environment = [("LOOKDOWN__MODEL__REPOSITORY", folder)];
    let output = lookdown(&["model", "fetch", "rtmdet"], &environment);
    assert_fails_with(&output, &["https://127.0.0.1:9/files/net.zip"]);
}
