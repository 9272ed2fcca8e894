//! `lookdown health`: the answer of a server as an exit code.

use std::{
    io::{BufRead, BufReader, Write},
    net::TcpListener,
    process::Output,
    thread,
};

use super::{assert_fails_with, lookdown};

/// Runs the health check against a server with this answer. Returns its output, and the request.
fn asked(answer: &'static str, arguments: &[&str]) -> (Output, String) {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap().to_string();
    let answering = move || {
        let (mut connection, _) = listener.accept().unwrap();
        let mut lines = BufReader::new(connection.try_clone().unwrap()).lines();
        let first = lines.next().unwrap().unwrap();
        lines.map(Result::unwrap).find(String::is_empty);
        connection.write_all(answer.as_bytes()).unwrap();
        first
    };
    let server = thread::Builder::new().name("server".to_owned());
    let server = server.spawn(answering).unwrap();
    let output = lookdown(arguments, &[("LOOKDOWN__SERVER__LISTEN", &address)]);
    (output, server.join().unwrap())
}

#[test]
fn a_ready_server_gives_exit_code_0() {
    let yes = "HTTP/1.1 200 OK\r\ncontent-length: 0\r\n\r\n";
    let (output, request) = asked(yes, &["health"]);
    assert!(output.status.success(), "{output:?}");
    assert_eq!(request, "GET /readyz HTTP/1.1");
    assert_eq!(asked(yes, &["health", "--live"]).1, "GET /livez HTTP/1.1");
}

#[test]
fn a_server_that_is_not_ready_gives_exit_code_1() {
    let no = "HTTP/1.1 503 Service Unavailable\r\ncontent-length: 0\r\n\r\n";
    let (output, _) = asked(no, &["health"]);
    assert_fails_with(&output, &["/readyz answered 503"]);
}

#[test]
fn a_missing_server_gives_exit_code_1() {
    let unused = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = unused.local_addr().unwrap().to_string();
    drop(unused);
    let output = lookdown(&["health"], &[("LOOKDOWN__SERVER__LISTEN", &address)]);
    assert_fails_with(&output, &[&address, "lookdown serve"]);
}
