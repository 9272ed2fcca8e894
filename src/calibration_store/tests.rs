use std::fs::File;

use super::*;

fn names(store: &FolderStore) -> Vec<String> {
    let mut names: Vec<_> = store.list().unwrap().into_iter().map(|f| f.name).collect();
    names.sort();
    names
}

fn read(store: &FolderStore, name: &str, at_most: usize) -> Vec<u8> {
    store.read(name, at_most).unwrap()
}

#[test]
fn a_file_is_written_read_replaced_and_deleted() {
    let folder = tempfile::tempdir().unwrap();
    let store = FolderStore::new(folder.path());
    store
        .write("lobby.json", b"one", Replaces::Anything)
        .unwrap();
    let first = store.list().unwrap();
    store
        .write("lobby.json", b"two", Replaces::Anything)
        .unwrap();
    assert_ne!(store.list().unwrap(), first);
    assert_eq!(read(&store, "lobby.json", 10), b"two");
    assert_eq!(read(&store, "lobby.json", 2), b"tw");
    assert_eq!(names(&store), ["lobby.json"], "something was left behind");
    store.delete("lobby.json").unwrap();
    store.delete("lobby.json").unwrap();
    assert!(names(&store).is_empty());
}

#[test]
fn later_write_removes_only_abandoned_temporary_files() {
    let folder = tempfile::tempdir().unwrap();
    let unfinished = |name: &str| folder.path().join(format!(".{name}.1-0.{UNFINISHED}"));
    for name in ["old.json", "young.json"] {
        fs::write(unfinished(name), "{ half a fi").unwrap();
    }
    let long_ago = SystemTime::now() - 2 * ABANDONED_AFTER;
    let old = File::options().write(true).open(unfinished("old.json"));
    old.unwrap().set_modified(long_ago).unwrap();
    let store = FolderStore::new(folder.path());
    store
        .write("lobby.json", b"whole", Replaces::Anything)
        .unwrap();
    assert!(!unfinished("old.json").exists());
    assert!(unfinished("young.json").exists());
    assert_eq!(read(&store, "lobby.json", 10), b"whole");
}

#[test]
fn a_write_replaces_only_the_expected_content() {
    let folder = tempfile::tempdir().unwrap();
    let store = FolderStore::new(folder.path());
    store
        .write("lobby.json", b"one", Replaces::Nothing)
        .unwrap();
    let seen = store.list().unwrap().swap_remove(0).stamp;
    store
        .write("lobby.json", b"two", Replaces::Stamp(&seen))
        .unwrap();
    for outdated in [Replaces::Stamp(&seen), Replaces::Nothing] {
        let refused = store.write("lobby.json", b"three", outdated);
        assert!(matches!(refused, Err(StoreError::Changed { .. })));
    }
    assert_eq!(read(&store, "lobby.json", 10), b"two");
}

#[test]
fn a_failed_write_leaves_the_old_file_and_nothing_else() {
    let folder = tempfile::tempdir().unwrap();
    // A folder in the file's place: the rename fails.
    fs::create_dir_all(folder.path().join("lobby.json/inside")).unwrap();
    let store = FolderStore::new(folder.path());
    assert!(
        store
            .write("lobby.json", b"new", Replaces::Anything)
            .is_err()
    );
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
}

#[test]
fn a_missing_folder_is_an_error_unless_it_may_be_missing() {
    let folder = tempfile::tempdir().unwrap();
    let missing = folder.path().join("calibrations");
    let error = FolderStore::new(&missing).list().unwrap_err().to_string();
    assert!(error.contains("calibrations: "), "{error}");
    let store = FolderStore::that_may_be_missing(&missing);
    assert!(names(&store).is_empty());
    store
        .write("lobby.json", b"new", Replaces::Anything)
        .unwrap();
    assert_eq!(names(&store), ["lobby.json"]);
}

#[test]
fn links_are_followed_and_folders_and_dead_links_are_no_files() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    for (version, content) in [("v1", "one"), ("v2", "two")] {
        fs::create_dir(path(version)).unwrap();
        fs::write(path(version).join("lobby.json"), content).unwrap();
    }
    let link = |from: &str, to: &str| std::os::unix::fs::symlink(to, path(from)).unwrap();
    link("..data", "v1");
    link("lobby.json", "..data/lobby.json");
    link("dead.json", "nowhere");
    let store = FolderStore::new(folder.path());
    let before = store.list().unwrap();
    assert_eq!(names(&store), ["lobby.json"]);
    link("..new", "v2");
    fs::rename(path("..new"), path("..data")).unwrap();
    assert_ne!(store.list().unwrap(), before);
    assert_eq!(read(&store, "lobby.json", 10), b"two");
}
