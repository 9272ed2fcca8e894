//! Small files that operators change while the server runs. They are polled.

use std::{
    fs::{self, File},
    io::{self, Read},
    path::Path,
};

/// Most bytes of a file. A hundred certificates take a tenth of it, a thousand keys a fifth.
const MAX_BYTES: u64 = 1 << 20;

/// Reads a regular file of at most 1 MiB, links followed. The opening of a pipe would wait for a
/// writer, and no later version of the file would be read.
///
/// # Errors
/// If it cannot be read, is no regular file, or is larger.
pub fn read(path: &Path) -> io::Result<Vec<u8>> {
    if !fs::metadata(path)?.is_file() {
        return Err(io::Error::other("it is no regular file"));
    }
    let mut content = Vec::new();
    let read = File::open(path)?
        .take(MAX_BYTES + 1)
        .read_to_end(&mut content)?;
    if read as u64 > MAX_BYTES {
        return Err(io::Error::other("it has more than 1 MiB"));
    }
    Ok(content)
}

#[cfg(test)]
mod tests {
    use std::{process::Command, sync::mpsc::sync_channel, thread, time::Duration};

    use super::*;

    #[test]
    fn pipes_and_devices_are_refused_without_a_wait() {
        let folder = tempfile::tempdir().unwrap();
        let pipe = folder.path().join("keys.toml");
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
            reading.spawn(move || done.send(read(&own))).unwrap();
            let outcome = outcome.recv_timeout(Duration::from_secs(5));
            let error = outcome.expect("the read waits").unwrap_err();
            assert!(error.to_string().contains("no regular file"), "{error}");
        }
    }
}
