//! Reads files of users and operators: the one way in which Lookdown opens a file to read it.
//!
//! A path may lead to a pipe, whose opening waits for a writer, to a device that never ends, or to
//! a file that grows. Each function opens without waiting, accepts regular files only, and reads a
//! bounded number of bytes.

use std::{
    fs::{File, OpenOptions},
    io::{self, Read},
    os::unix::fs::OpenOptionsExt,
    path::{Path, PathBuf},
};

use rustix::fs::OFlags;

/// Most bytes of a settings file, a key or a certificate.
pub const MAX_SETTINGS_BYTES: u64 = 1 << 20;

/// Most bytes of an image file that the command line reads.
pub const MAX_IMAGE_BYTES: u64 = 256 << 20;

/// Endings of images that can be read, in lower case.
pub const IMAGE_ENDINGS: [&str; 4] = ["jpg", "jpeg", "png", "webp"];

/// Returns `true` if the name of a file has one of the endings, in either case.
pub fn has_ending(path: &Path, endings: &[&str]) -> bool {
    path.extension().is_some_and(|actual| {
        endings
            .iter()
            .any(|ending| actual.eq_ignore_ascii_case(ending))
    })
}

/// A file or folder that cannot be used. The message is one sentence with the remedy.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{path}: {problem}")]
pub struct FileError {
    /// The file or folder.
    pub path: PathBuf,
    /// The problem and its remedy.
    pub problem: String,
}

impl FileError {
    /// Creates the error for the content of a file.
    pub fn new(path: &Path, problem: impl Into<String>) -> Self {
        Self {
            path: path.to_owned(),
            problem: problem.into(),
        }
    }

    /// Creates the error for a file or folder that the operating system does not let read.
    pub fn unreadable(path: &Path, error: &io::Error) -> Self {
        Self::new(path, format!("cannot be read: {error}"))
    }
}

/// The treatment of a symbolic link at the end of a path.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Links {
    /// Links are followed: the operator chose the path.
    Follow,
    /// Links are refused: others may write into the folder.
    Refuse,
}

/// Opens a regular file without waiting.
///
/// # Errors
/// If it cannot be opened, or is a folder, a pipe or a device.
pub fn open(path: &Path, links: Links) -> io::Result<File> {
    let mut flags = OFlags::NONBLOCK | OFlags::NOCTTY;
    if links == Links::Refuse {
        flags |= OFlags::NOFOLLOW;
    }
    let file = OpenOptions::new()
        .read(true)
        .custom_flags(flags.bits().cast_signed())
        .open(path)?;
    if !file.metadata()?.is_file() {
        return Err(io::Error::other("it is not a regular file"));
    }
    Ok(file)
}

/// Reads a regular file of at most this many bytes. Links are followed.
///
/// # Errors
/// If it cannot be read, is not a regular file, or is larger.
pub fn read(path: &Path, max_bytes: u64) -> io::Result<Vec<u8>> {
    read_with(path, max_bytes, Links::Follow)
}

/// Reads a regular file of at most this many bytes.
///
/// # Errors
/// If it cannot be read, is not a regular file, or is larger.
pub fn read_with(path: &Path, max_bytes: u64, links: Links) -> io::Result<Vec<u8>> {
    let file = open(path, links)?;
    // A file may grow after its length was read.
    let length = file.metadata()?.len();
    let too_large = || io::Error::other(format!("it has more than {}", shown_bytes(max_bytes)));
    if length > max_bytes {
        return Err(too_large());
    }
    let mut content = Vec::with_capacity(usize::try_from(length).unwrap_or(0));
    file.take(max_bytes + 1).read_to_end(&mut content)?;
    if content.len() as u64 > max_bytes {
        return Err(too_large());
    }
    Ok(content)
}

/// Reads the first bytes of a regular file: all of them if there are at most this many.
///
/// # Errors
/// If it cannot be read, or is not a regular file.
pub fn read_start(path: &Path, max_bytes: u64) -> io::Result<Vec<u8>> {
    let mut content = Vec::new();
    let file = open(path, Links::Follow)?;
    file.take(max_bytes).read_to_end(&mut content)?;
    Ok(content)
}

/// Reads a regular file of UTF-8 text of at most this many bytes.
///
/// # Errors
/// If it cannot be read, is not a regular file, is larger, or is not UTF-8.
pub fn read_text(path: &Path, max_bytes: u64) -> io::Result<String> {
    let content = read(path, max_bytes)?;
    String::from_utf8(content).map_err(|_| {
        let problem = "stream did not contain valid UTF-8";
        io::Error::new(io::ErrorKind::InvalidData, problem)
    })
}

fn shown_bytes(bytes: u64) -> String {
    const MEBIBYTE: u64 = 1 << 20;
    if bytes >= MEBIBYTE && bytes.is_multiple_of(MEBIBYTE) {
        format!("{} MiB", bytes / MEBIBYTE)
    } else {
        format!("{bytes} bytes")
    }
}

#[cfg(test)]
mod tests {
    use std::{fs, process::Command, sync::mpsc::sync_channel, thread, time::Duration};

    use super::*;

    #[test]
    fn pipes_folders_and_devices_are_refused_without_a_wait() {
        let folder = tempfile::tempdir().unwrap();
        let pipe = folder.path().join("pipe");
        assert!(
            Command::new("mkfifo")
                .arg(&pipe)
                .status()
                .unwrap()
                .success()
        );
        for path in [pipe.as_path(), folder.path(), Path::new("/dev/zero")] {
            let (done, outcome) = sync_channel(1);
            let own = path.to_owned();
            let reading = thread::Builder::new().name("reading".to_owned());
            reading.spawn(move || done.send(read(&own, 10))).unwrap();
            let outcome = outcome.recv_timeout(Duration::from_secs(5)).unwrap();
            let error = outcome.unwrap_err().to_string();
            assert!(error.contains("not a regular file"), "{error}");
        }
    }

    #[test]
    fn larger_files_are_refused_or_cut() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("file");
        fs::write(&file, "12345").unwrap();
        assert_eq!(read(&file, 5).unwrap(), b"12345");
        let error = read(&file, 4).unwrap_err().to_string();
        assert!(error.contains("more than 4 bytes"), "{error}");
        assert_eq!(read_start(&file, 3).unwrap(), b"123");
        fs::write(&file, vec![0; (1 << 20) + 1]).unwrap();
        let error = read(&file, 1 << 20).unwrap_err().to_string();
        assert!(error.contains("more than 1 MiB"), "{error}");
    }

    #[test]
    fn links_are_refused_where_others_may_write() {
        let folder = tempfile::tempdir().unwrap();
        let (file, link) = (folder.path().join("file"), folder.path().join("link"));
        fs::write(&file, "secret").unwrap();
        std::os::unix::fs::symlink(&file, &link).unwrap();
        assert_eq!(read(&link, 10).unwrap(), b"secret");
        assert!(read_with(&link, 10, Links::Refuse).is_err());
        assert_eq!(read_with(&file, 10, Links::Refuse).unwrap(), b"secret");
    }

    #[test]
    fn text_must_be_utf_8() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("file");
        fs::write(&file, b"a\xff").unwrap();
        assert!(read_text(&file, 10).is_err());
    }
}
