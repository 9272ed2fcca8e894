//! Browsers: CSRF, DNS rebinding, CORS, and the security headers of our pages.

use lookdown::api::Access;

use crate::service::{Answer, Bounds, Service};

const CHANGING: [(&str, &str); 4] = [
    ("POST", "/detect?calibration=lobby&profile=fast"),
    ("PUT", "/calibrations/lobby"),
    ("DELETE", "/calibrations/missing"),
    ("POST", "/v2/models/lookdown/infer"),
];

fn open(own_machine_only: bool) -> Service {
    Service::within(&Bounds {
        access: Access::Open { own_machine_only },
        cors_origins: vec!["https://dashboard.example".to_owned()],
        hosts: vec!["*.lookdown.example".to_owned()],
        ..Bounds::default()
    })
}

#[track_caller]
fn assert_refused(answer: &Answer, part: &str) {
    assert_eq!(answer.status, 403, "{}", answer.text());
    let problem = answer.problem();
    assert_eq!(problem["type"], "/problems/forbidden");
    assert!(problem["detail"].as_str().unwrap().contains(part));
}

#[tokio::test]
async fn cross_origin_requests_are_refused_without_keys() {
    let service = open(true);
    for (method, path) in CHANGING {
        for origin in ["https://evil.example", "http://localhost:9090", "null"] {
            let headers = [("host", "localhost:8080"), ("origin", origin)];
            let answer = service.ask(method, path, &headers).await;
            assert_refused(&answer, "access.cors_origins");
        }
        for origin in ["http://localhost:8080", "https://dashboard.example"] {
            let headers = [("host", "localhost:8080"), ("origin", origin)];
            let answer = service.ask(method, path, &headers).await;
            assert_ne!(answer.status, 403, "{method} {path} {origin}");
        }
    }
    let stranger = [
        ("host", "localhost:8080"),
        ("origin", "https://evil.example"),
    ];
    // A response that a page cannot read does no harm.
    assert_eq!(
        service.ask("GET", "/calibrations", &stranger).await.status,
        200
    );
    let elsewhere = open(false);
    let (method, path) = CHANGING[0];
    assert_refused(
        &elsewhere.ask(method, path, &stranger).await,
        "access.cors_origins",
    );
}

#[tokio::test]
async fn forwarded_requests_are_refused_on_loopback() {
    let service = open(true);
    for header in ["Forwarded", "Via", "X-Forwarded-For", "X-Real-IP"] {
        for (method, path) in [("GET", "/calibrations"), CHANGING[0], CHANGING[1]] {
            let answer = service.ask(method, path, &[(header, "203.0.113.9")]).await;
            assert_refused(&answer, "access.keys_file");
        }
        for path in ["/livez", "/readyz"] {
            let answer = service.ask("GET", path, &[(header, "203.0.113.9")]).await;
            assert_eq!(answer.status, 200, "{header} {path}");
        }
    }
}

#[tokio::test]
async fn requests_without_exactly_one_valid_host_are_refused() {
    let server = crate::server::Server::start(&[]).await;
    for hosts in [
        "",
        "Host: a{b.evil.example:18081\r\n",
        "Host: evil.example, localhost\r\n",
        "Host: localhost\r\nHost: localhost\r\n",
        "Host:\r\n",
    ] {
        for path in ["/calibrations", "/livez", "/"] {
            let request = format!("GET {path} HTTP/1.1\r\n{hosts}Connection: close\r\n\r\n");
            let answer = crate::server::rest_of(server.connect(request.as_bytes())).await;
            assert!(answer.starts_with("HTTP/1.1 400"), "{hosts:?}: {answer}");
            assert!(answer.contains("malformed-request"), "{answer}");
        }
    }
    let old = b"GET /livez HTTP/1.0\r\n\r\n";
    let answer = crate::server::rest_of(server.connect(old)).await;
    assert!(answer.contains(" 200 OK"), "{answer}");
}

#[tokio::test]
async fn dns_rebinding_is_refused_without_keys() {
    for own_machine_only in [true, false] {
        refuses_dns_rebinding(&open(own_machine_only)).await;
    }
}

async fn refuses_dns_rebinding(service: &Service) {
    let rebound = [
        ("host", "evil.example:8080"),
        ("origin", "http://evil.example:8080"),
    ];
    for (method, path) in [("GET", "/calibrations"), CHANGING[0], CHANGING[1]] {
        assert_refused(
            &service.ask(method, path, &rebound).await,
            "evil.example:8080",
        );
    }
    for host in [
        "127.0.0.1:8080",
        "[::1]:8080",
        "localhost",
        "dashboard.example",
        "hall.lookdown.example",
        "lookdown.local",
    ] {
        let answer = service.ask("GET", "/calibrations", &[("host", host)]).await;
        assert_eq!(answer.status, 200, "{host}");
    }
    for path in ["/livez", "/readyz", "/metrics"] {
        assert_eq!(
            service.ask("GET", path, &rebound).await.status,
            200,
            "{path}"
        );
    }
}

#[tokio::test]
async fn every_response_has_the_security_headers() {
    let service = Service::start();
    for path in [
        "/",
        "/docs/",
        "/docs/swagger-ui.css",
        "/livez",
        "/nowhere",
        "/calibrations",
    ] {
        let answer = service.get(path).await;
        assert_eq!(answer.header("x-content-type-options"), "nosniff", "{path}");
        assert_eq!(answer.header("referrer-policy"), "no-referrer", "{path}");
        assert_eq!(answer.header("x-frame-options"), "DENY", "{path}");
        let policy = answer.header("cross-origin-resource-policy");
        assert_eq!(policy, "same-origin", "{path}");
        let policy = answer.header("content-security-policy");
        for part in ["default-src 'none'", "frame-ancestors 'none'"] {
            assert!(policy.contains(part), "{path}: {policy}");
        }
        let is_page = path == "/" || path.starts_with("/docs");
        assert_eq!(policy.contains("script-src 'self'"), is_page, "{path}");
        assert!(!policy.contains("script-src 'self' 'unsafe"), "{path}");
    }
    let page = service.get("/docs/").await.text();
    assert!(
        !page.contains("<script>"),
        "the policy blocks this script: {page}"
    );
}

#[tokio::test]
async fn allowed_pages_may_read_every_response_header() {
    let service = open(true);
    let page = [
        ("host", "localhost"),
        ("origin", "https://dashboard.example"),
    ];
    let answer = service.ask(CHANGING[0].0, CHANGING[0].1, &page).await;
    assert_eq!(answer.status, 200);
    let policy = answer.header("cross-origin-resource-policy");
    assert_eq!(policy, "cross-origin");
    let exposed = answer
        .header("access-control-expose-headers")
        .to_lowercase();
    for name in [
        "etag",
        "inference-header-content-length",
        "location",
        "ratelimit",
        "ratelimit-policy",
        "retry-after",
        "server-timing",
        "www-authenticate",
        "x-request-id",
    ] {
        assert!(
            exposed.split(',').any(|header| header.trim() == name),
            "{name}"
        );
    }
}

#[tokio::test]
async fn the_web_page_is_complete_without_inline_scripts() {
    let service = Service::start();
    let page = service.get("/").await;
    assert_eq!(page.header("content-type"), "text/html; charset=utf-8");
    let policy = page.header("content-security-policy");
    assert!(!policy.contains("unsafe"), "{policy}");
    let text = page.text();
    assert!(!text.contains("http"), "the page loads from other hosts");
    assert!(!text.contains("style=") && !text.contains("<style"));
    let links = text.split('"').filter(|part| part.starts_with("assets/"));
    let links: Vec<_> = links.collect();
    assert!(links.len() > 3, "{links:?}");
    for link in links {
        let asset = service.get(&format!("/{link}")).await;
        assert_eq!(asset.status, 200, "{link}");
        // A script imports only files that exist.
        for import in asset.text().split("from \"./").skip(1) {
            let name = import.split('"').next().unwrap();
            let imported = service.get(&format!("/assets/{name}")).await;
            assert_eq!(
                imported.header("content-type"),
                "text/javascript; charset=utf-8",
                "{name}"
            );
        }
    }
    let missing = service.get("/assets/nothing.js").await;
    assert_eq!(missing.status, 404);
    assert_eq!(missing.problem()["type"], "/problems/not-found");
}

#[tokio::test]
async fn browsers_revalidate_the_web_page() {
    let service = Service::start();
    for path in ["/", "/assets/office.jpg"] {
        let first = service.get(path).await;
        assert_eq!(first.header("cache-control"), "no-cache", "{path}");
        let tag = first.header("etag").to_owned();
        let again = service.ask("GET", path, &[("if-none-match", &*tag)]).await;
        assert_eq!(
            (again.status.as_u16(), again.body.len()),
            (304, 0),
            "{path}"
        );
        assert_eq!(again.header("etag"), tag);
        let other = [("if-none-match", "\"something else\"")];
        assert_eq!(service.ask("GET", path, &other).await.status, 200);
    }
}
