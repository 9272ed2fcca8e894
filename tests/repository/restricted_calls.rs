//! Calls that belong in few places: opening files to read them, starting processes, comparing API
//! keys, reading the clock, which jumps, and making HTTP clients.

use std::{
    fs,
    path::{Path, PathBuf},
};

use crate::layering::source_scan::code;

/// Calls that open files for reading, which only `lookdown_common::files` makes: it opens without
/// waiting, accepts regular files only, and reads a bounded number of bytes.
const READS: [&str; 6] = [
    "fs::read(",
    "fs::read_to_string(",
    "File::open(",
    "File::options(",
    "OpenOptions::new(",
    "tokio::fs",
];
/// The files that may make them.
const READERS: [&str; 6] = [
    "crates/lookdown-common/src/files.rs",
    // Creates files that replace others, and syncs folders.
    "crates/lookdown-common/src/replacement.rs",
    // Creates the file that locks the store.
    "crates/lookdown-count/src/store.rs",
    // Creates the file that locks the state folder.
    "src/cameras/state_folder.rs",
    // Tests of generated documentation.
    "src/api/parameters/reference.rs",
    "src/settings/reference.rs",
];
/// Calls that start processes, which only `child.rs` makes: it limits them.
const STARTS: [&str; 2] = ["Command::new(", ".spawn()?"];
/// The files that may make them.
const STARTERS: [&str; 2] = [
    "crates/lookdown-watch/src/child.rs",
    // Replaces the process by itself.
    "src/main.rs",
];

/// Calls that compare the key of a request with all known keys. The layer of the context makes it
/// once for each request; a stream that goes on repeats it.
const COMPARISONS: [&str; 2] = [".identify(", ".holder_of("];
/// The files that may make them.
const COMPARERS: [&str; 4] = [
    "src/access.rs",
    "src/api/http/access.rs",
    "src/api/http/context.rs",
    "src/api/require_scope.rs",
];
/// The repeated comparison, and the files of the answers that last.
const REPEATED: [&str; 1] = ["::check_again("];
const LASTING: [&str; 2] = [
    "src/api/routes/results/events.rs",
    "src/api/routes/results.rs",
];

/// Calls that read the clock of the machine. Everything that waits or limits uses the monotonic
/// clock.
const CLOCKS: [&str; 3] = ["SystemTime::now()", "Timestamp::now()", "Zoned::now()"];
/// The files that may make them: they date reports, and compare with the dates of others.
/// docs/lab/reliability.md states what holds when the clock jumps.
const CLOCK_READERS: [&str; 21] = [
    "crates/lookdown-count/src/follower.rs",
    "crates/lookdown-count/src/http/shared.rs",
    "crates/lookdown-count/src/now.rs",
    "crates/lookdown-count/src/run.rs",
    "crates/lookdown-count/src/webhooks/delivery.rs",
    "crates/lookdown-detect/src/pipeline/job.rs",
    "crates/lookdown-http/src/request_id.rs",
    "crates/lookdown-watch/src/source/folder.rs",
    "crates/lookdown-watch/src/source/sink.rs",
    "src/api/protocols/open_inference/persons.rs",
    "src/api/routes/cameras.rs",
    "src/api/routes/cameras/reference_counts.rs",
    "src/api/routes/results.rs",
    "src/api/detect/upload.rs",
    "src/app.rs",
    "src/calibration_store.rs",
    "src/mqtt/publisher.rs",
    "src/results/memory.rs",
    "src/results/redis.rs",
    "src/telemetry.rs",
    // The validity of certificates.
    "src/tls.rs",
];

/// Calls that make HTTP clients. That of `http_transport.rs` bounds the provisional responses of
/// its peers. The others end every request at a timeout, until which endless provisional responses
/// keep one core busy (`provisional_responses_end_at_the_timeout`). Each has the reason for its own
/// client.
const CLIENTS: [&str; 3] = [
    " Client::builder()",
    " Client::new()",
    "legacy::Client::builder(",
];
/// The files that may make them.
const CLIENT_MAKERS: [&str; 5] = [
    "crates/lookdown-common/src/http_transport.rs",
    // Used by blocking threads without a runtime; three failures open the breaker.
    "crates/lookdown-detect/src/inference/remote/connection.rs",
    // The calculation of digests.
    "crates/lookdown-watch/src/credentials.rs",
    // Asks this machine's own server, whose certificate is for other names; ends after 3 s.
    "src/probe.rs",
    // Uses the proxies of the system; ends after 5 s.
    "src/telemetry.rs",
];

/// The source files of all crates without those of tests.
fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap();
        if path.is_dir() && name != "tests" {
            sources(&path, found);
        } else if path.extension().is_some_and(|ending| ending == "rs") && name != "tests.rs" {
            found.push(path);
        }
    }
}

/// The files outside `allowed` with one of these calls, each with the call.
fn callers(calls: &[&str], allowed: &[&str]) -> Vec<String> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut files = Vec::new();
    sources(&root.join("src"), &mut files);
    for entry in fs::read_dir(root.join("crates")).unwrap() {
        sources(&entry.unwrap().path().join("src"), &mut files);
    }
    assert!(files.len() > 400, "{}", files.len());
    let mut found = Vec::new();
    for path in files {
        let text = fs::read_to_string(&path).unwrap();
        // Tests are at the end of a file.
        let program = text.split("#[cfg(test)]\nmod ").next().unwrap();
        let program = code(program);
        let place = path.strip_prefix(root).unwrap().display().to_string();
        for call in calls {
            if program.contains(call) && !allowed.contains(&&*place) {
                found.push(format!("{place}: {call}"));
            }
        }
    }
    found
}

#[test]
fn files_are_read_by_one_module() {
    let found = callers(&READS, &READERS);
    assert!(
        found.is_empty(),
        "use lookdown_common::files: it reads regular files only, with a limit: {found:#?}"
    );
}

#[test]
fn processes_are_started_by_one_module() {
    let found = callers(&STARTS, &STARTERS);
    assert!(
        found.is_empty(),
        "use `child::spawn`, which limits the process: {found:#?}"
    );
}

#[test]
fn keys_are_compared_once_for_each_request() {
    let mut found = callers(&COMPARISONS, &COMPARERS);
    found.extend(callers(&REPEATED, &LASTING));
    assert!(
        found.is_empty(),
        "read RequestContext, which holds the identity: {found:#?}"
    );
}

#[test]
fn only_listed_files_read_the_clock() {
    let found = callers(&CLOCKS, &CLOCK_READERS);
    assert!(
        found.is_empty(),
        "use the monotonic clock, or state what holds when the clock jumps: {found:#?}"
    );
}

#[test]
fn only_listed_files_make_http_clients() {
    let found = callers(&CLIENTS, &CLIENT_MAKERS);
    assert!(
        found.is_empty(),
        "use lookdown_common::HttpClient, which bounds provisional responses: {found:#?}"
    );
}
