//! Log output.

use std::{
    io::{self, Write},
    sync::{Arc, Mutex},
};

use axum::{body::Body, http::Request};
use tracing::subscriber::DefaultGuard;

use crate::service::{Service, frame};

/// Captures the log of this thread while it lives.
pub(crate) struct Log {
    lines: Lines,
    _listening: DefaultGuard,
}

impl Log {
    pub(crate) fn begin() -> Self {
        let lines = Lines::default();
        let writer = lines.clone();
        let logs = tracing_subscriber::fmt().with_writer(move || writer.clone());
        Self {
            lines,
            _listening: tracing::subscriber::set_default(logs.with_ansi(false).finish()),
        }
    }

    pub(crate) fn text(&self) -> String {
        String::from_utf8(self.lines.0.lock().unwrap().clone()).unwrap()
    }
}

#[derive(Clone, Default)]
struct Lines(Arc<Mutex<Vec<u8>>>);

impl Write for Lines {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.lock().unwrap().write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[tokio::test]
async fn internal_errors_are_logged_once_and_refusals_are_not() {
    let service = Service::start();
    let log = Log::begin();
    service.gate.panic_once();
    for image in [frame(), b"no picture".to_vec()] {
        let request = Request::post("/detect?calibration=lobby&profile=fast")
            .header("x-request-id", "camera-7/0001")
            .body(Body::from(image))
            .unwrap();
        service.send(request).await;
    }
    let log = log.text();
    let errors: Vec<_> = log.lines().filter(|line| line.contains("ERROR")).collect();
    assert_eq!(errors.len(), 1, "{log}");
    assert!(errors[0].contains("camera-7/0001"), "{log}");
    assert!(!log.contains("no picture"), "{log}");
}
