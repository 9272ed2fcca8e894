//! A server whose bucket also has objects of strangers, beside three valid calibrations.

use std::{
    fmt::Write as _,
    io::{Read, Write},
    net::{SocketAddr, TcpListener, TcpStream},
    thread,
    time::Duration,
};

use crate::buckets::service::Service;

const VALID: [&str; 3] = ["canteen", "lobby", "yard"];
/// Objects that are answered with something else than a calibration.
const HOSTILE: [&str; 9] = [
    "endless",
    "huge",
    "slow",
    "silent",
    "truncated",
    "json",
    "deep",
    "garbage",
    "provisional",
];
/// Names that the provider's client refuses.
const REFUSED: [&str; 6] = [
    "ceiling/..",
    "ceiling/.",
    "ceiling/a/../b",
    "ceiling/./x",
    "ceiling/a//b",
    "ceiling/a&#10;b",
];
/// More objects than a page of a listing has.
const OTHERS: usize = 1500;
const PAGE: usize = 1000;
const HEAD: &str = "ETag: \"1\"\r\nLast-Modified: Mon, 23 Nov 2026 09:00:00 GMT\r\n";

/// Starts the S3 server.
fn start() -> SocketAddr {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap();
    named(move || {
        for stream in listener.incoming().map_while(Result::ok) {
            named(move || serve(stream));
        }
    });
    address
}

fn named<T: Send + 'static>(work: impl FnOnce() -> T + Send + 'static) {
    let thread = thread::Builder::new().name("hostile-bucket".to_owned());
    thread.spawn(work).unwrap();
}

/// Answers the requests of a connection until one is not answered.
fn serve(mut stream: TcpStream) -> Option<()> {
    loop {
        let mut head = Vec::new();
        while !head.ends_with(b"\r\n\r\n") {
            let mut byte = [0];
            stream.read_exact(&mut byte).ok()?;
            head.push(byte[0]);
        }
        let head = String::from_utf8_lossy(&head).into_owned();
        let target = head.split(' ').nth(1)?;
        if target.contains("list-type=2") {
            respond(&mut stream, &listing(target))?;
            continue;
        }
        let name = target.rsplit('/').next()?.trim_end_matches(".json");
        answer(&mut stream, name)?;
    }
}

fn respond(stream: &mut TcpStream, body: &str) -> Option<()> {
    let length = body.len();
    let head = format!("HTTP/1.1 200 OK\r\n{HEAD}Content-Length: {length}\r\n\r\n");
    stream.write_all((head + body).as_bytes()).ok()
}

/// A page of all objects, sorted as S3 sorts them, in pages of [`PAGE`].
fn listing(target: &str) -> String {
    let number = target.split("continuation-token=").nth(1);
    let number = number.and_then(|rest| rest.split('&').next()?.parse().ok());
    let page: usize = number.unwrap_or_default();
    let own = VALID.iter().chain(&HOSTILE);
    let own = own.map(|name| format!("ceiling/{name}.json"));
    let others = (0..OTHERS).map(|number| format!("ceiling/aaa{number}.json"));
    let names: Vec<_> = REFUSED
        .map(ToOwned::to_owned)
        .into_iter()
        .chain(others)
        .chain(own)
        .collect();
    let mut objects = String::new();
    for name in names.iter().skip(page * PAGE).take(PAGE) {
        let _ = write!(
            objects,
            "<Contents><Key>{name}</Key><LastModified>2026-11-23T09:00:00.000Z</LastModified>\
             <ETag>\"1\"</ETag><Size>1</Size></Contents>"
        );
    }
    if (page + 1) * PAGE < names.len() {
        let next = page + 1;
        let _ = write!(
            objects,
            "<NextContinuationToken>{next}</NextContinuationToken>"
        );
    }
    format!(
        "<ListBucketResult>{objects}<CommonPrefixes><Prefix>ceiling//</Prefix></CommonPrefixes></ListBucketResult>"
    )
}

/// Answers a request for an object. `None` ends the connection.
fn answer(stream: &mut TcpStream, name: &str) -> Option<()> {
    let length = |length: u64| format!("HTTP/1.1 200 OK\r\n{HEAD}Content-Length: {length}\r\n\r\n");
    let mut start = |text: String| stream.write_all(text.as_bytes()).ok();
    let (rest, pause): (&[u8], _) = match name {
        "endless" => {
            start(length(1 << 50))?;
            (&[b' '; 1 << 13], 0)
        }
        "huge" => {
            start(length(50_000_000))?;
            (&[b'{'; 1 << 13], 0)
        }
        "slow" => {
            start(length(1000))?;
            (b" ", 100)
        }
        "silent" => (b"", 100),
        "truncated" => {
            start(length(1000) + "{")?;
            return None;
        }
        "json" => return respond(stream, r#"{"id": 7, "lens": []}"#),
        "deep" => return respond(stream, &"[".repeat(500_000)),
        "garbage" => {
            start("\u{1}\u{2}\r\n\r\n".to_owned())?;
            return None;
        }
        "provisional" => (b"HTTP/1.1 103 Early Hints\r\n\r\n", 0),
        valid => {
            let file = format!(
                r#"{{"id":"{valid}","image":{{"width":600,"height":600}},
                    "lens":{{"model":"equidistant","focal":190.0,"cx":299.5,"cy":299.5}}}}"#
            );
            // Those of strangers say nothing.
            return respond(stream, if VALID.contains(&valid) { &file } else { "{}" });
        }
    };
    loop {
        stream.write_all(rest).ok()?;
        thread::sleep(Duration::from_millis(pause));
    }
}

#[test]
fn objects_of_strangers_leave_valid_calibrations_usable() {
    let service = Service::start(start());
    for id in VALID {
        service.wait_for(&format!("/calibrations/{id}"), |answer| {
            answer.starts_with("HTTP/1.1 200")
        });
    }
    let counts = format!(
        "\"serving\":{},\"problem_count\":{}",
        VALID.len(),
        HOSTILE.len() + OTHERS
    );
    service.wait_for("/readyz", |answer| answer.contains(&counts));
    let log = service.log_with("objects of the bucket of the calibrations are skipped");
    assert!(log.contains("7 objects of the bucket"), "{log}");
    assert!(service.get("/livez").starts_with("HTTP/1.1 200"));
}
