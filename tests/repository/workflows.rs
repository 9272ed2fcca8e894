//! The workflows of the forge.

use std::{fs, path::Path};

#[test]
fn actions_of_workflows_are_pinned_by_commit_and_version() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join(".github/workflows");
    let mut uses = 0;
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let text = fs::read_to_string(&path).unwrap();
        for line in text.lines().filter(|line| line.contains("uses:")) {
            uses += 1;
            let (commit, version) = line
                .split_once('@')
                .and_then(|(_, pin)| pin.split_once(" # v"))
                .unwrap_or_default();
            let is_commit =
                commit.len() == 40 && commit.bytes().all(|byte| byte.is_ascii_hexdigit());
            assert!(
                is_commit && version.split('.').count() == 3,
                "{}: {line}: use a commit, with its version as a comment",
                path.display()
            );
        }
    }
    assert!(uses > 0);
}
