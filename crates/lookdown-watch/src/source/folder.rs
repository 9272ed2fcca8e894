//! A folder into which image files are dropped. Its newest file is the newest frame.

use std::{
    convert::Infallible,
    fs, io,
    path::{Path, PathBuf},
    time::{Duration, SystemTime},
};

use jiff::Timestamp;
use lookdown_common::files::{self, Links};
use tokio::{task::spawn_blocking, time::sleep};

use super::Sink;
use crate::{Camera, MAX_FRAME_BYTES, SourceError};

/// Shortest and longest interval of the checks for new files.
const CHECKS: (Duration, Duration) = (Duration::from_millis(100), Duration::from_millis(500));
/// Endings of image files, in lower case.
const ENDINGS: [&str; 4] = ["jpg", "jpeg", "png", "webp"];
/// Most files of a folder.
const MAX_FILES: usize = 100_000;

/// The time and the name of a file. Files are ordered by both.
type Stamp = (SystemTime, PathBuf);

/// Reads the newest file whenever there is a new one. Files are neither changed nor removed.
pub(super) async fn run(
    camera: &Camera,
    folder: &Path,
    sink: &Sink<'_>,
) -> Result<Infallible, SourceError> {
    let (shortest, longest) = CHECKS;
    let pause = camera.every.clamp(shortest, longest);
    let mut last: Option<Stamp> = None;
    loop {
        let (folder, after) = (folder.to_owned(), last.clone());
        let shown = folder.display().to_string();
        let read = spawn_blocking(move || read_newest(&folder, after.as_ref())).await;
        let read = read.unwrap_or_else(|error| Err(io::Error::other(error)));
        match read.map_err(|error| SourceError::Unreadable(shown, error.to_string()))? {
            // A file that is still being written is read again.
            Some((stamp, image)) => {
                let captured_at = Timestamp::try_from(stamp.0).unwrap_or_else(|_| Timestamp::now());
                if sink.accept_at(image.into(), captured_at).is_ok() {
                    last = Some(stamp);
                }
            }
            None => sink.alive(),
        }
        sleep(pause).await;
    }
}

/// Reads the newest image file of a folder that is newer than the last one.
fn read_newest(folder: &Path, after: Option<&Stamp>) -> io::Result<Option<(Stamp, Vec<u8>)>> {
    let mut newest: Option<Stamp> = None;
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
        // A file may have been removed since. Cameras that upload files must not name others by links.
        let Ok(about) = fs::symlink_metadata(&path) else {
            continue;
        };
        if !about.is_file() || about.len() == 0 || about.len() > MAX_FRAME_BYTES as u64 {
            continue;
        }
        let stamp = (about.modified()?, path);
        if after.is_none_or(|after| stamp > *after) && newest.as_ref() < Some(&stamp) {
            newest = Some(stamp);
        }
    }
    let Some(stamp) = newest else { return Ok(None) };
    match files::read_with(&stamp.1, MAX_FRAME_BYTES as u64, Links::Refuse) {
        Ok(image) => Ok(Some((stamp, image))),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
        Err(error) => Err(error),
    }
}

fn is_image(path: &Path) -> bool {
    let is_hidden = path
        .file_name()
        .is_none_or(|name| name.to_string_lossy().starts_with('.'));
    let ending = path.extension().and_then(|ending| ending.to_str());
    let ending = ending.unwrap_or_default().to_ascii_lowercase();
    !is_hidden && ENDINGS.contains(&ending.as_str())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_newest_image_after_the_last_one_is_read() {
        let folder = tempfile::tempdir().unwrap();
        let write = |name: &str, seconds: u64| {
            let file = fs::File::create(folder.path().join(name)).unwrap();
            io::Write::write_all(&mut &file, name.as_bytes()).unwrap();
            let time = SystemTime::UNIX_EPOCH + Duration::from_secs(seconds);
            file.set_modified(time).unwrap();
        };
        write("a.jpg", 1);
        write("b.jpg", 3);
        write("c.jpg", 2);
        write("notes.txt", 9);
        write(".hidden.jpg", 9);
        let (stamp, image) = read_newest(folder.path(), None).unwrap().unwrap();
        assert_eq!(image, b"b.jpg");
        assert!(read_newest(folder.path(), Some(&stamp)).unwrap().is_none());
        write("d.PNG", 4);
        let (_, image) = read_newest(folder.path(), Some(&stamp)).unwrap().unwrap();
        assert_eq!(image, b"d.PNG");
    }

    #[test]
    fn a_missing_folder_is_an_error() {
        assert!(read_newest(Path::new("/nowhere"), None).is_err());
    }
}
