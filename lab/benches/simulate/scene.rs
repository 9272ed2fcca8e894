//! The scene: a hall with its cameras, the trackers that follow it, and a line in its middle.

use lookdown_tracking::{
    CameraPose, Observation, Plane, Track, TrackId, Tracker, TrackerSettings, Walk,
    lines::{Crossing, DEFAULT_BAND_M, Direction, Line, LineCounter, LineState},
    relative_pose,
};
use nalgebra::Vector2;
use serde_json::{Value, json};
use std::{
    collections::{BTreeMap, HashMap},
    fmt::Debug,
    str::FromStr,
};

use crate::{
    chance::Chance,
    detector::{Camera, FRAME_PX, Shown, bounds},
    figures::Figures,
    follow::Follow,
    people::{Hall, People, STEP_S},
};

/// Height of the cameras above the floor, meters.
const CAMERA_M: f64 = 3.0;
/// Persons farther from a camera than this are out of its sight, meters: 74° off the axis.
const SIGHT_M: f64 = 3.5 * CAMERA_M;
/// Place of the counting line on the x axis, meters.
const LINE_X_M: f64 = 0.8;
/// Tracks count as present for this long after their last person, seconds.
const PRESENT_S: f64 = 1.0;
/// Share of the frames that never arrive.
const LOST_FRAMES: f64 = 0.02;
/// Capture times differ from the regular ones by up to this share of the interval.
const JITTER: f64 = 0.1;
/// Half the hysteresis band of the line in the frame, as a share of the frame's side.
const BAND_OF_FRAME: f64 = 0.02;

/// The command line.
pub struct Options {
    rate: f64,
    seed: u64,
    seconds: f64,
    persons: usize,
    figures: Figures,
    is_site: bool,
    follows: bool,
    settings: TrackerSettings,
}

impl Options {
    pub fn from_arguments(arguments: impl Iterator<Item = String>) -> Self {
        let mut given: HashMap<String, String> = HashMap::new();
        let mut arguments = arguments.peekable();
        while let Some(name) = arguments.next() {
            let value = arguments.next_if(|value| !value.starts_with("--"));
            given.insert(name, value.unwrap_or_default());
        }
        let detector = given.get("--detector").map_or("rendered", String::as_str);
        Self {
            rate: number(given.get("--rate"), 5.0),
            seed: number(given.get("--seed"), 1),
            seconds: number(given.get("--seconds"), 300.0),
            persons: number(given.get("--persons"), 8),
            figures: Figures::from_name(detector).expect("--detector is a name of figures"),
            is_site: given.contains_key("--site"),
            follows: given.contains_key("--follow"),
            settings: given
                .get("--settings")
                .map_or_else(TrackerSettings::default, |text| {
                    serde_json::from_str(text).expect("settings of the tracker as JSON")
                }),
        }
    }
}

fn number<T: FromStr<Err: Debug>>(text: Option<&String>, default: T) -> T {
    text.map_or(default, |text| text.parse().expect("a number"))
}

/// A tracker with its line.
struct Follower {
    tracker: Tracker,
    line: LineCounter,
    crossings: Vec<Crossing>,
    /// The places of each track.
    walks: BTreeMap<TrackId, Walk>,
}

impl Follower {
    fn new(poses: &[CameraPose], line: Line, settings: &TrackerSettings) -> Self {
        Self {
            tracker: Tracker::new(poses, *settings).expect("valid cameras"),
            line: LineCounter::new(vec![line], LineState::default()),
            crossings: Vec::new(),
            walks: BTreeMap::new(),
        }
    }

    fn update(&mut self, camera: usize, at_s: f64, persons: &[Observation]) {
        self.tracker
            .update(f64::INFINITY, camera, at_s, persons)
            .expect("reports in order");
        self.crossings
            .extend(self.line.update(self.tracker.tracks()));
        for track in self.tracker.tracks().filter(|track| track.seen_s == at_s) {
            if let Some(place) = track.place(Plane::FloorM) {
                self.walks.entry(track.id).or_default().push((at_s, place));
            }
        }
    }

    /// The walks on the floor of the camera at this pose.
    fn walks_of(&self, pose: &CameraPose) -> Vec<Walk> {
        let own = |&(at_s, place): &(f64, [f64; 2])| (at_s, pose.from_site(place));
        let walks = self.walks.values();
        walks.map(|walk| walk.iter().map(own).collect()).collect()
    }

    /// The tracks that this report continued, with the index of their persons.
    fn matches(&self, camera: usize, at_s: f64) -> Vec<Value> {
        let current = self
            .tracker
            .tracks()
            .filter(|track| track.last_person.camera == camera && track.seen_s == at_s);
        current
            .map(|track| json!([track.id, track.last_person.person]))
            .collect()
    }

    fn places(&self, at_s: f64) -> Vec<Value> {
        let present = self
            .tracker
            .tracks()
            .filter(|track| at_s - track.seen_s <= PRESENT_S);
        present.filter_map(|track| place_at(track, at_s)).collect()
    }

    fn crossings(&self) -> Vec<Value> {
        let crossings = self.crossings.iter();
        crossings
            .map(|crossing| json!([crossing.direction, crossing.at_s]))
            .collect()
    }
}

fn place_at(track: &Track, at_s: f64) -> Option<Value> {
    let [x, y] = track.place(Plane::FloorM)?;
    let [vx, vy] = track.velocity_m_s()?;
    let dt = at_s - track.seen_s;
    Some(json!([track.id, x + vx * dt, y + vy * dt]))
}

/// The hall, its cameras and its followers.
pub struct Scene {
    people: People,
    walk_chance: Chance,
    clock: Chance,
    cameras: Vec<Camera>,
    due_s: Vec<f64>,
    interval_s: f64,
    now_s: f64,
    end_s: f64,
    /// One tracker of all cameras.
    site: Follower,
    /// A tracker of each camera by itself.
    separate: Vec<Follower>,
    /// The same without the camera's height.
    bearing: Follower,
    /// The followed persons of each camera, with `--follow`.
    follows: Vec<Follow>,
    sides: BTreeMap<u64, Direction>,
    true_crossings: Vec<(Direction, f64)>,
}

impl Scene {
    pub fn new(options: &Options) -> Self {
        let pose = |x, yaw_deg| CameraPose {
            position_m: [x, 0.0],
            yaw_deg,
            height_m: Some(CAMERA_M),
        };
        let (hall, poses) = if options.is_site {
            (
                Vector2::new(10.0, 5.0),
                vec![pose(-4.5, 20.0), pose(4.5, 250.0)],
            )
        } else {
            (Vector2::new(6.0, 5.0), vec![pose(0.0, 0.0)])
        };
        let mut walk_chance = Chance::new(options.seed, 0);
        let people = People::new(Hall(hall), options.persons, &mut walk_chance);
        let reach = Vector2::new(5.5, 4.5);
        let camera = |(stream, &pose): (u64, _)| {
            Camera::new(
                pose,
                &options.figures,
                Chance::new(options.seed, stream),
                reach,
            )
        };
        let cameras: Vec<_> = (1..).zip(&poses).map(camera).collect();
        let line = floor_line(hall.y + 1.0);
        let mut clock = Chance::new(options.seed, 1000);
        let interval_s = 1.0 / options.rate;
        Self {
            people,
            walk_chance,
            due_s: poses
                .iter()
                .map(|_| clock.uniform(0.0, interval_s))
                .collect(),
            clock,
            interval_s,
            now_s: 0.0,
            end_s: options.seconds,
            site: Follower::new(&poses, line.clone(), &options.settings),
            separate: poses
                .iter()
                .map(|&pose| Follower::new(&[pose], line.clone(), &options.settings))
                .collect(),
            bearing: Follower::new(
                &[CameraPose::alone(None)],
                frame_line(&cameras[0], hall.y),
                &options.settings,
            ),
            follows: if options.follows {
                poses.iter().map(|_| Follow::default()).collect()
            } else {
                Vec::new()
            },
            cameras,
            sides: BTreeMap::new(),
            true_crossings: Vec::new(),
        }
    }

    /// Returns the next frame of any camera; `None` at the end.
    pub fn next_frame(&mut self) -> Option<Value> {
        while self.now_s < self.end_s {
            if let Some(camera) = self.due_s.iter().position(|&due_s| due_s <= self.now_s) {
                let jitter = 1.0 + self.clock.uniform(-JITTER, JITTER);
                self.due_s[camera] += self.interval_s * jitter;
                if !self.clock.happens(LOST_FRAMES) {
                    return Some(self.frame(camera));
                }
            } else {
                self.people.step(&mut self.walk_chance);
                self.now_s += STEP_S;
                self.count_truth();
            }
        }
        None
    }

    fn frame(&mut self, number: usize) -> Value {
        let at_s = self.now_s;
        let camera = &mut self.cameras[number];
        let mut truth = Vec::new();
        let mut shown: Vec<Shown> = Vec::new();
        for person in &self.people.present {
            let place = camera.floor_of_site(person.place);
            let mut body = person.body();
            body.lean_m = camera.floor_of_site(person.place + body.lean_m) - place;
            let in_sight = (place.norm() <= SIGHT_M).then_some(());
            let seen = in_sight.and_then(|()| camera.show(person.id, place, body));
            if let Some(seen) = seen {
                truth.push(json!({"id": seen.id, "box": bounds(&seen.oriented)}));
                shown.push(seen);
            }
        }
        let found = match self.follows.get_mut(number) {
            Some(follow) => {
                let found = follow.find(camera, at_s, &shown);
                camera.observed(&found)
            }
            None => camera.detect(at_s, &shown),
        };
        let persons: Vec<_> = found.iter().map(|(person, _)| *person).collect();
        self.site.update(number, at_s, &persons);
        self.separate[number].update(0, at_s, &persons);
        if number == 0 {
            self.bearing.update(0, at_s, &persons);
        }
        let pose = self.cameras[number].pose;
        let boxes = found.iter().map(|(person, oriented)| {
            let floor = person.floor_m.map(|place| pose.to_site(place));
            json!({"box": bounds(oriented), "score": person.score, "floor": floor})
        });
        let everyone = self.people.present.iter();
        json!({
            "camera": number,
            "at_s": at_s,
            "truth": truth,
            "everyone": everyone.map(|p| json!([p.id, p.place.x, p.place.y])).collect::<Vec<_>>(),
            "persons": boxes.collect::<Vec<_>>(),
            "floor": self.site.matches(number, at_s),
            "bearing": if number == 0 { self.bearing.matches(0, at_s) } else { Vec::new() },
            "merged": self.site.places(at_s),
            "separate": self.separate.iter().map(|one| one.places(at_s)).collect::<Vec<_>>(),
        })
    }

    /// Counts true crossings: beyond the band on one side, then on the other.
    fn count_truth(&mut self) {
        for person in &self.people.present {
            let beyond = person.place.x - LINE_X_M;
            if beyond.abs() < DEFAULT_BAND_M {
                continue;
            }
            // The line runs toward growing y, which has the smaller x on its right.
            let side = if beyond < 0.0 {
                Direction::In
            } else {
                Direction::Out
            };
            let before = self.sides.insert(person.id, side);
            if before.is_some_and(|before| before != side) {
                self.true_crossings.push((side, self.now_s));
            }
        }
    }

    /// The pose of the second camera from the tracks of both, each on its own floor, and its
    /// errors.
    fn second_camera(&self) -> Option<Value> {
        let [first, second] = self.separate.as_slice() else {
            return None;
        };
        let [one, other] = [0, 1].map(|camera: usize| self.cameras[camera].pose);
        let found = relative_pose(&first.walks_of(&one), &second.walks_of(&other));
        let Ok(found) = found else {
            return Some(json!({"refused": found.err().map(|reason| reason.to_string())}));
        };
        let [x, y] = one.from_site(other.position_m);
        let turn = found.yaw_deg - (other.yaw_deg - one.yaw_deg);
        Some(json!({
            "position_error_m": (found.position_m[0] - x).hypot(found.position_m[1] - y),
            "yaw_error_deg": (turn + 180.0).rem_euclid(360.0) - 180.0,
            "position_sd_m": found.position_sd_m,
            "yaw_sd_deg": found.yaw_sd_deg,
            "walks": found.walks,
            "residual_m": found.residual_m,
            "scale": found.scale,
        }))
    }

    pub fn crossings(&self) -> Value {
        let separate: Vec<_> = self.separate.iter().flat_map(Follower::crossings).collect();
        json!({
            "second_camera": self.second_camera(),
            "searches": self.follows.iter().map(|follow| follow.searches).collect::<Vec<_>>(),
            "line_x_m": LINE_X_M,
            "band_m": DEFAULT_BAND_M,
            "truth": self.true_crossings,
            "floor": self.site.crossings(),
            "separate": separate,
            "bearing": self.bearing.crossings(),
        })
    }
}

fn floor_line(half_m: f64) -> Line {
    Line {
        name: "middle".to_owned(),
        plane: Plane::FloorM,
        points: vec![[LINE_X_M, -half_m], [LINE_X_M, half_m]],
        band: DEFAULT_BAND_M,
    }
}

/// The same line as a curve in the frame.
fn frame_line(camera: &Camera, half_m: f64) -> Line {
    let steps = (0..=40).map(|step| half_m * (f64::from(step) / 20.0 - 1.0));
    let pixels = steps.filter_map(|y| {
        let pixel = camera.pixel_of_floor(camera.floor_of_site(Vector2::new(LINE_X_M, y)))?;
        Some([pixel.x, pixel.y])
    });
    Line {
        name: "middle".to_owned(),
        plane: Plane::FramePx,
        points: pixels.collect(),
        band: BAND_OF_FRAME * FRAME_PX,
    }
}
