//! Replaces a file in one step: readers, and a crash, find the old content or the new one.

use std::{
    convert::identity,
    fs::{self, File, OpenOptions},
    hash::{BuildHasher, RandomState},
    io::{self, ErrorKind, Write},
    os::unix::fs::OpenOptionsExt,
    path::{Path, PathBuf},
};

/// The ending of a file that was about to take another's place when its writer was killed.
pub const UNFINISHED: &str = "lookdown-unfinished";
/// The mode of a file that the mask of the process limits.
const MODE: u32 = 0o666;
/// The mode of a file that only this user can read.
const SECRET_MODE: u32 = 0o600;

/// The replacement of a file: a file beside it, which takes its name when it is complete.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Replacement {
    path: PathBuf,
    unfinished: PathBuf,
    mode: u32,
}

impl Replacement {
    /// The replacement of the file at `path`, which may be missing. Several writers may replace the
    /// same file: their names are random, as containers on one volume have the same process IDs.
    pub fn new(path: &Path) -> Self {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        // Each state has keys of its own, random at first.
        let random = RandomState::new().hash_one(&name);
        Self {
            path: path.to_owned(),
            unfinished: path.with_file_name(format!(".{name}.{random:016x}.{UNFINISHED}")),
            mode: MODE,
        }
    }

    /// The replacement of a file with secrets, which only this user can read, for one writer at a
    /// time: what a killed writer left is overwritten by the next one.
    pub fn for_secret(path: &Path) -> Self {
        Self {
            path: path.to_owned(),
            unfinished: path.with_extension("part"),
            mode: SECRET_MODE,
        }
    }

    /// Lets `write` fill the file, then syncs it, renames it and syncs the folder. Until then, the
    /// file at the path stays as it was. Blocks.
    ///
    /// # Errors
    /// That of `write`, or `unwritable` of the first failure of the file system.
    pub fn fill<T, E>(
        &self,
        unwritable: impl Fn(io::Error) -> E,
        write: impl FnOnce(&mut File) -> Result<T, E>,
    ) -> Result<T, E> {
        let written = self.finish(&unwritable, write);
        if written.is_err() {
            // It may not exist, and the first failure is the one to report.
            let _ = fs::remove_file(&self.unfinished);
        }
        let written = written?;
        let folder = self.path.parent().unwrap_or(Path::new(""));
        sync_folder(folder).map_err(unwritable)?;
        Ok(written)
    }

    fn finish<T, E>(
        &self,
        unwritable: impl Fn(io::Error) -> E,
        write: impl FnOnce(&mut File) -> Result<T, E>,
    ) -> Result<T, E> {
        let mut file = OpenOptions::new()
            .create(true)
            .write(true)
            .truncate(true)
            .mode(self.mode)
            .open(&self.unfinished)
            .map_err(&unwritable)?;
        let written = write(&mut file)?;
        file.sync_all().map_err(&unwritable)?;
        fs::rename(&self.unfinished, &self.path).map_err(&unwritable)?;
        Ok(written)
    }
}

/// Replaces the file at `path`, which may be missing, in one step. Blocks.
///
/// # Errors
/// The failure of the file system. The file then has its old content, or the new one if only the
/// folder could not be synced.
pub fn replace_file(path: &Path, content: &[u8]) -> io::Result<()> {
    Replacement::new(path).fill(identity, |file| file.write_all(content))
}

/// Syncs a folder: a rename or removal lasts only once the folder itself is on the disk. The empty
/// path is the current folder.
///
/// # Errors
/// The failure of the file system.
pub fn sync_folder(folder: &Path) -> io::Result<()> {
    let is_empty = folder.as_os_str().is_empty();
    let folder = if is_empty { Path::new(".") } else { folder };
    match File::open(folder)?.sync_all() {
        // Some network file systems cannot sync folders.
        Err(error) if error.kind() == ErrorKind::InvalidInput => Ok(()),
        synced => synced,
    }
}

#[cfg(test)]
mod tests {
    use std::os::unix::fs::PermissionsExt;

    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let entries = fs::read_dir(folder).unwrap();
        let mut names: Vec<_> = entries
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        names
    }

    #[test]
    fn a_file_is_created_and_replaced_without_leftovers() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("model.toml");
        for content in ["old and longer", "new"] {
            replace_file(&path, content.as_bytes()).unwrap();
            assert_eq!(fs::read_to_string(&path).unwrap(), content);
            assert_eq!(names(folder.path()), ["model.toml"]);
        }
    }

    #[test]
    fn readers_find_the_old_file_until_the_new_one_is_complete() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("file");
        fs::write(&path, "old").unwrap();
        let written = Replacement::new(&path).fill(identity, |file| {
            file.write_all(b"ne")?;
            assert_eq!(fs::read_to_string(&path)?, "old");
            let unfinished = names(folder.path()).remove(0);
            assert!(unfinished.starts_with(".file."), "{unfinished}");
            assert!(unfinished.ends_with(UNFINISHED), "{unfinished}");
            file.write_all(b"w")
        });
        written.unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "new");
    }

    #[test]
    fn a_failed_write_leaves_the_old_file_alone() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("file");
        fs::write(&path, "old").unwrap();
        for replacement in [Replacement::new(&path), Replacement::for_secret(&path)] {
            let failed = replacement.fill(
                |error| error.to_string(),
                |file| {
                    file.write_all(b"half").unwrap();
                    Err::<(), _>("its sum is wrong".to_owned())
                },
            );
            assert_eq!(failed.unwrap_err(), "its sum is wrong");
            assert_eq!(fs::read_to_string(&path).unwrap(), "old");
            assert_eq!(names(folder.path()), ["file"]);
        }
        // A folder cannot be replaced by a file.
        assert!(replace_file(folder.path(), b"content").is_err());
        assert!(replace_file(&path.join("no/such"), b"content").is_err());
        assert_eq!(names(folder.path()), ["file"]);
    }

    #[test]
    fn only_this_user_can_read_a_secret_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("password");
        fs::write(&path, "old").unwrap();
        let written =
            Replacement::for_secret(&path).fill(identity, |file| file.write_all(b"secret"));
        written.unwrap();
        let mode = fs::metadata(&path).unwrap().permissions().mode();
        assert_eq!(mode & 0o777, 0o600);
    }

    #[test]
    fn two_replacements_of_a_file_have_different_names() {
        let [one, other] = [0, 1].map(|_| Replacement::new(Path::new("file")));
        assert_ne!(one, other);
    }
}
