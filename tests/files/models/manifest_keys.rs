//! The table of the keys of manifests in the documentation.

use std::{collections::BTreeSet, fs};

use lookdown_detect::inference::{ModelManifest, heads::Head};

use crate::models::folder::in_repository;

/// The words in backticks.
fn quoted(text: &str) -> impl Iterator<Item = String> {
    text.split('`').skip(1).step_by(2).map(ToOwned::to_owned)
}

/// The keys that the reader of a manifest expects, from its message about an unknown key.
fn expected<T: serde::de::DeserializeOwned>(text: &str) -> Vec<String> {
    let Err(error) = toml::from_str::<T>(text) else {
        panic!("{text:?} is a manifest");
    };
    let message = error.message().to_owned();
    let (_, keys) = message.split_once("expected").unwrap();
    quoted(keys).collect()
}

#[test]
fn the_table_has_each_key_of_a_manifest_and_no_other() {
    let documentation = fs::read_to_string(in_repository("docs/models.md")).unwrap();
    let (_, table) = documentation
        .split_once("<!-- keys of manifests -->")
        .unwrap();
    let (table, _) = table.split_once("<!-- /keys of manifests -->").unwrap();
    let rows = table.lines().filter(|line| line.starts_with("| `"));
    let documented: BTreeSet<String> = rows
        .flat_map(|row| quoted(row.split('|').nth(1).unwrap()).collect::<Vec<_>>())
        .collect();
    let mut keys = BTreeSet::from(["head".to_owned()]);
    keys.extend(expected::<ModelManifest>("unknown = 1"));
    assert!(keys.remove("licence"), "the name in earlier versions");
    keys.extend(expected::<ModelManifest>("[input]\nunknown = 1"));
    let heads = expected::<Head>("head = \"unknown\"");
    assert_eq!(heads.len(), 7);
    for head in heads {
        keys.extend(expected::<Head>(&format!("head = \"{head}\"\nunknown = 1")));
    }
    assert_eq!(documented, keys);
}
