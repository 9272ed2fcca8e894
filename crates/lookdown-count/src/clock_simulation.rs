//! Simulated jumps of the clocks of the server, of a camera and of this machine, with restarts of
//! the server and kills of the companion.

mod tests;

use std::{
    collections::BTreeMap,
    sync::Arc,
    time::{Duration, Instant},
};

use jiff::Timestamp;
use lookdown_tracking::{CameraPose, Plane, lines::Line};

use crate::{
    counter::{Accepted, Counter, CountingOptions},
    definition::CameraDefinition,
    now::Now,
    report::{
        ReceivedReport,
        other_fields::{OF_PERSON, OF_REPORT},
    },
    store::Store,
};

const START_MS: i64 = 1_795_262_400_000;
const FRAME_MS: i64 = 200;
const CAMERAS: [&str; 2] = ["gate", "hall"];
/// Reports of a camera that the server keeps.
const HISTORY: usize = 100;

/// One step of the simulation.
#[derive(Debug, Clone)]
enum Step {
    Run {
        seconds: i64,
    },
    ServerClock {
        ahead_ms: i64,
    },
    CameraClock {
        ahead_ms: i64,
    },
    OwnClock {
        ahead_ms: i64,
    },
    RestartServer,
    Disconnect,
    Kill,
    /// The server sends one report with the largest ID.
    HugeId,
}

/// A server as the real one assigns IDs and answers `Last-Event-ID`.
#[derive(Default)]
struct Server {
    last_id: u64,
    kept: Vec<(u64, usize)>,
}

/// A report and the number of times that it is in the sums.
struct Sent {
    camera: usize,
    json: String,
    counted: u32,
}

struct World {
    true_ms: i64,
    server_ahead_ms: i64,
    camera_ahead_ms: i64,
    own_ahead_ms: i64,
    server: Server,
    sent: Vec<Sent>,
    store: Store,
    counter: Counter,
    definition: Arc<CameraDefinition>,
    is_connected: bool,
    /// Reports that were counted since the last commit.
    uncommitted: Vec<usize>,
    started: Instant,
    true_crossings: u64,
    _folder: tempfile::TempDir,
}

fn counter(store: &Store, definition: &Arc<CameraDefinition>) -> Counter {
    let options = CountingOptions {
        longest_gap_ms: 10_000,
        max_cameras: 64,
        ..CountingOptions::default()
    };
    let resumed = store.resumed().unwrap();
    let mut counter = Counter::new(options, resumed.last_event, resumed.totals);
    for state in resumed.scenes {
        counter.resume(state, |_| Arc::clone(definition));
    }
    counter
}

impl World {
    fn new(site: Option<&str>) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::open(&folder.path().join("counts.sqlite")).unwrap();
        let mut definition = CameraDefinition::unknown();
        definition.site = site.map(str::to_owned);
        definition.pose = CameraPose::alone(Some(3.0));
        definition.lines = vec![Line {
            name: "door".to_owned(),
            plane: Plane::FloorM,
            points: vec![[0.0, -5.0], [0.0, 5.0]],
            band: 0.3,
        }];
        definition.directions = vec![["in".to_owned(), "out".to_owned()]];
        let definition = Arc::new(definition);
        Self {
            true_ms: START_MS,
            server_ahead_ms: 0,
            camera_ahead_ms: 0,
            own_ahead_ms: 0,
            server: Server::default(),
            sent: Vec::new(),
            counter: counter(&store, &definition),
            store,
            definition,
            is_connected: false,
            uncommitted: Vec::new(),
            started: Instant::now(),
            true_crossings: 0,
            _folder: folder,
        }
    }

    fn step(&mut self, step: &Step) {
        match *step {
            Step::Run { seconds } => self.run(seconds),
            Step::ServerClock { ahead_ms } => self.server_ahead_ms = ahead_ms,
            Step::CameraClock { ahead_ms } => self.camera_ahead_ms = ahead_ms,
            Step::OwnClock { ahead_ms } => self.own_ahead_ms = ahead_ms,
            Step::RestartServer => {
                self.server = Server::default();
                self.is_connected = false;
            }
            Step::Disconnect => self.is_connected = false,
            Step::Kill => {
                for number in self.uncommitted.drain(..) {
                    self.sent[number].counted -= 1;
                }
                self.counter = counter(&self.store, &self.definition);
                self.is_connected = false;
            }
            Step::HugeId => {
                let number = self.capture(0, &[]);
                if self.is_connected {
                    self.deliver(u64::MAX, number);
                }
            }
        }
    }

    fn run(&mut self, seconds: i64) {
        for frame in 0..seconds * 1000 / FRAME_MS {
            self.true_ms += FRAME_MS;
            let before = place_at(self.true_ms - FRAME_MS);
            let place = place_at(self.true_ms);
            if before.signum() != place.signum() {
                self.true_crossings += 1;
            }
            for camera in 0..CAMERAS.len() {
                // The person is in the hall.
                let persons = [place];
                let number = self.capture(camera, if camera == 1 { &persons } else { &[] });
                let id = self.publish(camera, number);
                if self.is_connected {
                    self.deliver(id, number);
                }
            }
            if frame % 5 == 4 {
                self.connect();
            }
            if frame % 10 == 9 {
                self.commit();
            }
        }
    }

    /// Creates a report. Only the hall has a camera that sends times.
    fn capture(&mut self, camera: usize, persons: &[f64]) -> usize {
        let time = |ms: i64| Timestamp::from_millisecond(ms).unwrap();
        let received = time(self.true_ms + self.server_ahead_ms);
        let captured = match camera {
            1 => format!("\"{}\"", time(self.true_ms - 50 + self.camera_ahead_ms)),
            _ => "null".to_owned(),
        };
        let persons = persons.iter().map(|x| {
            format!(
                r#"{{{OF_PERSON}, "score": 0.95, "floor": {{"x_m": {x}, "y_m": 1.0}},
                "bearing": {{"azimuth_deg": {}, "off_axis_deg": {}}},
                "oriented_box": {{"cx": 100, "cy": 100, "width": 20, "height": 40, "angle_deg": 0}}}}"#,
                1_f64.atan2(*x).to_degrees() + 90.0,
                x.hypot(1.0).atan2(1.9).to_degrees(),
            )
        });
        let persons = persons.collect::<Vec<_>>().join(",");
        let name = CAMERAS[camera];
        let json = format!(
            r#"{{"camera": "{name}", "received_at": "{received}", "captured_at": {captured},
            "calibration": {{"id": "x", "revision": "1", "assumed": true}},
            "image": {{"width": 200, "height": 200}}, "persons": [{persons}],
            {OF_REPORT}}}"#
        );
        self.sent.push(Sent {
            camera,
            json,
            counted: 0,
        });
        self.sent.len() - 1
    }

    fn publish(&mut self, camera: usize, number: usize) -> u64 {
        let now = u64::try_from((self.true_ms + self.server_ahead_ms).max(0)).unwrap() * 1000;
        let id = now.max(self.server.last_id + 1);
        self.server.last_id = id;
        self.server.kept.push((id, number));
        let sent = &self.sent;
        let of_camera = |(_, number): &&(u64, usize)| sent[*number].camera == camera;
        if self.server.kept.iter().filter(of_camera).count() > HISTORY {
            let oldest = self.server.kept.iter().position(|kept| of_camera(&kept));
            self.server.kept.remove(oldest.unwrap());
        }
        id
    }

    /// Opens a stream of events: those after the last one, or the latest one of each camera.
    fn connect(&mut self) {
        if self.is_connected {
            return;
        }
        self.is_connected = true;
        let last = self.counter.last_event;
        let kept = self.server.kept.clone();
        let missed: Vec<_> = if last > 0 && last <= self.server.last_id {
            kept.into_iter().filter(|(id, _)| *id > last).collect()
        } else {
            let latest: BTreeMap<_, _> = kept
                .into_iter()
                .map(|(id, number)| (self.sent[number].camera, (id, number)))
                .collect();
            let mut latest: Vec<_> = latest.into_values().collect();
            latest.sort_unstable();
            latest
        };
        for (id, number) in missed {
            self.deliver(id, number);
        }
    }

    fn deliver(&mut self, id: u64, number: usize) {
        let report: ReceivedReport = serde_json::from_str(&self.sent[number].json).unwrap();
        let elapsed = Duration::from_millis((self.true_ms - START_MS).unsigned_abs());
        let now = Now {
            unix_ms: self.true_ms + self.own_ahead_ms,
            instant: self.started + elapsed,
        };
        let accepted = self.counter.accept(id, &report, &self.definition, now);
        if matches!(accepted, Accepted::Counted(_)) {
            self.sent[number].counted += 1;
            self.uncommitted.push(number);
        }
    }

    fn commit(&mut self) {
        if let Some(batch) = self.counter.take_batch() {
            self.store.commit(&batch, &[], None).unwrap();
            self.counter.stored(&batch);
        }
        self.uncommitted.clear();
    }

    fn crossings(&self) -> u64 {
        let crossings = self.counter.stored_totals.crossings.iter();
        let of_hall = crossings.filter(|(of, _)| of.camera == CAMERAS[1]);
        of_hall.map(|(_, count)| count).sum()
    }
}

/// The place of a person who walks to and fro, 6 s each way.
fn place_at(true_ms: i64) -> f64 {
    let phase = (true_ms - START_MS).rem_euclid(12_000) as f64 / 6_000.0;
    let share = if phase < 1.0 { phase } else { 2.0 - phase };
    share * 6.0 - 3.05
}
