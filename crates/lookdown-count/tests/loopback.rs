//! The companion against a server on this machine: counts, unknown time, tracks, sites, webhooks.
#![expect(clippy::unwrap_used, reason = "a panic fails the test")]

mod events;

use std::{
    net::TcpListener,
    path::Path,
    sync::{Arc, Mutex, atomic::Ordering},
    time::Duration,
};

use events::{CALIBRATION, START_MS, Server, event, person, walks};
use lookdown_calibration::Calibration;
use lookdown_common::{HttpClient, ServerClient, ServerEntry};
use lookdown_count::{
    CountEntry, PersonsByCamera, Recording, Snapshot, WebhookEntry, count, read_persons,
};
use reqwest::RequestBuilder;
use serde_json::{Value, json};
use tokio::{
    io::{AsyncReadExt, AsyncWriteExt},
    sync::watch,
    time::{Instant, sleep},
};

/// Longest wait for a condition.
const PATIENCE: Duration = Duration::from_secs(20);

/// The key of a webhook.
const SECRET: &str = "whsec_MfKQ9r8GKYqrTwjUPD8ILPZIo2LaLaSw\n";

/// A running companion.
struct Companion {
    url: String,
    client: HttpClient,
}

impl Companion {
    fn request(&self, path: &str) -> RequestBuilder {
        let url = format!("{}{path}", self.url);
        self.client.get(url.parse().unwrap())
    }

    async fn get(&self, path: &str) -> (u16, String) {
        let response = self.client.send(self.request(path)).await.unwrap();
        (response.status().as_u16(), response.text().await.unwrap())
    }

    async fn json(&self, path: &str) -> Value {
        let (status, body) = self.get(path).await;
        assert_eq!(status, 200, "{path}: {body}");
        serde_json::from_str(&body).unwrap()
    }

    /// Waits until `found` returns a value.
    async fn until<T>(&self, what: &str, mut found: impl AsyncFnMut(&Self) -> Option<T>) -> T {
        let started = Instant::now();
        loop {
            if let Some(value) = found(self).await {
                return value;
            }
            assert!(started.elapsed() < PATIENCE, "{what}");
            sleep(Duration::from_millis(50)).await;
        }
    }

    async fn until_counted(&self, reports: usize) {
        let wanted = format!("lookdown_count_reports_total {reports}\n");
        self.until("all reports are counted", async |companion: &Self| {
            let (_, metrics) = companion.get("/metrics").await;
            metrics.contains(&wanted).then_some(())
        })
        .await;
    }
}

/// Settings with short intervals.
fn quick() -> CountEntry {
    CountEntry {
        commit_every: Duration::from_millis(100),
        retention: Duration::from_hours(24 * 3660),
        ..CountEntry::default()
    }
}

/// Settings with a webhook for the camera `hall`.
fn webhook(url: &str, secret: &Path, on: &str) -> CountEntry {
    let written = json!({"url": url, "secret_file": secret, "on": on, "camera": "hall"});
    CountEntry {
        webhooks: vec![serde_json::from_value::<WebhookEntry>(written).unwrap()],
        ..quick()
    }
}

/// Runs a test with a companion of these settings.
async fn with_companion<T>(
    server: &Server,
    settings: CountEntry,
    folder: &Path,
    test: impl AsyncFnOnce(Companion) -> T,
) -> T {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap();
    drop(listener);
    let entry = CountEntry {
        server: ServerEntry {
            url: Some(format!("http://{}", server.address)),
            ..ServerEntry::default()
        },
        listen: Some(address),
        store: folder.join("counts.sqlite"),
        ..settings
    };
    let options = entry.check().unwrap();
    let (snapshots, _receiver) = watch::channel(Snapshot::default());
    let companion = Companion {
        url: format!("http://{address}"),
        client: HttpClient::new(None).unwrap(),
    };
    let mut outcome = None;
    let stop = async {
        companion
            .until("the companion answers", async |companion: &Companion| {
                companion
                    .client
                    .send(companion.request("/livez"))
                    .await
                    .ok()
            })
            .await;
        outcome = Some(test(companion).await);
    };
    count(&options, snapshots, |_| {}, stop).await.unwrap();
    outcome.unwrap()
}

/// Returns the query of the minutes from the first report on.
fn minutes(count: i64, step: &str) -> String {
    let time = |minute: i64| jiff::Timestamp::from_millisecond(START_MS + minute * 60_000).unwrap();
    format!("from={}&to={}&step={step}", time(0), time(count))
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn steps_add_up_and_a_gap_is_unknown() {
    let folder = tempfile::tempdir().unwrap();
    // People cross in each minute. No frame arrives in the third minute.
    let walks = walks("hall", 300, 120..180);
    let reports = walks.len();
    let server = Server::start(walks, Duration::ZERO, CALIBRATION).await;
    with_companion(&server, quick(), folder.path(), async |companion| {
        companion.until_counted(reports).await;
        sleep(Duration::from_millis(400)).await;
        let counts = companion
            .json(&format!("/counts/hall?{}", minutes(5, "1m")))
            .await;
        let steps = counts["steps"].as_array().unwrap();
        assert_eq!(steps.len(), 5);
        assert_eq!(counts["step_seconds"], 60);
        let door = |step: &Value, direction: &str| step["lines"]["door"][direction].as_u64();
        let sum = |direction: &str| {
            steps
                .iter()
                .filter_map(|step| door(step, direction))
                .sum::<u64>()
        };
        // One walker every 6 s; those of the minute without frames are not counted.
        assert_eq!((sum("in"), sum("out")), (20, 20), "{counts:#}");
        let whole = companion
            .json(&format!("/counts/hall?{}", minutes(5, "5m")))
            .await;
        let whole = &whole["steps"][0];
        assert_eq!(
            (door(whole, "in"), door(whole, "out")),
            (Some(20), Some(20))
        );
        assert_eq!(whole["zones"]["middle"]["entries"], 40);

        let unknown = &steps[2];
        assert_eq!(unknown["known_seconds"], 0.0);
        for field in ["persons", "lines/door/in", "zones/middle"] {
            let value = unknown.pointer(&format!("/{field}")).unwrap();
            assert!(value.is_null(), "{field} is {value}");
        }
        assert_eq!(steps[0]["known_seconds"], 60.0);
        assert_eq!(steps[0]["slow_seconds"], 0.0);
        let mean = steps[1]["persons"]["mean"].as_f64().unwrap();
        assert!((0.8..1.4).contains(&mean), "{mean}");

        let (_, csv) = companion
            .get(&format!("/counts/hall?{}&format=csv", minutes(5, "1m")))
            .await;
        let mut lines = csv.lines();
        assert_eq!(
            lines.next().unwrap(),
            "from,to,known_seconds,slow_seconds,persons_mean,persons_mean_low,\
             persons_mean_high,persons_max,line.door.in,line.door.in.estimated,line.door.in.low,line.door.in.high,\
             line.door.out,line.door.out.estimated,line.door.out.low,line.door.out.high,\
             zone.middle.entries,zone.middle.mean,zone.middle.max,zone.middle.visits,\
             zone.middle.dwell_seconds"
        );
        let third = lines.nth(2).unwrap();
        assert!(third.ends_with(&format!(",0{}", ",".repeat(17))), "{third}");
        assert_eq!(lines.count(), 2);

        let map = companion
            .json(&format!("/counts/hall/heatmap.json?{}", minutes(5, "5m")))
            .await;
        let rows = map["seconds"].as_array().unwrap();
        let cells = rows.iter().flat_map(|row| row.as_array().unwrap());
        let seconds: f64 = cells.map(|cell| cell.as_f64().unwrap()).sum();
        assert!((150.0..260.0).contains(&seconds), "{seconds}");
        let (status, png) = companion.get("/counts/hall/heatmap.png").await;
        assert!(status == 200 && png.contains("PNG"));
        let (status, png) = companion.get("/counts/hall/heatmap-frame.png").await;
        assert!(status == 200 && png.contains("PNG"));
        // Everyone walks along the same line: it is not an area.
        let path = format!("/counts/hall/suggested-area?{}", minutes(5, "5m"));
        let (status, problem) = companion.get(&path).await;
        assert!(
            status == 404 && problem.contains("2 m² of floor"),
            "{problem}"
        );
    })
    .await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn crossings_that_a_person_counted_give_a_ratio_with_a_bar() {
    let folder = tempfile::tempdir().unwrap();
    let walks = walks("hall", 3600, 0..0);
    let reports = walks.len();
    let server = Server::start(walks, Duration::ZERO, CALIBRATION).await;
    with_companion(&server, quick(), folder.path(), async |companion| {
        companion.until_counted(reports).await;
        sleep(Duration::from_millis(400)).await;
        let begin = jiff::Timestamp::from_millisecond(START_MS).unwrap();
        let hour = format!("/counts/hall/reference-crossings/{begin}");
        let change = async |method: &str, path: &str| {
            let url = format!("{}{path}", companion.url).parse().unwrap();
            let method = method.parse().unwrap();
            let request = companion.client.request(method, url);
            let response = companion.client.send(request).await.unwrap();
            (response.status().as_u16(), response.text().await.unwrap())
        };
        let put = async |path: &str, line: &str, crossings: u64| {
            let given = format!("?line={line}&direction=in&crossings={crossings}");
            change("PUT", &format!("{path}{given}")).await
        };
        let bar = async || {
            let counts = format!("/counts/hall?{}", minutes(60, "1h"));
            let step = companion.json(&counts).await["steps"][0].clone();
            ["lines", "lines_estimated", "lines_low", "lines_high"]
                .map(|of| step[of]["door"]["in"].as_u64().unwrap())
        };
        let [counted, untaught, low, high] = bar().await;
        assert!(counted > 200 && untaught == counted);
        // A person counted half as many again.
        let given = counted * 3 / 2;
        assert_eq!(put(&hour, "door", given).await, (204, String::new()));
        let [again, estimated, taught_low, taught_high] = bar().await;
        assert!(again == counted && estimated.abs_diff(given) < 10);
        assert!(taught_low < given && given < taught_high);
        assert!(taught_high - taught_low < high - low);
        let listed = companion.json("/counts/hall/reference-crossings").await;
        let row = json!({"from": begin.to_string(), "line": "door", "direction": "in",
            "crossings": given, "counted": counted});
        assert_eq!(listed["crossings"], json!([row]));
        assert!((1.4..1.5).contains(&listed["ratios"]["door"].as_f64().unwrap()));

        let later = "/counts/hall/reference-crossings/2020-01-01T00:00:00Z";
        for ((status, problem), reason) in [
            (put(&hour, "gate", 1).await, "line: hall has no line gate"),
            (put(&hour, "door", 10_001).await, "crossings: 10001 is more"),
            (put(later, "door", 1).await, "was not counted for nine"),
            (
                put(&hour.replace(":00Z", ":01Z"), "door", 1).await,
                "whole minute",
            ),
        ] {
            assert!(status == 422 && problem.contains(reason), "{problem}");
        }
        assert_eq!(change("DELETE", &hour).await.0, 204);
        assert_eq!(change("DELETE", &hour).await.0, 404);
        assert_eq!(bar().await, [counted, untaught, low, high]);
    })
    .await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_restart_resumes_after_the_last_report() {
    let folder = tempfile::tempdir().unwrap();
    let walks = walks("hall", 30, 0..0);
    let (reports, last) = (walks.len(), walks.last().unwrap().0);
    let server = Server::start(walks, Duration::ZERO, CALIBRATION).await;
    with_companion(&server, quick(), folder.path(), async |companion| {
        companion.until_counted(reports).await;
    })
    .await;
    with_companion(&server, quick(), folder.path(), async |companion| {
        companion
            .until("it resumes", async |_: &Companion| {
                let resumed = server.resumed.lock().unwrap().clone();
                (resumed.last() == Some(&Some(last))).then_some(())
            })
            .await;
        let counts = companion
            .json(&format!("/counts/hall?{}", minutes(1, "1m")))
            .await;
        assert_eq!(counts["steps"][0]["lines"]["door"]["in"], 3, "{counts:#}");
    })
    .await;
    assert_eq!(server.sent.load(Ordering::SeqCst), last);
}

/// Returns events of the last seconds with these persons per camera.
fn current(cameras: &[(&str, Vec<String>)]) -> Vec<(u64, String)> {
    let now_ms = jiff::Timestamp::now().as_millisecond() - START_MS;
    let frames = (0..10).flat_map(|frame| {
        let cameras = cameras.iter().enumerate();
        cameras.map(move |(index, (camera, persons))| {
            let offset = i64::try_from(index).unwrap() * 10;
            event(camera, now_ms - 3000 + frame * 200 + offset, persons)
        })
    });
    frames.collect()
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn tracks_are_current_and_anonymous() {
    let folder = tempfile::tempdir().unwrap();
    let server = Server::start(
        current(&[("hall", vec![person(0.5, 0.5), person(-2.0, 0.0)])]),
        Duration::ZERO,
        CALIBRATION,
    )
    .await;
    with_companion(&server, quick(), folder.path(), async |companion| {
        let tracks = companion
            .until(
                "two tracks, one in the zone",
                async |companion: &Companion| {
                    let (status, body) = companion.get("/counts/hall/tracks").await;
                    let tracks: Value = serde_json::from_str(&body).unwrap();
                    let is_complete = tracks["tracks"]
                        .as_array()
                        .is_some_and(|list| list.len() == 2);
                    // Entering takes a second.
                    let is_in_zone = tracks["zones"][0]["persons"] == 1;
                    (status == 200 && is_complete && is_in_zone).then_some(tracks)
                },
            )
            .await;
        assert_eq!(tracks["is_current"], true);
        let door = &tracks["lines"][0];
        assert_eq!(door["crossings"]["in"], 0);
        assert_eq!(door["outline_px"].as_array().unwrap().len(), 17);
        let track = tracks["tracks"][0].as_object().unwrap();
        let keys: Vec<_> = track.keys().map(String::as_str).collect();
        let expected = [
            "first_seen",
            "floor_m",
            "frame_px",
            "id",
            "last_seen",
            "posture",
            "posture_probability",
            "tail",
            "tail_px",
            "velocity_m_s",
        ];
        assert_eq!(keys, expected);
        let tail = track["tail_px"].as_array().unwrap();
        assert_eq!(tail.len(), track["tail"].as_array().unwrap().len());
        assert_eq!(tail.last(), Some(&track["frame_px"]));
        let coordinates = |value: &Value| [0, 1].map(|axis| value[axis].as_f64().unwrap());
        let [x_m, y_m] = coordinates(&track["floor_m"]);
        let [x, y] = coordinates(&track["frame_px"]);
        // The camera is 2.8 m above the floor.
        let distance_m = x_m.hypot(y_m);
        let scale = 318.3 * distance_m.atan2(2.8) / distance_m;
        assert!((x - 500.0 - scale * x_m).abs() < 1.0, "{x}");
        assert!((y - 500.0 - scale * y_m).abs() < 1.0, "{y}");
        let zone = tracks["zones"][0]["outline_px"].as_array().unwrap();
        assert_eq!(zone.first(), zone.last());
        let (_, metrics) = companion.get("/metrics").await;
        assert!(
            metrics.contains("lookdown_count_persons{camera=\"hall\"} 2"),
            "{metrics}"
        );
        let entry = ServerEntry {
            url: Some(companion.url.clone()),
            ..ServerEntry::default()
        };
        let counts = ServerClient::new(&entry.check().unwrap()).unwrap();
        let (sender, mut numbers) = watch::channel(PersonsByCamera::new());
        let read = async {
            numbers.changed().await.unwrap();
            assert_eq!(numbers.borrow().get("hall"), Some(&2));
            drop(numbers);
        };
        tokio::join!(read_persons(counts, sender), read);
    })
    .await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_person_in_two_views_of_a_site_counts_once() {
    let folder = tempfile::tempdir().unwrap();
    let calibration = CALIBRATION.replace(
        "\"height_m\": 2.8",
        "\"height_m\": 2.8, \"site\": \"ground\", \"position_m\": [10, 5]",
    );
    // Both cameras have the same calibration, so they share their place.
    let one = vec![person(1.0, 0.5)];
    let server = Server::start(
        current(&[("east", one.clone()), ("west", one)]),
        Duration::ZERO,
        &calibration,
    )
    .await;
    with_companion(&server, quick(), folder.path(), async |companion| {
        let tracks = companion
            .until(
                "the person is on the floor",
                async |companion: &Companion| {
                    let (_, body) = companion.get("/sites/ground/tracks").await;
                    let tracks: Value = serde_json::from_str(&body).ok()?;
                    let tracks = tracks["tracks"].as_array()?.clone();
                    (!tracks.is_empty()).then_some(tracks)
                },
            )
            .await;
        assert_eq!(tracks.len(), 1, "{tracks:?}");
        let (_, metrics) = companion.get("/metrics").await;
        assert!(
            metrics.contains("lookdown_count_site_persons{site=\"ground\"} 1"),
            "{metrics}"
        );
        let counts = companion.json("/sites/ground").await;
        assert_eq!(counts["site"], "ground");
    })
    .await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_key_of_the_settings_is_required() {
    let folder = tempfile::tempdir().unwrap();
    let key = folder.path().join("key");
    std::fs::write(&key, "0123456789abcdef\n").unwrap();
    let server = Server::start(walks("hall", 2, 0..0), Duration::ZERO, CALIBRATION).await;
    let settings = CountEntry {
        api_key_file: Some(key),
        ..quick()
    };
    with_companion(&server, settings, folder.path(), async |companion| {
        assert_eq!(companion.get("/livez").await.0, 200);
        assert_eq!(companion.get("/counts").await.0, 401);
        for (key, status) in [("0123456789abcdef", 200), ("0123456789abcdeg", 401)] {
            let request = companion.request("/counts").bearer_auth(key);
            let response = companion.client.send(request).await.unwrap();
            assert_eq!(response.status().as_u16(), status);
        }
    })
    .await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn refusals_are_problem_documents() {
    let folder = tempfile::tempdir().unwrap();
    let server = Server::start(walks("hall", 2, 0..0), Duration::ZERO, CALIBRATION).await;
    with_companion(&server, quick(), folder.path(), async |companion| {
        for (path, status, detail) in [
            ("/nothing", 404, "there is no resource at /nothing"),
            ("/counts/gate", 404, "there is no camera gate"),
            ("/sites/ground", 404, "there is no site ground"),
            (
                "/counts/hall?step=90s",
                422,
                "step: \"90s\" is not a duration of whole minutes",
            ),
            (
                "/counts/hall?from=someday",
                422,
                "from: \"someday\" is not a time",
            ),
            (
                "/counts/hall?from=2020-01-01T00:00:00Z&step=1m",
                422,
                "from: the time has more than",
            ),
            (
                "/counts/hall?colour=red",
                422,
                "query: unknown field `colour`",
            ),
            (
                "/counts/hall?step=1m&step=1m",
                422,
                "query: duplicate field `step`",
            ),
            (
                "/counts/hall?format=xml",
                422,
                "format: \"xml\" is not a format: give json or csv",
            ),
        ] {
            let (given, body) = companion.get(path).await;
            let problem: Value = serde_json::from_str(&body).unwrap();
            assert_eq!(
                (given, &problem["status"]),
                (status, &Value::from(status)),
                "{path}"
            );
            assert!(
                problem["detail"].as_str().unwrap().starts_with(detail),
                "{body}"
            );
        }
    })
    .await;
}

/// Answers requests with these statuses in turn, and keeps the requests.
async fn receiver(statuses: &'static [u16]) -> (String, Arc<Mutex<Vec<String>>>) {
    let listener = tokio::net::TcpListener::bind("127.0.0.1:0").await.unwrap();
    let url = format!("http://{}/hook", listener.local_addr().unwrap());
    let requests = Arc::new(Mutex::new(Vec::new()));
    let kept = Arc::clone(&requests);
    tokio::spawn(async move {
        for number in 0.. {
            let (mut stream, _) = listener.accept().await.unwrap();
            let mut request = Vec::new();
            let mut chunk = [0; 4096];
            while !request.ends_with(b"}") {
                let length = stream.read(&mut chunk).await.unwrap();
                if length == 0 {
                    break;
                }
                request.extend_from_slice(&chunk[..length]);
            }
            let status = statuses.get(number).copied().unwrap_or(200);
            kept.lock()
                .unwrap()
                .push(String::from_utf8(request).unwrap());
            let answer =
                format!("HTTP/1.1 {status} X\r\ncontent-length: 0\r\nconnection: close\r\n\r\n");
            stream.write_all(answer.as_bytes()).await.unwrap();
        }
    });
    (url, requests)
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn crossings_reach_webhooks_signed_and_repeated() {
    let folder = tempfile::tempdir().unwrap();
    let secret = folder.path().join("secret");
    std::fs::write(&secret, SECRET).unwrap();
    let (url, requests) = receiver(&[500]).await;
    let walks = walks("hall", 12, 0..0);
    let server = Server::start(walks, Duration::ZERO, CALIBRATION).await;
    let settings = webhook(&url, &secret, "crossing");
    with_companion(&server, settings, folder.path(), async |companion| {
        companion
            .until(
                "both messages are delivered",
                async |companion: &Companion| {
                    let (_, metrics) = companion.get("/metrics").await;
                    metrics
                        .contains("lookdown_count_webhooks_delivered_total 2")
                        .then_some(())
                },
            )
            .await;
    })
    .await;
    let requests = requests.lock().unwrap().clone();
    let [failed, repeated, second] = requests.as_slice() else {
        panic!("{requests:#?}");
    };
    let header = |request: &str, name: &str| {
        let value = request.lines().find_map(|line| line.strip_prefix(name));
        value
            .unwrap_or_else(|| panic!("{name} is missing in {request}"))
            .to_owned()
    };
    assert_eq!(
        header(failed, "webhook-id: "),
        header(repeated, "webhook-id: ")
    );
    assert!(header(repeated, "webhook-signature: ").starts_with("v1,"));
    header(repeated, "webhook-timestamp: ");
    let body = |request: &str| -> Value {
        serde_json::from_str(request.split("\r\n\r\n").nth(1).unwrap()).unwrap()
    };
    assert_eq!(body(repeated)["type"], "crossing");
    assert_eq!(body(repeated)["data"]["direction"], "in");
    assert_eq!(body(second)["data"]["direction"], "out");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn condition_that_holds_is_not_repeated_by_a_restart() {
    let folder = tempfile::tempdir().unwrap();
    let secret = folder.path().join("secret");
    std::fs::write(&secret, SECRET).unwrap();
    let (url, requests) = receiver(&[]).await;
    // A person stands in the hall for 10 s and is gone for 10 s. The restart is after 5 s.
    let reports = |seconds: i64| {
        let frames = (0..seconds * 5).map(|frame| {
            let persons = [person(1.0, 0.5)];
            let standing: &[String] = if frame < 50 { &persons } else { &[] };
            event("hall", frame * 200, standing)
        });
        frames.collect::<Vec<_>>()
    };
    for (seconds, reports_of_run) in [(5, 25), (20, 75)] {
        let server = Server::start(reports(seconds), Duration::ZERO, CALIBRATION).await;
        let settings = webhook(&url, &secret, "occupancy");
        with_companion(&server, settings, folder.path(), async |companion| {
            companion.until_counted(reports_of_run).await;
            companion
                .until("one message is delivered", async |companion: &Companion| {
                    let (_, metrics) = companion.get("/metrics").await;
                    metrics
                        .contains("lookdown_count_webhooks_delivered_total 1")
                        .then_some(())
                })
                .await;
        })
        .await;
    }
    let requests = requests.lock().unwrap();
    let types = requests.iter().map(|request| {
        let body: Value = serde_json::from_str(request.split("\r\n\r\n").nth(1).unwrap()).unwrap();
        body["type"].as_str().unwrap().to_owned()
    });
    assert_eq!(
        types.collect::<Vec<_>>(),
        ["occupancy.reached", "occupancy.ended"]
    );
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_crossing_is_shown_once_it_is_stored() {
    let folder = tempfile::tempdir().unwrap();
    let server = Server::start(walks("hall", 12, 0..0), Duration::ZERO, CALIBRATION).await;
    let settings = CountEntry {
        commit_every: Duration::from_mins(1),
        ..quick()
    };
    with_companion(&server, settings, folder.path(), async |companion| {
        companion
            .until("a crossing is shown", async |companion: &Companion| {
                let (_, metrics) = companion.get("/metrics").await;
                let shown = metrics.lines();
                let mut shown = shown.filter(|line| line.starts_with("lookdown_count_crossings"));
                shown.any(|line| !line.ends_with(" 0")).then_some(())
            })
            .await;
        let store = rusqlite::Connection::open(folder.path().join("counts.sqlite")).unwrap();
        let stored = store.query_row("SELECT sum(crossings) FROM line_totals", [], |row| {
            row.get::<_, Option<i64>>(0)
        });
        assert!(stored.unwrap() >= Some(1), "the process may be killed now");
    })
    .await;
}

#[test]
fn invalid_settings_name_field_value_and_remedy() {
    let of_server = CountEntry {
        server: ServerEntry {
            url: Some("ftp://x".to_owned()),
            ..ServerEntry::default()
        },
        ..CountEntry::default()
    };
    let error = of_server.check().unwrap_err().to_string();
    let expected = "upstream.url: \"ftp://x\" is not a URL of a server";
    assert!(error.starts_with(expected), "{error}");
}

#[test]
fn a_bad_webhook_takes_no_other_one_with_it() {
    let folder = tempfile::tempdir().unwrap();
    let secret = folder.path().join("hook.secret");
    std::fs::write(&secret, SECRET).unwrap();
    let mut entry = webhook("http://x", Path::new("/nowhere"), "crossing");
    let good = webhook("http://x", &secret, "crossing");
    entry.webhooks.extend(good.webhooks.clone());
    let (mut checked, good) = (entry.check().unwrap(), good.check().unwrap());
    let problem = checked.webhook_problems.remove(0);
    let expected = "webhooks[0].secret_file: /nowhere cannot be read";
    assert!(problem.starts_with(expected), "{problem}");
    assert_eq!(checked, good);
}

#[test]
fn cameras_of_a_store_have_separate_recordings() {
    let folder = tempfile::tempdir().unwrap();
    let store = folder.path().join("counts.sqlite");
    let file = folder.path().join("hall.json");
    std::fs::write(&file, CALIBRATION).unwrap();
    let calibration = Arc::new(Calibration::read(&file).unwrap());
    let reports = walks("hall", 30, 0..0);
    let open = |camera| {
        let gap = Duration::from_secs(10);
        Recording::open(&store, gap, camera, Some(Arc::clone(&calibration))).unwrap()
    };
    let time = |id: u64| jiff::Timestamp::from_microsecond(id.try_into().unwrap()).unwrap();
    let last = reports.last().unwrap().0;
    for camera in ["hall", "yard"] {
        let mut recording = open(camera);
        assert_eq!(recording.counted_until(), None);
        for (id, report) in &reports {
            recording.count(time(*id), report.as_bytes()).unwrap();
        }
        recording.commit().unwrap();
        assert_eq!(recording.followed(time(last)).into_iter().next(), Some(0));
        assert!(recording.followed(time(reports[0].0)).is_empty());
        let crossings = recording.lines().into_iter().map(|line| line.crossings);
        assert_eq!(crossings.sum::<u64>(), 5, "{camera}");
        drop(recording);
        assert_eq!(open(camera).counted_until(), Some(time(last)));
    }
}
