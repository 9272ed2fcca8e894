//! Damaged files are refused or read, and never crash the program.

use std::sync::Arc;

use lookdown::calibration_store::{Calibrations, FolderStore, Reading, WriteCondition};
use lookdown_calibration::CalibrationFile;
use proptest::prelude::*;

use crate::calibration_formats::refusal;

/// Every calibration file of the fixtures.
fn files() -> Vec<Vec<u8>> {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/fixtures/calibrations");
    let paths = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path());
    let files = paths.filter(|path| path.extension().is_some_and(|ending| ending != "py"));
    files.map(|path| std::fs::read(path).unwrap()).collect()
}

fn survives(content: &[u8]) {
    if let Ok(file) = CalibrationFile::parse(content) {
        assert!(!file.calibrations("x", content).is_empty());
    }
}

#[test]
fn files_cut_short_anywhere_are_refused_or_read() {
    for content in files() {
        // Every position in the smaller files, and a sample of positions in the larger ones.
        let step = content.len() / 300 + 1;
        for length in (0..content.len()).step_by(step) {
            survives(&content[..length]);
        }
    }
}

#[test]
fn a_file_of_too_many_values_is_refused_before_they_take_memory() {
    // Such a file took half a gibibyte of tables when it was read.
    let lines = (0..8_000).map(|line| format!("a{line}{}=1\n", ".b".repeat(60)));
    let tables = lines.collect::<Vec<_>>().concat();
    let maps = format!("{{\"a\":[{}0]}}", "{\"\":0},".repeat(100_000));
    for content in [tables, maps] {
        let refusal = refusal(content.as_bytes());
        assert!(refusal.contains("more than 100000 values"), "{refusal}");
    }
}

#[test]
fn a_refusal_quotes_little_of_a_large_file() {
    let long = "x".repeat(1_000_000);
    let file = r#"{"id":"a","image":{"width":640,"height":640},"lens":{"model":"ucm"},"more":0}"#;
    let camera = r#"{"camera_model":"ds","intrinsics":[]}"#;
    for content in [
        file.replace("more", &long),
        file.replace("ucm", &long),
        format!(r#"{{"{long}":{camera}}}"#),
    ] {
        let refusal = refusal(content.as_bytes());
        assert!(refusal.len() < 4_000, "{} bytes", refusal.len());
    }
    let content = file.replace(
        r#""ucm""#,
        r#""equidistant","focal":200,"cx":319.5,"cy":319.5"#,
    );
    let content = content
        .replace(r#","more":0"#, "")
        .replace(r#""a""#, &format!("{long:?}"));
    let file = CalibrationFile::parse(content.as_bytes()).unwrap();
    let (_, checked) = file.calibrations("x", content.as_bytes()).remove(0);
    assert!(checked.unwrap_err().to_string().len() < 4_000);
}

#[test]
fn an_error_about_ambiguous_cameras_truncates_their_names() {
    let folder = tempfile::tempdir().unwrap();
    let store = Box::new(FolderStore::new(folder.path()));
    let calibrations = Calibrations::open(store, true, Arc::default()).unwrap();
    let long = "x".repeat(400_000);
    let camera = r#"{"camera_model":"ds","intrinsics":[]}"#;
    let content = format!(r#"{{"a{long}":{camera},"b{long}":{camera}}}"#);
    let id = "lobby".parse().unwrap();
    for camera in [None, Some(long)] {
        let reading = Reading { camera, size: None };
        let put = calibrations.put(&id, content.as_bytes(), &reading, &WriteCondition::Always);
        let refusal = put.unwrap_err().to_string();
        assert!(refusal.contains("bxxx"), "{refusal:.200}");
        assert!(refusal.len() < 400, "{} bytes", refusal.len());
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn changed_bytes_are_refused_or_read(
        file in prop::sample::select(files()),
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6),
    ) {
        let mut content = file;
        for (place, byte) in changes {
            let place = place.index(content.len());
            content[place] = byte;
        }
        survives(&content);
    }

    #[test]
    fn changed_numbers_are_refused_or_read(
        file in prop::sample::select(files()),
        place in any::<prop::sample::Index>(),
        number in prop::sample::select(vec!["nan", "-1e308", "1e999", "0", "-0.0", "1e-320", "4294967296", "[]", "null"]),
    ) {
        let text = String::from_utf8(file).unwrap();
        let digits: Vec<_> = text.match_indices(|c: char| c.is_ascii_digit()).collect();
        let (start, _) = digits[place.index(digits.len())];
        let end = text[start..]
            .find(|c: char| !(c.is_ascii_digit() || matches!(c, '.' | 'e' | '-')))
            .map_or(text.len(), |length| start + length);
        survives(format!("{}{number}{}", &text[..start], &text[end..]).as_bytes());
    }

    #[test]
    fn anything_is_refused_or_read(content in prop::collection::vec(any::<u8>(), 0..400)) {
        survives(&content);
    }
}
