//! Every operation of the OpenAPI documents with every kind of key, and every other method of their
//! paths.

use std::fs;

use serde_json::Value;
use tokio::task::spawn_blocking;

use crate::{
    access::{ADMINISTRATOR, BOTH, FINDER, READER, VIEWER, guarded},
    listeners::{KEY, accepts, answer, start_count, status},
    service::{Answer, Service},
};

const METHODS: [&str; 5] = ["GET", "POST", "PUT", "DELETE", "PATCH"];
/// The values of the parameters in paths.
const PARAMETERS: [(&str, &str); 11] = [
    ("{calibration}", "lobby"),
    ("{camera}", "lobby"),
    ("{from}", "2026-11-22T09:00:00Z"),
    ("{id}", "lobby"),
    ("{person}", "1"),
    ("{report}", "1"),
    ("{site}", "ground"),
    ("{thing}", "1"),
    ("{version}", "1"),
    ("/problems/{name}", "/problems/not-found"),
    ("{name}", "eager"),
];
/// Keys of the tests, each with the scopes that it allows.
const KEYS: [(&str, &[&str]); 5] = [
    (FINDER, &["detect"]),
    (READER, &["read"]),
    (VIEWER, &["view"]),
    (BOTH, &["detect", "read"]),
    (ADMINISTRATOR, &["detect", "read", "view", "admin"]),
];

/// An operation of the document.
struct Operation {
    method: String,
    path: String,
    /// The scope that it needs.
    scope: Option<String>,
}

/// Every operation of the server, and of the counts that it forwards.
async fn operations(service: &Service) -> Vec<Operation> {
    let mut operations = documented(&service.get("/openapi.json").await.json());
    let counts = documented(&counts_document()).into_iter();
    let forwarded = ["/counts", "/sites", "/cameras"];
    let is_forwarded = |path: &str| forwarded.iter().any(|start| path.starts_with(start));
    operations.extend(counts.filter(|operation| is_forwarded(&operation.path)));
    operations
}

fn counts_document() -> Value {
    serde_json::to_value(lookdown_count::openapi_document()).unwrap()
}

/// Every operation of a document, with values in its path.
fn documented(document: &Value) -> Vec<Operation> {
    let mut operations = Vec::new();
    let known = METHODS.map(str::to_lowercase);
    for (path, item) in document["paths"].as_object().unwrap() {
        let mut filled = path.clone();
        for (parameter, value) in PARAMETERS {
            filled = filled.replace(parameter, value);
        }
        assert!(!filled.contains('{'), "{path}: give its parameter a value");
        for key in item.as_object().unwrap().keys() {
            let is_known = known.contains(key) || ["parameters", "summary"].contains(&&**key);
            assert!(is_known, "{path}: {key} is not in METHODS");
        }
        for method in METHODS {
            let operation = &item[method.to_lowercase()];
            if operation.is_object() {
                operations.push(Operation {
                    method: method.to_owned(),
                    path: filled.clone(),
                    scope: scope(operation),
                });
            }
        }
    }
    operations
}

fn scope(operation: &Value) -> Option<String> {
    let mut security = operation["security"].as_array().unwrap().iter();
    security.find_map(|way| Some(way["api_key"][0].as_str()?.to_owned()))
}

async fn ask(service: &Service, method: &str, path: &str, key: Option<&str>) -> Answer {
    let headers = key.map(|key| ("x-api-key", key));
    service.ask(method, path, headers.as_slice()).await
}

#[tokio::test]
async fn every_operation_needs_the_scope_of_the_document() {
    let service = guarded();
    let operations = operations(&service).await;
    assert!(operations.len() >= 49, "{}", operations.len());
    for Operation {
        method,
        path,
        scope,
    } in operations
    {
        let place = format!("{method} {path}");
        for key in [None, Some("lookdown_unknown")] {
            let answer = ask(&service, &method, &path, key).await;
            match scope {
                Some(_) => {
                    assert_eq!(answer.status, 401, "{place}");
                    assert_eq!(answer.header("www-authenticate"), "Bearer", "{place}");
                    assert_eq!(answer.problem()["type"], "/problems/key-required");
                }
                None => assert!(![401, 403].contains(&answer.status.as_u16()), "{place}"),
            }
        }
        for (key, scopes) in KEYS {
            let answer = ask(&service, &method, &path, Some(key)).await;
            let text = answer.text();
            assert!(!text.contains(key), "{place} repeats the key");
            match &scope {
                Some(scope) if !scopes.contains(&&**scope) => {
                    assert_eq!(answer.status, 403, "{place} with {scopes:?}");
                    assert_eq!(answer.problem()["type"], "/problems/forbidden");
                    assert!(text.contains(scope.as_str()), "{place}: {text}");
                }
                _ => {
                    let is_refused = [401, 403].contains(&answer.status.as_u16());
                    assert!(!is_refused, "{place} with {scopes:?}: {text}");
                }
            }
        }
    }
}

#[tokio::test]
async fn methods_outside_the_document_are_refused() {
    let service = guarded();
    let operations = operations(&service).await;
    for Operation { path, .. } in &operations {
        for method in METHODS {
            let is_documented =
                |operation: &Operation| operation.method == method && operation.path == *path;
            if operations.iter().any(is_documented) {
                continue;
            }
            let answer = ask(&service, method, path, None).await;
            let status = answer.status.as_u16();
            assert!(
                [401, 404, 405].contains(&status),
                "{method} {path}: {status}"
            );
        }
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn every_operation_of_the_counts_needs_the_key() {
    let folder = tempfile::tempdir().unwrap();
    let key_file = folder.path().join("key");
    fs::write(&key_file, KEY).unwrap();
    let (address, counting) = start_count(folder.path(), Some(key_file));
    accepts(address).await;
    let operations = documented(&counts_document());
    assert!(operations.len() >= 14, "{}", operations.len());
    for Operation { path, scope, .. } in &operations {
        let same = operations.iter().filter(|other| other.path == *path);
        let methods: Vec<_> = same.map(|other| other.method.clone()).collect();
        for method in METHODS {
            for key in [None, Some("another"), Some(KEY)] {
                let header = key.map_or(String::new(), |key| format!("X-API-Key: {key}\r\n"));
                let head = format!("{method} {path} HTTP/1.1\r\nHost: localhost\r\n{header}");
                let request = head + "Content-Length: 0\r\nConnection: close\r\n\r\n";
                let answer = spawn_blocking(move || answer(address, &request)).await;
                let status = status(&answer.unwrap());
                let expected = match (&scope, key) {
                    (Some(_), None | Some("another")) => [401].as_slice(),
                    _ if !methods.contains(&method.to_owned()) => &[405],
                    // No camera and no site is known.
                    _ => &[200, 404],
                };
                assert!(
                    expected.contains(&status),
                    "{method} {path} with {key:?}: {status}"
                );
            }
        }
    }
    counting.abort();
}
