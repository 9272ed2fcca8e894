//! A folder into which image files are dropped. The file that arrived last is the newest frame.
//!
//! A file has arrived when it is not in the list of the check before, or has another time or size.
//! Its time alone decides nothing: clocks jump, and FTP servers keep the times of the cameras.

use std::{
    collections::HashMap,
    convert::Infallible,
    fs, io,
    path::{Path, PathBuf},
    time::{Duration, SystemTime},
};

use jiff::Timestamp;
use lookdown_common::{
    files::{self, IMAGE_ENDINGS, Links},
    text::one_line,
};
use tokio::{task::spawn_blocking, time::sleep};

use super::sink::Sink;
use crate::{Camera, MAX_FRAME_BYTES, SourceError};

/// Shortest and longest interval of the checks for new files.
const CHECKS: (Duration, Duration) = (Duration::from_millis(100), Duration::from_millis(500));
/// Most files of a folder.
const MAX_FILES: usize = 100_000;

/// The time and the size of a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct FileState {
    modified: SystemTime,
    bytes: u64,
}

/// The files of the last check.
type Seen = HashMap<PathBuf, FileState>;

/// A file that has arrived.
struct NewFile {
    path: PathBuf,
    state: FileState,
    image: Vec<u8>,
}

/// Reads the newest file whenever there is a new one. Files are neither changed nor removed.
pub(super) async fn run(
    camera: &Camera,
    folder: &Path,
    sink: &Sink<'_>,
) -> Result<Infallible, SourceError> {
    let (shortest, longest) = CHECKS;
    let pause = camera.every().clamp(shortest, longest);
    let mut seen = Seen::new();
    // The last file if it was damaged: it may be in the middle of its upload.
    let mut damaged: Option<(PathBuf, FileState)> = None;
    loop {
        let (folder, before) = (folder.to_owned(), std::mem::take(&mut seen));
        let shown = folder.display().to_string();
        let read = spawn_blocking(move || read_newest(&folder, &before)).await;
        let read = read.unwrap_or_else(|error| Err(io::Error::other(error)));
        let (now, newest) =
            read.map_err(|error| SourceError::Unreadable(shown, error.to_string()))?;
        seen = now;
        if let Some((path, state)) = damaged.take()
            && seen.get(&path) == Some(&state)
        {
            let name = one_line(&path.display().to_string());
            tracing::warn!("{name} is not a whole image: it is skipped until it changes");
        }
        match newest {
            Some(file) => {
                let captured_at = captured_at(file.state.modified);
                if sink.accept_at(file.image.into(), captured_at).is_err() {
                    damaged = Some((file.path, file.state));
                }
            }
            None => sink.alive(),
        }
        sleep(pause).await;
    }
}

/// Returns the time of a file, or the present if the file is of the future.
fn captured_at(modified: SystemTime) -> Timestamp {
    let now = Timestamp::now();
    Timestamp::try_from(modified).map_or(now, |modified| modified.min(now))
}

/// Lists the image files of a folder, and reads the newest one of those that have arrived. Times
/// after the present count as the present.
fn read_newest(folder: &Path, before: &Seen) -> io::Result<(Seen, Option<NewFile>)> {
    let now = SystemTime::now();
    let mut seen = Seen::new();
    for (count, entry) in fs::read_dir(folder)?.enumerate() {
        if count >= MAX_FILES {
            return Err(io::Error::other(
                "it has more than 100000 files: remove old ones",
            ));
        }
        let path = entry?.path();
        if !is_image(&path) {
            continue;
        }
        // A file may have been removed since. Cameras that upload files must not name others by
        // links.
        let Ok(about) = fs::symlink_metadata(&path) else {
            continue;
        };
        if !about.is_file() || about.len() == 0 || about.len() > MAX_FRAME_BYTES as u64 {
            continue;
        }
        let state = FileState {
            modified: about.modified()?,
            bytes: about.len(),
        };
        seen.insert(path, state);
    }
    let arrived = seen
        .iter()
        .filter(|(path, state)| before.get(*path) != Some(*state));
    // Of the files at the start, one of the future is the newest only if there is no other.
    let rank = |state: &FileState| (state.modified <= now, state.modified);
    let newest = arrived.max_by_key(|(path, state)| (rank(state), *path));
    let newest = newest.map(|(path, state)| (path.clone(), *state));
    let Some((path, state)) = newest else {
        return Ok((seen, None));
    };
    match files::read_with(&path, MAX_FRAME_BYTES as u64, Links::Refuse) {
        Ok(image) => Ok((seen, Some(NewFile { path, state, image }))),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok((seen, None)),
        Err(error) => Err(error),
    }
}

fn is_image(path: &Path) -> bool {
    let is_hidden = path
        .file_name()
        .is_none_or(|name| name.to_string_lossy().starts_with('.'));
    !is_hidden && files::has_ending(path, &IMAGE_ENDINGS)
}

#[cfg(test)]
mod tests {
    use std::fs::File;

    use super::*;

    /// A folder of files with their names as content.
    struct Folder(tempfile::TempDir, Seen);

    impl Folder {
        fn new() -> Self {
            Self(tempfile::tempdir().unwrap(), Seen::new())
        }

        fn write(&self, name: &str, seconds: u64) {
            let file = File::create(self.0.path().join(name)).unwrap();
            io::Write::write_all(&mut &file, name.as_bytes()).unwrap();
            let time = SystemTime::UNIX_EPOCH + Duration::from_secs(seconds);
            file.set_modified(time).unwrap();
        }

        fn next(&mut self) -> Option<String> {
            let (seen, newest) = read_newest(self.0.path(), &self.1).unwrap();
            self.1 = seen;
            newest.map(|file| String::from_utf8(file.image).unwrap())
        }
    }

    const YEAR_2099: u64 = 4_070_908_800;

    #[test]
    fn only_the_newest_image_after_the_last_one_is_read() {
        let mut folder = Folder::new();
        folder.write("a.jpg", 1);
        folder.write("b.jpg", 3);
        folder.write("c.jpg", 2);
        folder.write("notes.txt", 9);
        folder.write(".hidden.jpg", 9);
        assert_eq!(folder.next().as_deref(), Some("b.jpg"));
        assert_eq!(folder.next(), None);
        folder.write("d.PNG", 4);
        assert_eq!(folder.next().as_deref(), Some("d.PNG"));
    }

    #[test]
    fn files_are_read_in_the_order_of_their_arrival() {
        let mut folder = Folder::new();
        folder.write("a.jpg", 100);
        assert_eq!(folder.next().as_deref(), Some("a.jpg"));
        // Of the future, then with a clock that was set back.
        for (name, seconds) in [("f.jpg", YEAR_2099), ("b.jpg", 101), ("c.jpg", 50)] {
            folder.write(name, seconds);
            assert_eq!(folder.next().as_deref(), Some(name));
            assert_eq!(folder.next(), None);
        }
        // The same name again.
        folder.write("a.jpg", 99);
        assert_eq!(folder.next().as_deref(), Some("a.jpg"));
    }

    #[test]
    fn a_file_of_the_future_hides_no_other_file() {
        let mut folder = Folder::new();
        folder.write("f.jpg", YEAR_2099);
        folder.write("a.jpg", 100);
        assert_eq!(folder.next().as_deref(), Some("a.jpg"));
        let future = SystemTime::UNIX_EPOCH + Duration::from_secs(YEAR_2099);
        assert!(captured_at(future) <= Timestamp::now());
    }

    #[test]
    fn a_missing_folder_is_an_error() {
        assert!(read_newest(Path::new("/nowhere"), &Seen::new()).is_err());
    }
}
