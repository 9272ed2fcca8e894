//! The cameras of `lookdown run`.

use std::{
    fs::{self, OpenOptions},
    path::PathBuf,
    process::Command,
    sync::Arc,
    time::Duration,
};

use axum::{
    Router,
    http::{StatusCode, Uri},
};
use lookdown::{api::Companions, cameras::Cameras};
use lookdown_watch::Metrics;
use tokio::{
    sync::{Mutex, mpsc},
    task::JoinSet,
    time::{sleep, timeout},
};

use crate::service::{Bounds, Service, frame};

const CAMERA: &str = r#"{ "url": "rtsp://127.0.0.1:9/" }"#;
const TIMEOUT: Duration = Duration::from_mins(1);
/// Most requests that wait for the folder.
const MAX_WAITING: usize = 32;
/// The tests of a process share the places of requests that wait.
static PLACES: Mutex<()> = Mutex::const_new(());

/// A pipe in the place of a file that the server writes. Writers wait until this is dropped.
struct HangingFile(PathBuf);

impl HangingFile {
    fn plant(path: PathBuf) -> Self {
        let made = Command::new("mkfifo").arg(&path).status().unwrap();
        assert!(made.success());
        Self(path)
    }
}

impl Drop for HangingFile {
    fn drop(&mut self) {
        let both_ends = OpenOptions::new().read(true).write(true).open(&self.0);
        // Later writers create a file. The test is over if one of these fails.
        let _ = fs::remove_file(&self.0);
        drop(both_ends);
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_folder_of_cameras_that_hangs_keeps_few_threads() {
    let _places = PLACES.lock().await;
    let folder = tempfile::tempdir().unwrap();
    let hanging = HangingFile::plant(folder.path().join("cameras.part"));
    let companions = Companions::default();
    let metrics = Arc::new(Metrics::new().unwrap());
    companions.set_cameras(Arc::new(Cameras::new(
        folder.path().into(),
        companions.own_cameras(),
        metrics,
    )));
    let service = Arc::new(Service::within(&Bounds {
        request_timeout: Duration::from_secs(3),
        companions,
        ..Bounds::default()
    }));
    let mut requests = JoinSet::new();
    for number in 0..MAX_WAITING + 8 {
        let service = Arc::clone(&service);
        requests.spawn(async move {
            let path = format!("/cameras/hall{number}");
            service.put(&path, CAMERA).await.status
        });
    }
    let statuses = timeout(TIMEOUT, requests.join_all()).await.unwrap();
    let with = |status| statuses.iter().filter(|other| **other == status).count();
    let timeouts = with(StatusCode::GATEWAY_TIMEOUT);
    let refusals = with(StatusCode::TOO_MANY_REQUESTS);
    assert_eq!((timeouts, refusals), (MAX_WAITING, 8), "{statuses:?}");
    for path in ["/cameras", "/cameras/hall0", "/cameras/hall0/frame.jpg"] {
        let refused = service.get(path).await;
        assert_eq!(refused.problem()["type"], "/problems/overloaded", "{path}");
    }
    // Other files do not wait for these.
    let deleted = service.ask("DELETE", "/calibrations/lobby", &[]).await;
    assert_eq!(deleted.status, StatusCode::NO_CONTENT);
    drop(hanging);
    let again = async {
        while service.get("/cameras").await.status != StatusCode::OK {
            sleep(Duration::from_millis(20)).await;
        }
        service.put("/cameras/gate", CAMERA).await.status
    };
    let stored = timeout(TIMEOUT, again).await.unwrap();
    assert_eq!(stored, StatusCode::CREATED);
}

/// A server with the cameras of a folder.
fn service(folder: &std::path::Path, companions: &Companions) -> Service {
    let metrics = Arc::new(Metrics::new().unwrap());
    companions.set_cameras(Arc::new(Cameras::new(
        folder.into(),
        companions.own_cameras(),
        metrics,
    )));
    Service::within(&Bounds {
        companions: companions.clone(),
        ..Bounds::default()
    })
}

#[tokio::test]
async fn a_camera_that_is_not_counted_has_a_warning() {
    let _places = PLACES.lock().await;
    let folder = tempfile::tempdir().unwrap();
    let companions = Companions::default();
    let service = service(folder.path(), &companions);
    companions.set_counts(Router::new(), |camera| {
        (camera == "hall").then(|| "its reports are not counted".to_owned())
    });
    for (camera, warning) in [
        ("hall", "its reports are not counted".into()),
        ("gate", serde_json::Value::Null),
    ] {
        service.put(&format!("/cameras/{camera}"), CAMERA).await;
        let row = service.get(&format!("/cameras/{camera}")).await;
        assert_eq!(row.json()["warning"], warning);
    }
}

#[tokio::test]
async fn the_field_at_fault_of_a_camera_is_named() {
    let _places = PLACES.lock().await;
    let folder = tempfile::tempdir().unwrap();
    let companions = Companions::default();
    let service = service(folder.path(), &companions);
    for (body, detail) in [
        (
            r#"{ "parameters": {} }"#,
            "parameters: there is no such field: use paused, keep_image",
        ),
        (
            r#"{ "paused": "secret" }"#,
            "paused: it has a value of another type",
        ),
        (
            r#"{ "paused": 1, "keep_image": 2 }"#,
            "body: line 1: not the JSON of this route",
        ),
        ("[", "body: line 1: not the JSON of this route"),
    ] {
        let refused = service.patch("/cameras/hall", body).await;
        let said = refused.problem()["detail"].to_string();
        assert!(said.contains(detail) && !said.contains("secret"), "{said}");
    }
}

#[tokio::test]
async fn an_image_is_kept_after_it_is_switched_on() {
    let _places = PLACES.lock().await;
    let folder = tempfile::tempdir().unwrap();
    let companions = Companions::default();
    let service = service(folder.path(), &companions);
    service.put("/cameras/hall", CAMERA).await;
    for (change, status) in [("true", StatusCode::OK), ("false", StatusCode::NOT_FOUND)] {
        let body = format!(r#"{{ "keep_image": {change} }}"#);
        let changed = service.patch("/cameras/hall", &body).await;
        assert_eq!(changed.status, StatusCode::NO_CONTENT, "{}", changed.text());
        let image = service.get("/results/hall/latest.jpg").await;
        assert_eq!(image.status, StatusCode::NOT_FOUND, "{change}");
        service.post_raw("camera=hall", frame()).await;
        let image = service.get("/results/hall/latest.jpg").await;
        assert_eq!(image.status, status, "{change}");
        let row = service.get("/cameras/hall").await.json();
        assert_eq!(row["keep_image"].to_string(), change);
    }
}

#[tokio::test]
async fn the_counts_follow_an_own_camera_without_reports() {
    let companions = Companions::default();
    companions
        .own_cameras()
        .set([("hall".to_owned(), true)].into());
    let (sender, mut asked) = mpsc::channel(9);
    let counts = Router::new().fallback(move |uri: Uri| {
        drop(sender.try_send(uri.to_string()));
        async {}
    });
    companions.set_counts(counts, |_| None);
    let service = Service::within(&Bounds {
        companions,
        ..Bounds::default()
    });
    for camera in ["hall", "gate"] {
        let deleted = service
            .ask("DELETE", &format!("/results/{camera}"), &[])
            .await;
        assert_eq!(deleted.status, StatusCode::NO_CONTENT, "{camera}");
    }
    let asked: Vec<_> = std::iter::from_fn(|| asked.try_recv().ok()).collect();
    assert_eq!(asked, ["/counts/gate?keep_history=true"]);
}

#[tokio::test]
async fn frames_of_others_do_not_replace_an_own_camera() {
    let companions = Companions::default();
    companions
        .own_cameras()
        .set([("hall".to_owned(), false)].into());
    let service = Service::within(&Bounds {
        companions,
        ..Bounds::default()
    });
    let status = async |query: &str| {
        let answer = service.post_raw(query, frame()).await;
        answer.status.as_u16()
    };
    assert_eq!(status("camera=hall").await, 403);
    assert_eq!(status("camera=hall&store=false").await, 200);
    assert_eq!(status("camera=gate").await, 200);
}
