//! `lookdown serve` as a systemd service of `Type=notify` with a watchdog.

use std::{
    os::unix::net::UnixDatagram,
    process::{Child, Command, Stdio},
    time::Duration,
};

use crate::SMALL_MODEL;

/// Longest time for a message of the server. Models are loaded before the first.
const TIMEOUT: Duration = Duration::from_mins(1);

/// A server, which is killed if a test fails.
struct Service(Child);

impl Drop for Service {
    fn drop(&mut self) {
        // It still runs only if a test has failed.
        let _ = self.0.kill();
    }
}

#[test]
fn systemd_is_notified_of_readiness_watchdog_and_stop() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("notify");
    let socket = UnixDatagram::bind(&path).unwrap();
    socket.set_read_timeout(Some(TIMEOUT)).unwrap();
    let waits_for = |expected: &str| {
        let mut message = [0; 64];
        loop {
            let length = socket.recv(&mut message).unwrap();
            let text = str::from_utf8(&message[..length]).unwrap().trim_end();
            if text == expected {
                return;
            }
            assert_eq!(text, "WATCHDOG=1", "before {expected}");
        }
    };
    let process = Command::new(env!("CARGO_BIN_EXE_lookdown"))
        .arg("serve")
        .env("NOTIFY_SOCKET", &path)
        .env("WATCHDOG_USEC", "200000")
        .envs([SMALL_MODEL])
        .env("LOOKDOWN__SERVER__LISTEN", "127.0.0.1:0")
        .env("LOOKDOWN__SHUTDOWN__GRACE_MILLIS", "0")
        .stderr(Stdio::null())
        .spawn();
    let mut service = Service(process.unwrap());
    waits_for("READY=1");
    waits_for("WATCHDOG=1");
    let kill = format!("kill -TERM {}", service.0.id());
    let sent = Command::new("sh").args(["-c", &kill]).status();
    assert!(sent.unwrap().success());
    waits_for("STOPPING=1");
    assert!(service.0.wait().unwrap().success());
}
