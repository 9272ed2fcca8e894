//! The example in Rust against a server.

use super::serve::{NO_GRACE, Server};

#[path = "../../docs/examples/detect.rs"]
#[expect(dead_code, reason = "only its `main` is the program")]
mod detect;

#[test]
fn the_example_in_rust_finds_the_persons_of_a_sample() {
    let office = include_bytes!("../../samples/office.jpg");
    let server = Server::start("unset LOOKDOWN__MODEL__PATH", &[NO_GRACE]);
    let persons = detect::persons(office, &server.address()).unwrap();
    assert!(persons.len() > 3, "{persons:?}");
    let refused = detect::persons(b"no image", &server.address()).unwrap_err();
    assert!(refused.to_string().contains("415"), "{refused}");
    server.signal("TERM");
    server.has_ended();
}
