//! A bucket as a calibration store.

use std::net::TcpListener;

use lookdown::calibration_store::{BucketStore, CalibrationStore, Replaces, StoreError};

use crate::buckets::s3_server::{S3Server, SECRET, store};

fn names(store: &BucketStore) -> Vec<String> {
    let mut names: Vec<_> = store
        .list()
        .unwrap()
        .into_iter()
        .map(|file| file.name)
        .collect();
    names.sort();
    names
}

#[test]
fn objects_of_one_level_are_written_read_replaced_and_deleted() {
    let server = S3Server::start();
    let store = server.store();
    assert_eq!(names(&store), [""; 0]);
    store
        .write("lobby.json", b"one", Replaces::Nothing)
        .unwrap();
    store
        .write("yard.json", b"three", Replaces::Anything)
        .unwrap();
    let deeper = self::store("s3://cameras/ceiling/old", server.address);
    deeper
        .write("lobby.json", b"old", Replaces::Anything)
        .unwrap();
    assert_eq!(names(&store), ["lobby.json", "yard.json"]);

    let seen = store.list().unwrap();
    assert_eq!(store.list().unwrap(), seen, "stamps change without a write");
    let lobby = seen.iter().find(|file| file.name == "lobby.json").unwrap();
    let replaces = Replaces::Stamp(&lobby.stamp);
    store.write("lobby.json", b"two", replaces).unwrap();
    for outdated in [replaces, Replaces::Nothing] {
        let refused = store.write("lobby.json", b"four", outdated);
        assert!(
            matches!(refused, Err(StoreError::Changed { .. })),
            "{refused:?}"
        );
    }
    assert_ne!(store.list().unwrap(), seen);

    let contents = store.read(&["yard.json", "lobby.json", "gone.json"], 3);
    assert_eq!(contents[0].as_ref().unwrap(), b"thr", "not truncated");
    assert_eq!(contents[1].as_ref().unwrap(), b"two");
    assert!(
        matches!(contents[2], Err(StoreError::Failed { .. })),
        "{contents:?}"
    );

    store.delete("lobby.json").unwrap();
    store.delete("lobby.json").unwrap();
    assert_eq!(names(&store), ["yard.json"]);
    let whole = self::store("s3://cameras", server.address);
    assert_eq!(names(&whole), [""; 0], "a prefix is not an object");
}

#[test]
fn the_error_of_a_missing_bucket_holds_no_secrets() {
    let server = S3Server::start();
    let error = store("s3://elsewhere/x", server.address)
        .list()
        .unwrap_err()
        .to_string();
    assert_eq!(
        error,
        "s3://elsewhere/x: it answers with an error (404 Not Found, NoSuchBucket)"
    );
}

#[test]
fn an_unreachable_server_gives_the_same_error_every_time() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let silent = store("s3://cameras", listener.local_addr().unwrap());
    let error = silent.list().unwrap_err().to_string();
    assert_eq!(error, "s3://cameras cannot be reached: no answer in time");
    let contents = silent.read(&["lobby.json"; 4], 10);
    assert!(
        contents
            .iter()
            .all(|content| matches!(content, Err(StoreError::Unreachable { .. })))
    );

    let closed = TcpListener::bind("127.0.0.1:0")
        .unwrap()
        .local_addr()
        .unwrap();
    let refusing = store("s3://cameras", closed);
    for _ in 0..2 {
        let error = refusing.list().unwrap_err().to_string();
        assert_eq!(
            error,
            "s3://cameras cannot be reached: Connection refused (os error 111)"
        );
    }
}

#[test]
fn errors_of_invalid_addresses_hold_no_secrets() {
    let secrets = [
        ("AWS_SECRET_ACCESS_KEY", SECRET),
        ("AWS_ALLOW_HTTP", "perhaps"),
    ];
    let variables = || {
        secrets
            .iter()
            .map(|(name, value)| ((*name).to_owned(), (*value).to_owned()))
    };
    for (url, part) in [
        ("ftp://cameras/x", "ftp:// is not a bucket's address"),
        ("http://127.0.0.1/x", "http:// is not a bucket's address"),
        ("memory:///x", "memory:// is not a bucket's address"),
        ("s3://cameras", "its settings cannot be used: "),
    ] {
        let error = BucketStore::new(&url.parse().unwrap(), variables())
            .unwrap_err()
            .to_string();
        assert!(error.starts_with(&format!("{url}: {part}")), "{error}");
        assert!(!error.contains(SECRET) && !error.contains('\n'), "{error}");
    }
}

#[test]
fn the_addresses_of_every_provider_are_parsed() {
    let variables = || {
        [
            ("AZURE_STORAGE_ACCOUNT_NAME", "account"),
            ("AZURE_STORAGE_ACCOUNT_KEY", "a2V5"),
            ("GOOGLE_SKIP_SIGNATURE", "true"),
        ]
        .map(|(name, value)| (name.to_owned(), value.to_owned()))
    };
    for url in [
        "s3://cameras/ceiling",
        "https://cameras.s3.eu-west-1.amazonaws.com/ceiling",
        "gs://cameras/ceiling",
        "az://cameras/ceiling",
        "abfs://cameras@account.dfs.core.windows.net/ceiling",
        "https://account.blob.core.windows.net/cameras/ceiling",
    ] {
        let store = BucketStore::new(&url.parse().unwrap(), variables().into_iter());
        assert_eq!(store.unwrap().place(), url);
    }
}
