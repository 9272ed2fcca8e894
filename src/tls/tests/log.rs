//! Captures the log of a function.

use std::{
    io::{self, Write},
    sync::{Arc, Mutex},
};

/// A part of a log.
struct Log(Arc<Mutex<Vec<u8>>>);

impl Write for Log {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.lock().unwrap().write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

pub(super) fn logged_by(work: impl FnOnce()) -> String {
    let bytes = Arc::new(Mutex::new(Vec::new()));
    let writer = Arc::clone(&bytes);
    let logs = tracing_subscriber::fmt().with_writer(move || Log(Arc::clone(&writer)));
    tracing::subscriber::with_default(logs.with_ansi(false).finish(), work);
    let log = bytes.lock().unwrap();
    String::from_utf8(log.clone()).unwrap()
}
