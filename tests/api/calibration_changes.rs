//! Creating, replacing and deleting calibrations over HTTP.

use std::{collections::BTreeSet, fs, sync::Arc};

use axum::{body::Body, http::Request};
use lookdown::{
    api::Access,
    app::Assembly,
    calibration_store::{Calibrations, FolderStore},
};
use serde_json::json;
use tokio::sync::watch;

use crate::{
    detector::Gate,
    service::{Answer, Bounds, Service, assembly, frame},
};

const KALIBR: &str = include_str!("../fixtures/calibrations/kalibr_camchain.yaml");

/// A native calibration for the frames of the service.
fn native(id: &str, focal: f64) -> String {
    json!({
        "id": id, "image": { "width": 200, "height": 200 },
        "lens": { "model": "equidistant", "focal": focal, "cx": 99.5, "cy": 99.5,
            "max_theta": 1.5 }
    })
    .to_string()
}

async fn change(service: &Service, method: &str, header: (&str, &str), body: String) -> Answer {
    let request = Request::builder().method(method).uri("/calibrations/lobby");
    let request = request.header(header.0, header.1).body(Body::from(body));
    service.send(request.unwrap()).await
}

#[tokio::test]
async fn calibrations_change_without_a_restart() {
    let service = Service::start();
    let created = service
        .put("/calibrations/hall", &native("hall", 60.0))
        .await;
    assert_eq!(created.status, 201, "{}", created.text());
    assert_eq!(created.header("location"), "/calibrations/hall");
    let used = async |query: &str| service.post_raw(query, frame()).await;
    let query = "calibration=hall&profile=fast";
    let revision = |answer: &Answer| answer.json()["calibration"]["revision"].to_string();
    assert_eq!(revision(&used(query).await), created.header("etag"));
    assert!(service.folder.path().join("hall.json").is_file());

    let replaced = service
        .put("/calibrations/hall", &native("hall", 62.0))
        .await;
    assert_eq!(replaced.status, 200);
    assert_ne!(replaced.header("etag"), created.header("etag"));
    assert_eq!(revision(&used(query).await), replaced.header("etag"));
    assert_eq!(
        service.get("/calibrations/hall").await.header("etag"),
        replaced.header("etag")
    );

    let delete = || {
        Request::delete("/calibrations/hall")
            .body(Body::empty())
            .unwrap()
    };
    assert_eq!(service.send(delete()).await.status, 204);
    assert_eq!(service.send(delete()).await.status, 404);
    assert_eq!(used(query).await.status, 404);
    assert!(!service.folder.path().join("hall.json").exists());
}

#[tokio::test]
async fn a_change_of_another_revision_is_refused() {
    let service = Service::start();
    let old = service
        .get("/calibrations/lobby")
        .await
        .header("etag")
        .to_owned();
    let body = || native("lobby", 61.0);
    let replaced = change(&service, "PUT", ("if-match", &old), body()).await;
    assert_eq!(replaced.status, 200);
    let new = replaced.header("etag").to_owned();
    for (method, header, status) in [
        ("PUT", ("if-match", &*old), 412),
        ("DELETE", ("if-match", &*old), 412),
        ("PUT", ("if-match", &*format!("W/{new}")), 412),
        ("PUT", ("if-none-match", "*"), 412),
        ("PUT", ("if-match", "no-quotes"), 400),
        ("PUT", ("if-match", "\"one, tag\""), 412),
        ("PUT", ("if-match", &*format!("{old}, {new}")), 200),
        ("DELETE", ("if-match", "*"), 204),
        ("PUT", ("if-match", "*"), 412),
        ("PUT", ("if-none-match", "*"), 201),
    ] {
        let answer = change(&service, method, header, body()).await;
        assert_eq!(answer.status, status, "{method} {header:?}");
        if status == 412 {
            assert_eq!(answer.problem()["type"], "/problems/precondition-failed");
        }
    }
}

#[tokio::test]
async fn a_revision_that_was_edited_in_the_folder_counts_at_once() {
    let service = Service::start();
    let old = service
        .get("/calibrations/lobby")
        .await
        .header("etag")
        .to_owned();
    let file = service.folder.path().join("lobby.json");
    fs::write(&file, native("lobby", 59.5)).unwrap();
    let answer = change(&service, "PUT", ("if-match", &old), native("lobby", 61.0)).await;
    assert_eq!(answer.status, 412);
    assert_eq!(fs::read_to_string(&file).unwrap(), native("lobby", 59.5));
}

/// py-OCamCalib's format has no frame size.
const WITHOUT_SIZE: &str = include_str!("../fixtures/calibrations/py_ocamcalib.json");

#[tokio::test]
async fn the_query_states_a_missing_frame_size() {
    let service = Service::start();
    let put = async |query: &str, content: &str| {
        let path = format!("/calibrations/hall{query}");
        service.put(&path, content).await
    };
    let refused = put("", WITHOUT_SIZE).await;
    assert_eq!(refused.status, 422);
    let detail = refused.problem()["detail"].as_str().unwrap().to_owned();
    assert!(detail.contains("size"), "{detail}");
    let wrong = put("?size=1600", WITHOUT_SIZE).await;
    assert_eq!(wrong.status, 422);

    let created = put("?size=1600x1600", WITHOUT_SIZE).await;
    assert_eq!(created.status, 201, "{}", created.text());
    let stored = service.get("/calibrations/hall").await.json();
    assert_eq!(stored["image"], json!({"width": 1600, "height": 1600}));

    let other = put("?size=640x480", &native("hall", 60.0)).await;
    assert_eq!(other.status, 422);
    let detail = other.problem()["detail"].as_str().unwrap().to_owned();
    assert!(detail.contains("leave the size out"), "{detail}");
}

#[tokio::test]
async fn files_of_other_programs_are_accepted_and_a_camera_selected() {
    let service = Service::start();
    let several = service.put("/calibrations/hall", KALIBR).await;
    assert_eq!(several.status, 422);
    let problem = several.problem();
    assert_eq!(problem["type"], "/problems/invalid-calibration");
    let detail = problem["detail"].as_str().unwrap();
    assert!(
        detail.contains("?camera=") && detail.contains("cam0, cam1"),
        "{detail}"
    );
    let unknown = service.put("/calibrations/hall?camera=cam9", KALIBR).await;
    assert_eq!(unknown.status, 422);
    assert_eq!(service.get("/calibrations/hall").await.status, 404);

    let put = service.put("/calibrations/hall?camera=cam1", KALIBR).await;
    assert_eq!(put.status, 201, "{}", put.text());
    let native = service.get("/calibrations/hall").await;
    assert_eq!(
        (&native.json()["id"], native.header("etag")),
        (&json!("hall"), put.header("etag"))
    );
    // The response to GET is accepted by PUT without a change.
    let again = service.put("/calibrations/hall", &native.text()).await;
    assert_eq!(
        (again.status.as_u16(), again.header("etag")),
        (200, put.header("etag"))
    );
    let yaml = "id: yard\nimage: {width: 200, height: 200}\n\
                lens: {model: equidistant, focal: 60, cx: 99.5, cy: 99.5}\n";
    let toml = "id = 'court'\n[image]\nwidth = 200\nheight = 200\n[lens]\n\
                model = 'equidistant'\nfocal = 60.0\ncx = 99.5\ncy = 99.5\n";
    assert_eq!(service.put("/calibrations/yard", yaml).await.status, 201);
    assert_eq!(service.put("/calibrations/court", toml).await.status, 201);
}

#[tokio::test]
async fn an_invalid_calibration_is_refused_and_changes_nothing() {
    let service = Service::start();
    let before = service.get("/calibrations/lobby").await.body;
    for (id, content, part) in [
        ("lobby", "{".to_owned(), "not a calibration file"),
        ("lobby", native("lobby", -1.0), "focal"),
        ("lobby", native("hall", 60.0), "make them equal"),
        ("Lobby", native("lobby", 60.0), "is not a calibration ID"),
    ] {
        let answer = service.put(&format!("/calibrations/{id}"), &content).await;
        assert_eq!(answer.status, 422, "{content}");
        let problem = answer.problem();
        assert_eq!(problem["type"], "/problems/invalid-calibration");
        assert!(
            problem["detail"].as_str().unwrap().contains(part),
            "{problem}"
        );
    }
    let large = service
        .put("/calibrations/lobby", &" ".repeat((1 << 20) + 1))
        .await;
    assert_eq!(large.status, 413);
    assert_eq!(service.get("/calibrations/lobby").await.body, before);
    let files = fs::read_dir(service.folder.path()).unwrap().count();
    assert_eq!(files, 1, "files were left behind");
}

#[tokio::test]
async fn put_replaces_a_file_in_another_format() {
    let service = Service::start();
    let colmap = "1 OPENCV_FISHEYE 200 200 60 60 100 100 0 0 0 0\n";
    let path = service.folder.path().join("yard.txt");
    fs::write(&path, colmap).unwrap();
    let put = service
        .put("/calibrations/yard", &native("yard", 60.0))
        .await;
    assert_eq!(put.status, 200);
    assert!(!path.exists() && service.folder.path().join("yard.json").exists());
}

#[tokio::test]
async fn a_camera_of_a_shared_file_can_be_replaced_but_not_deleted() {
    let service = Service::start();
    fs::write(service.folder.path().join("rig.yaml"), KALIBR).unwrap();
    let delete = async |id: &str| {
        let request = Request::delete(format!("/calibrations/{id}"));
        service.send(request.body(Body::empty()).unwrap()).await
    };
    let refused = delete("rig-cam0").await;
    assert_eq!(refused.status, 409);
    let detail = refused.problem()["detail"].as_str().unwrap().to_owned();
    assert!(
        detail.contains("rig.yaml") && detail.contains("rig-cam1"),
        "{detail}"
    );
    assert_eq!(
        service
            .put("/calibrations/rig", &native("rig", 60.0))
            .await
            .status,
        409
    );

    let shared = service.get("/calibrations/rig-cam0").await.body;
    let own = service
        .put("/calibrations/rig-cam0", &native("rig-cam0", 60.0))
        .await;
    assert_eq!(own.status, 200);
    assert_ne!(service.get("/calibrations/rig-cam0").await.body, shared);
    assert_eq!(delete("rig-cam0").await.status, 204);
    assert_eq!(service.get("/calibrations/rig-cam0").await.body, shared);
}

#[tokio::test]
async fn remote_and_disabled_changes_are_refused() {
    let afar = Service::within(&Bounds {
        access: Access::Open {
            own_machine_only: false,
        },
        ..Bounds::default()
    });
    let gate = Arc::new(Gate::default());
    let (parts, folder) = assembly(&gate);
    let store = Box::new(FolderStore::new(folder.path()));
    let calibrations = Arc::new(Calibrations::open(store, false, Arc::default()).unwrap());
    let parts = Assembly {
        calibrations,
        ..parts
    };
    let switched_off = Service::around(parts, folder, gate, &Bounds::default());
    for (service, part) in [
        (afar, "access.keys_file"),
        (switched_off, "calibrations.writable"),
    ] {
        for method in ["PUT", "DELETE"] {
            let answer = change(&service, method, ("accept", "*/*"), native("lobby", 60.0)).await;
            assert_eq!(answer.status, 403);
            let problem = answer.problem();
            assert!(
                problem["detail"].as_str().unwrap().contains(part),
                "{problem}"
            );
        }
        assert_eq!(service.get("/calibrations/lobby").await.status, 200);
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn replacing_a_calibration_under_load_fails_no_request() {
    const CHANGES: u32 = 20;
    let service = Arc::new(Service::start());
    let first = service.get("/calibrations/lobby").await;
    let (answered, mut answers) = watch::channel(0_u32);
    let frames = {
        let service = Arc::clone(&service);
        tokio::spawn(async move {
            let mut revisions = BTreeSet::new();
            // Until no client waits for responses any more.
            while !answered.is_closed() {
                let query = "calibration=lobby&profile=fast";
                let answer = service.post_raw(query, frame()).await;
                assert_eq!(answer.status, 200, "{}", answer.text());
                revisions.insert(answer.json()["calibration"]["revision"].to_string());
                answered.send_modify(|count| *count += 1);
            }
            revisions
        })
    };
    let mut known = BTreeSet::from([first.header("etag").to_owned()]);
    for change in 0..CHANGES {
        let content = native("lobby", 55.0 + f64::from(change) / 4.0);
        let put = service.put("/calibrations/lobby", &content).await;
        assert_eq!(put.status, 200, "{}", put.text());
        known.insert(put.header("etag").to_owned());
        // The second response from here on is that of a frame that was sent after the change.
        let seen = *answers.borrow();
        answers.wait_for(|count| *count >= seen + 2).await.unwrap();
    }
    drop(answers);
    let reported = frames.await.unwrap();
    assert!(
        reported.len() >= CHANGES as usize,
        "changes were not seen: {reported:?}"
    );
    assert!(
        reported.is_subset(&known),
        "{reported:?} are not all in {known:?}"
    );
}
