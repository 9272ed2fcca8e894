//! Tests against responses that are made to fill memory and logs.

use serde_json::json;

use super::{
    detect,
    fake::{FakeServer, ScriptedReply},
    load, manifest, server,
};

/// Longest error, bytes: room for its own words and for some shortened names.
const MAX_ERROR_BYTES: usize = 2000;

#[test]
fn errors_repeat_little_of_a_response() {
    let fake = FakeServer::start(true, -1);
    let folder = manifest();
    let long = "n".repeat(1 << 20);
    let output = |name: &str, shape: serde_json::Value| {
        let output = json!({ "name": name, "datatype": "FP32", "shape": shape, "data": [1] });
        json!({ "outputs": [output] }).to_string()
    };
    let many = vec![json!({ "name": "", "datatype": "FP32", "shape": [1], "data": [1] }); 17];
    for (reply, part) in [
        (output(&long, json!([1])), "no output"),
        (output(&long, json!([2])), "needs 2"),
        (output("boxes", json!(long)), "cannot be read"),
        (output("boxes", json!(vec![1; 17])), "more than 16"),
        (json!({ "outputs": many }).to_string(), "more than 16"),
    ] {
        let server = server(&fake);
        let mut detector = load(&server, folder.path()).unwrap();
        fake.queue(ScriptedReply::status(200).body(reply));
        let error = detect(&mut detector, 1).unwrap_err().to_string();
        assert!(error.contains(part), "{part}: {}", &error[..200]);
        assert!(error.len() < MAX_ERROR_BYTES, "{part}: {}", error.len());
    }
}

#[test]
fn huge_metadata_is_refused_in_a_short_sentence() {
    let folder = manifest();
    let input = |name: &str, axes: usize| json!({ "name": name, "datatype": "FP32", "shape": vec![1; axes] });
    let model = |inputs: Vec<serde_json::Value>, outputs: Vec<serde_json::Value>| {
        json!({ "inputs": inputs, "outputs": outputs }).to_string()
    };
    let regular = json!({ "name": "images", "datatype": "FP32", "shape": [-1, 3, 32, 32] });
    for (metadata, part) in [
        (
            model(vec![input("a", 1 << 20)], vec![input("b", 2)]),
            "longer than 1048576 bytes",
        ),
        (model(vec![input("a", 17)], vec![input("b", 2)]), "17 axes"),
        (
            model(vec![input(&"n".repeat(1000), 2)], vec![input("b", 2)]),
            "too long",
        ),
        (
            model(vec![regular], vec![input("b", 2); 10_000]),
            "no output",
        ),
        (
            json!({ "inputs": "n".repeat(100_000) }).to_string(),
            "cannot be read",
        ),
    ] {
        let fake = FakeServer::start(true, -1);
        fake.describe(metadata);
        let error = load(&server(&fake), folder.path())
            .err()
            .unwrap()
            .to_string();
        assert!(error.contains(part), "{part}: {}", &error[..200]);
        assert!(error.len() < MAX_ERROR_BYTES, "{part}: {}", error.len());
    }
}
