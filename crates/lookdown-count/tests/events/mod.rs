//! A server with `/events` and `/calibrations`, and the reports of people who walk.

use std::{
    net::SocketAddr,
    sync::{
        Arc, Mutex,
        atomic::{AtomicU64, Ordering},
    },
    time::Duration,
};

use tokio::{
    io::{AsyncBufReadExt, AsyncReadExt, AsyncWriteExt, BufReader},
    net::{TcpListener, TcpStream},
    time::sleep,
};

#[path = "../../src/report/other_fields.rs"]
mod other_fields;

use other_fields::{OF_PERSON, OF_REPORT};

/// The calibration of the camera.
pub const CALIBRATION: &str = r#"{
    "id": "hall", "image": {"width": 1000, "height": 1000},
    "lens": {"model": "equidistant", "focal": 318.3, "cx": 499.5, "cy": 499.5, "max_theta": 1.5708},
    "mount": {"world_up": [0, 0, -1], "height_m": 2.8},
    "zones": [{"name": "middle", "floor_m": [[-1, -1], [1, -1], [1, 1], [-1, 1]]}],
    "lines": [{"name": "door", "floor_m": [[0, 3], [0, -3]]}]
}"#;
/// Time of the first report, milliseconds since the Unix epoch: a whole minute.
pub const START_MS: i64 = 1_795_262_400_000;

/// The server. Its reports are sent again to each client that resumes.
pub struct Server {
    pub address: SocketAddr,
    /// ID of the last report that was sent.
    pub sent: Arc<AtomicU64>,
    /// `Last-Event-ID` of each connection.
    pub resumed: Arc<Mutex<Vec<Option<u64>>>>,
}

impl Server {
    /// Starts it with these events. `pause` follows each 10 events. `calibration` is that of the
    /// camera `hall`.
    pub async fn start(events: Vec<(u64, String)>, pause: Duration, calibration: &str) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
        let address = listener.local_addr().unwrap();
        let sent = Arc::new(AtomicU64::new(0));
        let resumed = Arc::new(Mutex::new(Vec::new()));
        let server = Self {
            address,
            sent: Arc::clone(&sent),
            resumed: Arc::clone(&resumed),
        };
        let events = Arc::new(events);
        let calibration = calibration.to_owned();
        tokio::spawn(async move {
            while let Ok((stream, _)) = listener.accept().await {
                let (events, sent) = (Arc::clone(&events), Arc::clone(&sent));
                let (resumed, calibration) = (Arc::clone(&resumed), calibration.clone());
                tokio::spawn(async move {
                    // A client that is gone is not a failure.
                    let _ = answer(stream, &events, pause, &sent, &resumed, &calibration).await;
                });
            }
        });
        server
    }
}

async fn answer(
    stream: TcpStream,
    events: &[(u64, String)],
    pause: Duration,
    sent: &AtomicU64,
    resumed: &Mutex<Vec<Option<u64>>>,
    calibration: &str,
) -> std::io::Result<()> {
    let mut stream = BufReader::new(stream);
    let mut head = String::new();
    while !head.ends_with("\r\n\r\n") {
        if stream.read_line(&mut head).await? == 0 {
            return Ok(());
        }
    }
    if head.starts_with("GET /calibrations/hall ") {
        let length = calibration.len();
        let answer = format!(
            "HTTP/1.1 200 OK\r\netag: \"1\"\r\ncontent-length: {length}\r\nconnection: close\r\n\r\n{calibration}"
        );
        return stream.write_all(answer.as_bytes()).await;
    }
    if !head.starts_with("GET /events ") {
        let answer = b"HTTP/1.1 404 Not Found\r\ncontent-length: 0\r\nconnection: close\r\n\r\n";
        return stream.write_all(answer).await;
    }
    let after = head
        .lines()
        .find_map(|line| line.strip_prefix("last-event-id: ")?.parse::<u64>().ok());
    resumed.lock().unwrap().push(after);
    let start = b"HTTP/1.1 200 OK\r\ncontent-type: text/event-stream\r\nconnection: close\r\n\r\n";
    stream.write_all(start).await?;
    let after = after.unwrap_or_default();
    for (number, (id, data)) in events.iter().filter(|(id, _)| *id > after).enumerate() {
        let event = format!("id: {id}\ndata: {data}\n\n");
        stream.write_all(event.as_bytes()).await?;
        sent.fetch_max(*id, Ordering::SeqCst);
        if number % 10 == 9 {
            sleep(pause).await;
        }
    }
    // The stream stays open until the client leaves.
    let mut rest = [0; 16];
    while stream.read(&mut rest).await? > 0 {}
    Ok(())
}

/// Returns the reports of `seconds` at 5 frames/s. People walk through the room along x, one every
/// 6 s, at 1.2 m/s, in turns to the right and to the left. Some are missed now and then.
/// No frame is captured in `gap` (seconds).
pub fn walks(camera: &str, seconds: i64, gap: std::ops::Range<i64>) -> Vec<(u64, String)> {
    let mut random = 1_u64;
    let mut events = Vec::new();
    for frame in 0..seconds * 5 {
        let at_ms = frame * 200;
        if gap.contains(&(at_ms / 1000)) {
            continue;
        }
        let mut persons = Vec::new();
        for walker in 0..=(at_ms / 6000) {
            let walked = (at_ms - walker * 6000) as f64 / 1000.0 * 1.2;
            random = random
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            let is_missed = (random >> 33).is_multiple_of(20);
            if walked > 7.0 || is_missed {
                continue;
            }
            let x = if walker % 2 == 0 {
                walked - 3.5
            } else {
                3.5 - walked
            };
            persons.push(person(x, 0.5));
        }
        events.push(event(camera, at_ms, &persons));
    }
    events
}

/// Returns a report as an event.
pub fn event(camera: &str, at_ms: i64, persons: &[String]) -> (u64, String) {
    let time = jiff::Timestamp::from_millisecond(START_MS + at_ms).unwrap();
    let persons = persons.join(",");
    let data = format!(
        r#"{{"camera": "{camera}", "received_at": "{time}", "captured_at": null,
        "calibration": {{"id": "hall", "revision": "1", "assumed": false}},
        "image": {{"width": 1000, "height": 1000}}, "persons": [{persons}], {OF_REPORT}}}"#
    );
    let id = u64::try_from((START_MS + at_ms) * 1000).unwrap();
    (id, data.replace('\n', " "))
}

/// Returns a person on the floor.
pub fn person(x: f64, y: f64) -> String {
    let azimuth = y.atan2(x).to_degrees().rem_euclid(360.0);
    let off_axis = x.hypot(y).atan2(1.8);
    let radius = 318.3 * off_axis;
    let (cx, cy) = (
        500.0 + radius * azimuth.to_radians().cos(),
        500.0 + radius * azimuth.to_radians().sin(),
    );
    format!(
        r#"{{{OF_PERSON}, "score": 0.9,
        "oriented_box": {{"cx": {cx}, "cy": {cy}, "width": 60, "height": 120, "angle_deg": 0}},
        "bearing": {{"azimuth_deg": {azimuth}, "off_axis_deg": {}}},
        "floor": {{"x_m": {x}, "y_m": {y}}}}}"#,
        off_axis.to_degrees()
    )
}
