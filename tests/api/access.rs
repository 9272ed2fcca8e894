//! Authorization: keys, scopes and origins.

use std::{collections::HashMap, fs, path::Path, sync::Arc};

use lookdown::{
    access::{AccessKeys, KeyDigest},
    api::{Access, Companions},
    settings,
};

use crate::{
    log::Log,
    service::{Bounds, OPEN_PATHS, Service},
};

pub(crate) const FINDER: &str = "lookdown_finder";
pub(crate) const READER: &str = "lookdown_reader";
pub(crate) const ADMINISTRATOR: &str = "lookdown_administrator";
pub(crate) const VIEWER: &str = "lookdown_viewer";
pub(crate) const BOTH: &str = "lookdown_both";

/// All routes that need a scope.
const GUARDED: [(&str, &str, &str); 20] = [
    ("POST", "/detect?calibration=lobby&profile=fast", "detect"),
    ("POST", "/v1/vision/detection", "detect"),
    ("POST", "/v1/vision/custom/lobby", "detect"),
    ("POST", "/v1/vision/custom/list", "read"),
    ("GET", "/v1/vision/custom/list", "read"),
    ("GET", "/v2/models/lookdown", "detect"),
    ("GET", "/v2/models/lookdown/ready", "detect"),
    ("POST", "/v2/models/lookdown/infer", "detect"),
    ("GET", "/calibrations", "read"),
    ("GET", "/calibrations/lobby", "read"),
    ("GET", "/calibrations/lobby/views", "read"),
    ("POST", "/calibrations/lobby/views", "read"),
    ("GET", "/results", "read"),
    ("GET", "/results/lobby/latest", "read"),
    ("GET", "/results/lobby/history", "read"),
    ("GET", "/results/lobby/events", "read"),
    ("GET", "/events", "read"),
    ("PUT", "/calibrations/lobby", "admin"),
    ("DELETE", "/calibrations/missing", "admin"),
    ("DELETE", "/results/missing", "admin"),
];

/// A line of a file of keys.
pub(crate) fn line(name: &str, scopes: &str, key: &str) -> String {
    let digest = KeyDigest::new(key.as_bytes()).hexadecimal();
    format!("{name} = {{ scopes = [{scopes}], sha256 = \"{digest}\" }}\n")
}

fn write_keys(file: &Path) {
    let lines = [
        line("finder", "\"detect\"", FINDER),
        line("reader", "\"read\"", READER),
        line("administrator", "\"admin\"", ADMINISTRATOR),
        line("viewer", "\"view\"", VIEWER),
        line("both", "\"detect\", \"read\"", BOTH),
    ];
    fs::write(file, lines.concat()).unwrap();
}

pub(crate) fn service_with(keys: &Arc<AccessKeys>) -> Service {
    Service::within(&Bounds {
        access: Access::Keys(Arc::clone(keys)),
        ..Bounds::default()
    })
}

pub(crate) fn guarded() -> Service {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("keys.toml");
    write_keys(&file);
    let keys = AccessKeys::open("".parse().unwrap(), Some(&file)).unwrap();
    service_with(&Arc::new(keys))
}

async fn reads(service: &Service, headers: &[(&str, &str)]) -> u16 {
    let answer = service.ask("GET", "/calibrations", headers).await;
    answer.status.as_u16()
}

async fn reads_with(service: &Service, key: &str) -> u16 {
    reads(service, &[("x-api-key", key)]).await
}

#[tokio::test]
async fn probes_metrics_and_pages_never_need_a_key() {
    let service = guarded();
    for path in OPEN_PATHS {
        let answer = service.get(path).await;
        assert!(answer.status.as_u16() < 400, "{path}: {}", answer.status);
    }
    reads_with(&service, READER).await;
    let metrics = service.get("/metrics").await.text();
    for word in ["reader", "finder", READER] {
        assert!(!metrics.contains(word), "a key's name became a label");
    }
}

#[tokio::test]
async fn lines_of_cameras_in_metrics_need_the_scope_read() {
    let labels = ["camera", "line", "site", "zone"];
    let lines = labels.map(|label| format!("persons{{x=\"y\",{label}=\"hall\"}} 6\n"));
    let companions = Companions::default();
    companions.set_metrics("counts", move || {
        [&lines.concat(), "connected 1\n"].concat().into_bytes()
    });
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("keys.toml");
    write_keys(&file);
    let keys = AccessKeys::open("".parse().unwrap(), Some(&file)).unwrap();
    let with_keys = Access::Keys(Arc::new(keys));
    let open = Access::Open {
        own_machine_only: true,
    };
    let [guarded, open] = [with_keys, open].map(|access| {
        Service::within(&Bounds {
            access,
            companions: companions.clone(),
            ..Bounds::default()
        })
    });
    for (service, header, is_shown) in [
        (&guarded, ("x-api-key", READER), true),
        (&guarded, ("x-api-key", FINDER), false),
        (&guarded, ("accept", "*/*"), false),
        (&open, ("host", "localhost"), true),
        (&open, ("host", "evil.example"), false),
    ] {
        let metrics = service.ask("GET", "/metrics", &[header]).await.text();
        assert!(metrics.contains("connected 1\n"), "{header:?}");
        let shown = metrics.matches("hall").count();
        assert_eq!(shown, if is_shown { 4 } else { 0 }, "{header:?}");
    }
}

#[tokio::test]
async fn a_key_is_a_bearer_token_or_a_header_and_sent_once() {
    let service = guarded();
    let bearer = format!("Bearer {READER}");
    let lower = format!("bearer  {READER}");
    for header in [
        ("authorization", bearer.as_str()),
        ("authorization", lower.as_str()),
        ("x-api-key", READER),
    ] {
        assert_eq!(reads(&service, &[header]).await, 200, "{header:?}");
    }
    // The scheme Basic may be meant for a proxy.
    let headers = [("authorization", "Basic dTpw"), ("x-api-key", READER)];
    assert_eq!(reads(&service, &headers).await, 200);

    let token = format!("Token {READER}");
    let unspaced = format!("Bearer{READER}");
    for headers in [
        &[("authorization", READER)][..],
        &[("authorization", token.as_str())],
        &[("authorization", unspaced.as_str())],
        &[("authorization", "Bearer ")],
        &[("x-api-key", "")],
        &[("authorization", bearer.as_str()), ("x-api-key", READER)],
        &[("x-api-key", READER), ("x-api-key", ADMINISTRATOR)],
    ] {
        assert_eq!(reads(&service, headers).await, 401, "{headers:?}");
    }
    let in_query = service.get(&format!("/calibrations?key={READER}")).await;
    assert_eq!(in_query.status, 401);
}

#[tokio::test]
async fn parts_and_digests_of_keys_are_refused() {
    let service = guarded();
    for end in 0..READER.len() {
        assert_eq!(reads_with(&service, &READER[..end]).await, 401, "{end}");
    }
    let digest = KeyDigest::new(READER.as_bytes()).hexadecimal();
    let longer = format!("{READER}0");
    let upper = READER.to_uppercase();
    for wrong in [digest.as_str(), &longer, &upper] {
        assert_eq!(reads_with(&service, wrong).await, 401, "{wrong}");
    }
    assert_eq!(reads_with(&service, READER).await, 200);
}

#[tokio::test]
async fn a_replaced_keys_file_revokes_the_old_key() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("keys.toml");
    write_keys(&file);
    let lasting = format!("lasting:read:{}", KeyDigest::new(b"lasting").hexadecimal());
    let keys = Arc::new(AccessKeys::open(lasting.parse().unwrap(), Some(&file)).unwrap());
    let service = service_with(&keys);
    assert_eq!(reads_with(&service, READER).await, 200);
    assert_eq!(reads_with(&service, "new").await, 401);

    fs::write(&file, line("reader", "\"read\"", "new")).unwrap();
    keys.refresh();
    assert_eq!(reads_with(&service, READER).await, 401);
    assert_eq!(reads_with(&service, "new").await, 200);

    fs::write(&file, "").unwrap();
    keys.refresh();
    assert_eq!(
        reads_with(&service, "new").await,
        401,
        "an empty file grants no access"
    );
    assert_eq!(reads_with(&service, "lasting").await, 200);
}

/// The lines of the log of all tests that name `file` and contain `reason`.
fn reports_of(log: &str, file: &Path, reason: &str) -> Vec<String> {
    let name = file.display().to_string();
    let lines = log.lines();
    lines
        .filter(|line| line.contains(&name) && line.contains(reason))
        .map(str::to_owned)
        .collect()
}

#[tokio::test]
async fn an_invalid_keys_file_keeps_the_keys_and_is_logged_once() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("keys.toml");
    write_keys(&file);
    let keys = Arc::new(AccessKeys::open("".parse().unwrap(), Some(&file)).unwrap());
    let service = service_with(&keys);
    let huge = "#".repeat(2 << 20);
    for (broken, reason) in [
        (format!("reader = {{ {READER}"), "line 1:"),
        ("\nreader = { scopes = [] }".to_owned(), "line 2:"),
        (huge, "more than 1 MiB"),
    ] {
        fs::write(&file, broken).unwrap();
        let log = Log::start();
        keys.refresh();
        keys.refresh();
        let reports = reports_of(&log.text(), &file, reason);
        assert_eq!(reports.len(), 1, "{reports:?}");
        assert!(reports[0].contains("ERROR"), "{reports:?}");
        assert!(!log.text().contains(READER));
        assert_eq!(reads_with(&service, READER).await, 200);
    }
    fs::remove_file(&file).unwrap();
    keys.refresh();
    assert_eq!(reads_with(&service, READER).await, 200);
    assert!(AccessKeys::open("".parse().unwrap(), Some(&file)).is_err());
}

#[tokio::test]
async fn a_broken_line_of_a_key_takes_no_access_of_others() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("keys.toml");
    write_keys(&file);
    let keys = Arc::new(AccessKeys::open("".parse().unwrap(), Some(&file)).unwrap());
    let service = service_with(&keys);
    let digest = KeyDigest::new(b"other").hexadecimal();
    let other = format!("other = {{ scopes = [\"read\"], sha256 = \"{digest}\" }}\n");
    fs::write(&file, format!("{other}reader = {{ scopes = [] }}\n")).unwrap();
    let log = Log::start();
    keys.refresh();
    keys.refresh();
    let reports = reports_of(&log.text(), &file, "line 2:");
    assert_eq!(reports.len(), 1, "{reports:?}");
    assert_eq!(reads_with(&service, READER).await, 401);
    assert_eq!(reads_with(&service, "other").await, 200);
}

#[test]
fn debug_output_reveals_no_keys() {
    let digest = KeyDigest::new(b"secret").hexadecimal();
    let variable = "LOOKDOWN__ACCESS__KEYS".to_owned();
    let environment = HashMap::from([(variable, format!("gate:detect:{digest}"))]);
    let settings = settings::load(None, environment).unwrap();
    let keys = AccessKeys::open(settings.access.keys.clone(), None).unwrap();
    for shown in [format!("{settings:?}"), format!("{keys:?}")] {
        assert!(shown.contains("gate"), "{shown}");
        assert!(!shown.contains(&digest), "{shown}");
    }
}

#[tokio::test]
async fn without_keys_remote_clients_may_detect_and_read_only() {
    let service = Service::within(&Bounds {
        access: Access::Open {
            own_machine_only: false,
        },
        ..Bounds::default()
    });
    for (method, path, scope) in GUARDED {
        let answer = service.ask(method, path, &[]).await;
        assert_eq!(answer.status == 403, scope == "admin", "{method} {path}");
    }
}

#[tokio::test]
async fn only_pages_of_configured_origins_may_call() {
    let service = Service::within(&Bounds {
        cors_origins: vec!["https://dashboard.example".to_owned()],
        ..Bounds::default()
    });
    let ask_first = [
        ("origin", "https://dashboard.example"),
        ("access-control-request-method", "PUT"),
        ("access-control-request-headers", "authorization,x-api-key"),
    ];
    let answer = service
        .ask("OPTIONS", "/calibrations/lobby", &ask_first)
        .await;
    assert_eq!(answer.status, 200);
    let header = |name: &str| answer.header(name).to_lowercase();
    assert_eq!(
        header("access-control-allow-origin"),
        "https://dashboard.example"
    );
    for name in [
        "authorization",
        "x-api-key",
        "inference-header-content-length",
    ] {
        assert!(header("access-control-allow-headers").contains(name));
    }
    let document: serde_json::Value =
        serde_json::from_slice(include_bytes!("../../openapi/openapi.json")).unwrap();
    let paths = document["paths"].as_object().unwrap().values();
    for method in paths.flat_map(|path| path.as_object().unwrap().keys()) {
        let methods = header("access-control-allow-methods");
        assert!(methods.contains(method), "{methods} lacks {method}");
    }

    let allowed = "access-control-allow-origin";
    let page = [("origin", "https://dashboard.example")];
    let refused = service.ask("GET", "/calibrations/missing", &page).await;
    assert_eq!(
        (refused.status.as_u16(), refused.header(allowed)),
        (404, page[0].1)
    );
    let stranger = [("origin", "https://dashboard.example.evil")];
    let answer = service.ask("GET", "/calibrations", &stranger).await;
    assert!(!answer.headers.contains_key(allowed));
    let none = Service::start().ask("GET", "/calibrations", &page).await;
    assert!(!none.headers.contains_key(allowed));
}
