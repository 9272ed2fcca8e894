//! Problem documents, and the pages that document them.

use axum::{body::Body, http::Request};

use crate::service::{Answer, Service, frame};

async fn page(service: &Service, path: &str, accept: &str) -> Answer {
    let request = Request::get(path).header("accept", accept);
    service.send(request.body(Body::empty()).unwrap()).await
}

#[tokio::test]
async fn the_type_of_a_problem_is_the_path_of_its_page() {
    let service = Service::start();
    let answer = service.post_raw("sigma=0", frame()).await;
    let problem = answer.problem();
    assert_eq!(problem["type"], "/problems/invalid-parameter");
    let page = service.get("/problems/invalid-parameter").await;
    assert_eq!(page.status, 200);
    assert_eq!(page.header("content-type"), "text/markdown; charset=utf-8");
    assert!(page.header("cache-control").contains("max-age"));
    let title = problem["title"].as_str().unwrap();
    assert!(page.text().starts_with(&format!("# {title}\n")));
    assert!(page.text().contains("**Remedy:**"), "{}", page.text());
}

#[tokio::test]
async fn browsers_get_pages_in_html() {
    let service = Service::start();
    for path in ["/problems", "/problems/overloaded"] {
        let browser = "text/html,application/xhtml+xml,*/*;q=0.8";
        let page = page(&service, path, browser).await;
        assert_eq!(page.status, 200, "{path}");
        assert_eq!(page.header("content-type"), "text/html; charset=utf-8");
        assert!(page.text().contains("<code>overloaded</code>"), "{path}");
    }
}

#[tokio::test]
async fn the_list_has_every_problem_and_unknown_names_are_404() {
    let service = Service::start();
    let list = service.get("/problems").await.text();
    let paths = list
        .split('`')
        .filter(|text| text.starts_with("/problems/"));
    let paths: Vec<_> = paths.collect();
    assert!(paths.len() > 30, "{list}");
    for path in paths {
        assert_eq!(service.get(path).await.status, 200, "{path}");
    }
    let unknown = service.get("/problems/nothing").await;
    assert_eq!(unknown.status, 404);
    assert_eq!(unknown.problem()["type"], "/problems/not-found");
}

#[tokio::test]
async fn the_parameter_at_fault_is_a_field_of_the_problem() {
    let service = Service::start();
    for (query, parameter) in [
        ("sigma=0", "sigma"),
        ("colour=red", "colour"),
        ("calibration=missing", "calibration"),
        ("format=pdf", "format"),
    ] {
        let problem = service.post_raw(query, frame()).await.problem();
        assert_eq!(problem["parameter"], parameter, "{problem}");
    }
    for field in ["img", "image"] {
        let problem = service.post_form(&[(field, b"GIF89a")]).await.problem();
        assert_eq!(problem["parameter"], field, "{problem}");
    }
    let problem = service.get("/nothing").await.problem();
    assert_eq!(problem.get("parameter"), None, "{problem}");

    let field = r#"{"id": "hall", "image": {"width": 200, "height": 200}, "lens": {"model": "equidistant",
        "focal": 60, "cx": 99.5, "cy": 99.5}, "mount": {"world_up": [0, 0, -2]}}"#;
    let without_size = include_str!("../fixtures/calibrations/py_ocamcalib.json");
    let two_cameras = include_str!("../fixtures/calibrations/kalibr_camchain.yaml");
    for (content, parameter) in [
        (field, "mount"),
        (without_size, "size"),
        (two_cameras, "camera"),
    ] {
        let answer = service.put("/calibrations/hall", content).await;
        assert_eq!(answer.problem()["parameter"], parameter);
    }
}
