//! Simulated jumps of the clocks of the server, of a camera and of this machine, with restarts of the
//! server and kills of the companion.

use std::{
    collections::BTreeMap,
    sync::Arc,
    time::{Duration, Instant},
};

use jiff::Timestamp;
use lookdown_tracking::{CameraPose, Plane, lines::Line};
use proptest::prelude::*;

use crate::{
    definition::CameraDefinition,
    engine::{Accepted, CountingOptions, Engine},
    now::Now,
    report::Report,
    scene::LATE_LIMIT,
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
    engine: Engine,
    definition: Arc<CameraDefinition>,
    is_connected: bool,
    /// Reports that were counted since the last commit.
    uncommitted: Vec<usize>,
    started: Instant,
    true_crossings: u64,
    _folder: tempfile::TempDir,
}

fn engine(store: &Store, definition: &Arc<CameraDefinition>) -> Engine {
    let options = CountingOptions {
        longest_gap_ms: 10_000,
        max_cameras: 64,
    };
    let resumed = store.resumed().unwrap();
    let mut engine = Engine::new(options, resumed.last_event, resumed.totals);
    for state in resumed.scenes {
        engine.resume(state, |_| Arc::clone(definition));
    }
    engine
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
            engine: engine(&store, &definition),
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
                self.engine = engine(&self.store, &self.definition);
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
                r#"{{"score": 0.95, "floor": {{"x_m": {x}, "y_m": 1.0}},
                "bearing": {{"azimuth_deg": {}, "off_axis_deg": {}}},
                "oriented_box": {{"cx": 100, "cy": 100, "height": 40, "angle_deg": 0}}}}"#,
                1_f64.atan2(*x).to_degrees() + 90.0,
                x.hypot(1.0).atan2(1.9).to_degrees(),
            )
        });
        let persons = persons.collect::<Vec<_>>().join(",");
        let name = CAMERAS[camera];
        let json = format!(
            r#"{{"camera": "{name}", "received_at": "{received}", "captured_at": {captured},
            "calibration": {{"id": "x", "revision": "1", "assumed": true}},
            "image": {{"width": 200, "height": 200}}, "persons": [{persons}]}}"#
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
        let last = self.engine.last_event();
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
        let report: Report = serde_json::from_str(&self.sent[number].json).unwrap();
        let elapsed = Duration::from_millis((self.true_ms - START_MS).unsigned_abs());
        let now = Now {
            unix_ms: self.true_ms + self.own_ahead_ms,
            instant: self.started + elapsed,
        };
        let accepted = self.engine.accept(id, &report, &self.definition, now);
        if matches!(accepted, Accepted::Counted(_)) {
            self.sent[number].counted += 1;
            self.uncommitted.push(number);
        }
    }

    fn commit(&mut self) {
        if let Some(batch) = self.engine.take_batch() {
            self.store.commit(&batch, &[], None).unwrap();
        }
        self.uncommitted.clear();
    }

    fn crossings(&self) -> u64 {
        let crossings = self.engine.totals().crossings.iter();
        let of_hall = crossings.filter(|(of, _)| of.camera == CAMERAS[1]);
        of_hall.map(|(_, count)| count).sum()
    }
}

/// The place of a person who walks to and fro, 6 s each way.
fn place_at(true_ms: i64) -> f64 {
    #[expect(clippy::cast_precision_loss, reason = "small")]
    let phase = (true_ms - START_MS).rem_euclid(12_000) as f64 / 6_000.0;
    let share = if phase < 1.0 { phase } else { 2.0 - phase };
    share * 6.0 - 3.05
}

fn jump() -> impl Strategy<Value = i64> {
    let second = 1000_i64;
    let jumps = [0, 1, 4, 20, 240, 3600, 86_400, 315_360_000];
    prop_oneof![
        proptest::sample::select(jumps.map(|jump| jump * second).to_vec()),
        proptest::sample::select(jumps.map(|jump| -jump * second).to_vec()),
        -20_000..20_000_i64,
    ]
}

fn steps() -> impl Strategy<Value = Vec<Step>> {
    let step = prop_oneof![
        4 => (1..25_i64).prop_map(|seconds| Step::Run { seconds }),
        2 => jump().prop_map(|ahead_ms| Step::ServerClock { ahead_ms }),
        2 => jump().prop_map(|ahead_ms| Step::CameraClock { ahead_ms }),
        1 => jump().prop_map(|ahead_ms| Step::OwnClock { ahead_ms }),
        2 => Just(Step::RestartServer),
        1 => Just(Step::Disconnect),
        1 => Just(Step::Kill),
        1 => Just(Step::HugeId),
    ];
    proptest::collection::vec(step, 1..14)
}

fn check(site: Option<&str>, steps: &[Step]) -> Result<(), TestCaseError> {
    let mut world = World::new(site);
    for step in steps {
        world.step(step);
    }
    // Connecting takes a second.
    world.run(i64::try_from(LATE_LIMIT.as_secs()).unwrap() + 2);
    prop_assert!(world.crossings() <= world.true_crossings);
    let settled = (world.sent.len(), world.crossings());
    world.run(24);
    for (number, sent) in world.sent.iter().enumerate() {
        prop_assert!(sent.counted <= 1, "report {number} is counted twice");
        let is_missed = number >= settled.0 && sent.counted == 0;
        prop_assert!(!is_missed, "report {number} is not counted: {}", sent.json);
    }
    // Four passes; one may be under way at either end.
    prop_assert!(world.crossings() >= settled.1 + 3);
    prop_assert!(world.crossings() <= world.true_crossings);
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn counting_survives_any_clock_jumps(steps in steps()) {
        check(None, &steps)?;
    }

    #[test]
    fn a_site_survives_any_clock_jumps(steps in steps()) {
        check(Some("ground"), &steps)?;
    }
}

/// The server is an hour ahead, and right after a restart.
#[test]
fn counting_continues_after_a_clock_that_was_ahead() {
    let mut world = World::new(None);
    world.step(&Step::ServerClock {
        ahead_ms: 3_600_000,
    });
    world.run(10);
    world.step(&Step::ServerClock { ahead_ms: 0 });
    world.step(&Step::RestartServer);
    world.run(10);
    let counted = world.sent.iter().filter(|sent| sent.counted == 1).count();
    // Each connection takes a second, in which two cameras have five frames each. Their latest
    // reports arrive with the connection.
    assert_eq!(counted, world.sent.len() - 2 * (10 - 2));
    assert_eq!(world.engine.position_resets(), 1);
}

#[test]
fn an_absurd_id_stops_no_counting() {
    let mut world = World::new(None);
    world.run(10);
    world.step(&Step::HugeId);
    world.run(10);
    let counted = world.sent.iter().filter(|sent| sent.counted == 1).count();
    // The connection takes a second. The report with the ID has the time of the one before.
    assert_eq!(counted, world.sent.len() - 8 - 1);
}

#[test]
fn repeated_and_late_reports_are_shown_as_dropped() {
    let mut world = World::new(None);
    world.run(4);
    let (id, number) = *world.server.kept.last().unwrap();
    world.deliver(id, number);
    let drops = world.engine.drops().of("hall").unwrap();
    assert_eq!((drops.reports, drops.reason.label()), (1, "repeated"));
    assert_eq!(drops.since_ms, Some(world.true_ms));

    world.step(&Step::CameraClock { ahead_ms: -4_000 });
    world.run(1);
    let drops = world.engine.drops().of("hall").unwrap();
    assert_eq!((drops.reports, drops.reason.label()), (6, "out_of_order"));
    world.run(10);
    let drops = world.engine.drops().of("hall").unwrap();
    assert_eq!(drops.since_ms, None);
}

/// A camera of the year 2036 neither counts as current nor ends the others.
#[test]
fn a_report_of_the_future_changes_no_other_camera() {
    let mut world = World::new(None);
    world.run(4);
    let present_ms = world.true_ms;
    world.step(&Step::ServerClock {
        ahead_ms: 315_360_000_000,
    });
    let number = world.capture(0, &[]);
    world.deliver(u64::MAX / 2, number);
    let snapshot = world.engine.snapshot(present_ms);
    let [gate, hall] = snapshot.cameras.as_slice() else {
        panic!("{snapshot:?}");
    };
    assert!(gate.last_report_ms > present_ms && gate.persons.is_none());
    assert_eq!(hall.persons, Some(1));
    world.engine.forget_silent(present_ms);
    assert!(world.engine.scene_of("hall").is_some());
}
