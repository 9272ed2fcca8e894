//! The files of a store that are calibrations, and their IDs.

use std::collections::BTreeMap;

use lookdown_calibration::CalibrationId;

use crate::calibration_store::ListedFile;

/// File endings that are read; of several files of one ID the first in this order counts.
const ENDINGS: [&str; 6] = ["json", "yaml", "yml", "toml", "xml", "txt"];

/// The file of an ID.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct NamedFile {
    /// The file that counts.
    pub(super) file: ListedFile,
    /// Names of files of the same ID that it hides.
    pub(super) hidden: Vec<String>,
}

/// The name of the files that are written.
pub(super) fn written_name(id: &CalibrationId) -> String {
    format!("{id}.{}", ENDINGS[0])
}

/// The files that are called `<id>.<ending>`; others are none of ours.
pub(super) fn by_id(files: Vec<ListedFile>) -> BTreeMap<CalibrationId, NamedFile> {
    let mut ranked: Vec<_> = files
        .into_iter()
        .filter_map(|file| {
            let (stem, ending) = file.name.rsplit_once('.')?;
            let rank = ENDINGS.iter().position(|known| *known == ending)?;
            Some((stem.parse::<CalibrationId>().ok()?, rank, file))
        })
        .collect();
    ranked.sort_by(|(left, left_rank, _), (right, right_rank, _)| {
        (left, left_rank).cmp(&(right, right_rank))
    });
    let mut named: BTreeMap<CalibrationId, NamedFile> = BTreeMap::new();
    for (id, _, file) in ranked {
        if let Some(first) = named.get_mut(&id) {
            first.hidden.push(file.name);
        } else {
            let hidden = Vec::new();
            named.insert(id, NamedFile { file, hidden });
        }
    }
    named
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_without_an_id_are_skipped_and_endings_are_ranked() {
        let names = [
            "lobby.yaml",
            "lobby.json",
            "..data",
            "README.md",
            "Hall.json",
            ".lobby.json.1-0.lookdown-unfinished",
            "yard.txt",
        ];
        let files = names.map(|name| ListedFile {
            name: name.to_owned(),
            stamp: String::new(),
        });
        let files_by_id = by_id(files.to_vec());
        let found: Vec<_> = files_by_id
            .iter()
            .map(|(id, named)| (id.as_str(), named.file.name.as_str(), named.hidden.clone()))
            .collect();
        assert_eq!(
            found,
            [
                ("lobby", "lobby.json", vec!["lobby.yaml".to_owned()]),
                ("yard", "yard.txt", vec![]),
            ]
        );
    }
}
