//! Replays the seeds of the fuzzers. `docs/lab/reliability.md` describes how the fuzzers are run.

#[path = "../../lab/fuzz/src/lib.rs"]
mod targets;

use std::{fs, path::Path};

use targets::{image_file, importer, merge, request, settings};

/// Passes every file below `folder` to `read`. Returns the number of files that were accepted as
/// valid.
fn replay(folder: &str, read: impl Fn(&[u8]) -> bool) -> usize {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join(folder);
    let Ok(entries) = fs::read_dir(&folder) else {
        return 0;
    };
    let files = entries.map(|entry| entry.unwrap().path());
    files.filter(|file| read(&fs::read(file).unwrap())).count()
}

/// Replays the seeds of one target, and the files of `folders`.
fn replay_all(name: &str, folders: &[&str], read: impl Fn(&[u8]) -> bool) {
    let seeds = format!("lab/fuzz/seeds/{name}");
    let folders = [&*seeds].into_iter().chain(folders.iter().copied());
    let taken: usize = folders.map(|folder| replay(folder, &read)).sum();
    assert!(taken > 0, "{name}: no input reached the fuzzed code");
}

#[test]
fn every_importer_survives_its_seeds() {
    for (name, format) in importer::IMPORTERS {
        let fixtures = ["tests/fixtures/calibrations", "samples/calibrations"];
        replay_all(name, &fixtures, |content| importer::read(format, content));
    }
}

#[test]
fn decoding_survives_its_seeds() {
    replay_all("image_file", &["tests/fixtures/images"], image_file::read);
}

#[test]
fn the_service_survives_its_seeds() {
    replay_all("request", &[], request::read);
}

#[test]
fn settings_survive_their_seeds() {
    replay_all("settings", &[], settings::read);
}

#[test]
fn merging_survives_its_seeds() {
    replay_all("merge", &[], merge::read);
}
