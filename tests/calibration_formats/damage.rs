//! Damaged files are refused or read, and never bring the program down.

use lookdown::calibration::CalibrationFile;
use proptest::prelude::*;

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
        // Every place in the smaller files, enough of them in the larger.
        let step = content.len() / 300 + 1;
        for length in (0..content.len()).step_by(step) {
            survives(&content[..length]);
        }
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
