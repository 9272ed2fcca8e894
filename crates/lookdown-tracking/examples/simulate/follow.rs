//! Follows persons between searches of the whole frame, as the server does with `follow`.
//!
//! crates/lookdown-detect/src/pipeline/follow.rs is the model. Moving persons stand for the cells with
//! motion.

use lookdown_lens::geometry::OrientedBox;
use nalgebra::Vector2;

use crate::detector::{Camera, FRAME_PX, Found, Shown, bounds};

/// Time from a search to the next one, seconds.
const SEARCH_EVERY_S: f64 = 0.9;
/// Side of a cell of the motion detection, pixels.
const CELL_PX: f64 = FRAME_PX / 64.0;
/// Least shift of a person that changes a cell, pixels.
const MOVED_PX: f64 = CELL_PX / 8.0;
/// The surroundings of a person, as a share of the larger side of its box.
const MARGIN: f64 = 0.5;
/// Least IoU of an expected box and a found one of the same person.
const SAME_IOU: f64 = 0.3;
/// Most logit by which a score from a crop is moved toward that of the last search.
const MAX_GAIN: f64 = 1.0;
/// Longest time for which a person in motion whom a search has missed is expected, seconds.
const MISSED_S: f64 = 1.0;
/// The logit of a person whom a search has missed.
const MISSED_LOGIT: f64 = -2.94;
/// The logit of the least score of a box that makes a new person.
const NEW_LOGIT: f64 = -2.75;

type Bounds = [f64; 4];

/// The followed persons of a camera.
#[derive(Default)]
pub struct Follow {
    state: Option<State>,
    /// Frames that were searched, and all frames.
    pub searches: [usize; 2],
}

struct State {
    searched_s: f64,
    /// The persons that the searched frame shows.
    shown: Vec<Shown>,
    targets: Vec<Target>,
}

#[derive(Clone, Copy)]
struct Target {
    found: Found,
    is_seen: bool,
    velocity: Vector2<f64>,
    at_s: f64,
    trail: Bounds,
    searched: Found,
    gain: Option<f64>,
}

impl Follow {
    /// The boxes of a frame at `at_s`, by a search or by crops.
    pub fn find(&mut self, camera: &mut Camera, at_s: f64, shown: &[Shown]) -> Vec<Found> {
        self.searches[1] += 1;
        let before = self.state.take();
        let followed = before.as_ref().and_then(|state| state.moving(at_s, shown));
        let (mut state, moving) = match (before, followed) {
            (Some(state), Some(moving)) => (state, moving),
            (before, _) => {
                let before = before.map_or_else(Vec::new, |before| before.targets);
                return self.search(camera, at_s, shown, &before);
            }
        };
        let crops = state
            .targets
            .iter()
            .zip(&moving)
            .filter(|(_, moves)| **moves);
        let crops: Vec<Bounds> = crops
            .map(|(target, _)| target.with_margin(target.expected(at_s)))
            .collect();
        let found = camera.search_crops(at_s, shown, |oriented| {
            let [x, y] = [oriented.center.x, oriented.center.y];
            crops.iter().any(|crop| overlap(crop, &[x, y, x, y]))
        });
        let found: Vec<_> = found
            .into_iter()
            .filter(|one| one.logit.is_finite())
            .collect();
        state.confirm(&moving, &found, at_s);
        let seen = state.targets.iter().filter(|target| target.is_seen);
        let seen = seen.map(|target| target.found).collect();
        self.state = Some(state);
        seen
    }

    fn search(
        &mut self,
        camera: &mut Camera,
        at_s: f64,
        shown: &[Shown],
        before: &[Target],
    ) -> Vec<Found> {
        self.searches[0] += 1;
        let found = camera.search(at_s, shown);
        let seen = found.iter().filter(|found| found.logit >= NEW_LOGIT);
        self.state = Some(State {
            searched_s: at_s,
            shown: shown.to_vec(),
            targets: targets_of(seen, at_s, before),
        });
        found
    }
}

fn targets_of<'a>(
    seen: impl Iterator<Item = &'a Found>,
    at_s: f64,
    before: &[Target],
) -> Vec<Target> {
    let mut is_found = vec![false; before.len()];
    let mut targets = Vec::new();
    for found in seen {
        let mut target = Target::new(*found, at_s);
        let overlaps = before
            .iter()
            .enumerate()
            .map(|(index, one)| (iou(one.expected(at_s), bounds(&found.oriented)), index));
        let nearest = overlaps.max_by(|a, b| a.0.total_cmp(&b.0));
        let nearest = nearest
            .filter(|(iou, _)| *iou >= SAME_IOU)
            .map(|(_, index)| {
                is_found[index] = true;
                &before[index]
            });
        if let Some(one) = nearest {
            target.velocity = one.velocity_to(found, at_s);
        }
        if !before.is_empty() {
            let logit = nearest.map_or(MISSED_LOGIT, |one| one.found.logit);
            target.found.logit = f64::midpoint(logit, found.logit);
        }
        targets.push(target);
    }
    let missed = before
        .iter()
        .zip(is_found)
        .filter(|(one, is_found)| !is_found && one.gain.is_some() && at_s - one.at_s < MISSED_S);
    targets.extend(missed.map(|(one, _)| Target {
        is_seen: false,
        ..*one
    }));
    targets
}

impl State {
    /// The targets with motion; `None` if the frame must be searched.
    fn moving(&self, at_s: f64, shown: &[Shown]) -> Option<Vec<bool>> {
        if at_s - self.searched_s >= SEARCH_EVERY_S {
            return None;
        }
        let moved = self.motion(shown);
        if !self.explains(&moved, at_s) {
            return None;
        }
        let is_moving = |target: &Target| {
            let places = hull(target.trail, target.expected(at_s));
            !target.is_seen || moved.iter().any(|one| overlap(&places, one))
        };
        Some(self.targets.iter().map(is_moving).collect())
    }

    /// The bounds of persons that have moved since the search, where they were and where they are.
    fn motion(&self, shown: &[Shown]) -> Vec<Bounds> {
        let mut moved = Vec::new();
        let twin = |all: &[Shown], id| all.iter().find(|other| other.id == id).copied();
        for now in shown {
            match twin(&self.shown, now.id) {
                Some(then) if (then.oriented.center - now.oriented.center).norm() < MOVED_PX => {}
                Some(then) => moved.extend([bounds(&then.oriented), bounds(&now.oriented)]),
                None => moved.push(bounds(&now.oriented)),
            }
        }
        let gone = self
            .shown
            .iter()
            .filter(|then| twin(shown, then.id).is_none());
        moved.extend(gone.map(|then| bounds(&then.oriented)));
        moved
    }

    fn explains(&self, moved: &[Bounds], at_s: f64) -> bool {
        let surroundings =
            |target: &Target| target.with_margin(hull(target.trail, target.expected(at_s)));
        let surroundings: Vec<_> = self.targets.iter().map(surroundings).collect();
        let is_near = |one: &&Bounds| surroundings.iter().any(|all| overlap(all, one));
        let (mut joined, mut others): (Vec<&Bounds>, Vec<_>) = moved.iter().partition(is_near);
        while let Some(one) = joined.pop() {
            let reach = widened(*one, 2.0 * CELL_PX);
            let (near, far): (Vec<_>, _) =
                others.into_iter().partition(|other| overlap(&reach, other));
            joined.extend(near);
            others = far;
        }
        others.is_empty()
    }

    fn confirm(&mut self, moving: &[bool], found: &[Found], at_s: f64) {
        let expected: Vec<_> = self.targets.iter().map(|one| one.expected(at_s)).collect();
        let mut pairs = Vec::new();
        for (number, one) in found.iter().enumerate() {
            for (index, expected) in expected.iter().enumerate() {
                let iou = iou(*expected, bounds(&one.oriented));
                if iou >= SAME_IOU {
                    pairs.push((iou, index, number));
                }
            }
        }
        pairs.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut is_used = vec![false; found.len()];
        let mut is_paired = vec![false; expected.len()];
        for (_, index, number) in pairs {
            if !is_paired[index] && !is_used[number] {
                is_paired[index] = true;
                is_used[number] = true;
                if moving[index] {
                    self.targets[index].confirm(found[number], at_s);
                }
            }
        }
        let states = moving.iter().zip(is_paired);
        for (target, (moves, is_paired)) in self.targets.iter_mut().zip(states) {
            target.is_seen = is_paired || !moves;
        }
        let others = found.iter().zip(is_used);
        let others = others.filter(|(other, is_used)| !is_used && other.logit >= NEW_LOGIT);
        self.targets
            .extend(others.map(|(other, _)| Target::new(*other, at_s)));
    }
}

impl Target {
    fn new(found: Found, at_s: f64) -> Self {
        Self {
            found,
            is_seen: true,
            velocity: Vector2::zeros(),
            at_s,
            trail: bounds(&found.oriented),
            searched: found,
            gain: None,
        }
    }

    fn velocity_to(&self, found: &Found, at_s: f64) -> Vector2<f64> {
        let seconds = at_s - self.at_s;
        if seconds <= 0.0 {
            return self.velocity;
        }
        let moved = found.oriented.center - self.found.oriented.center;
        (self.velocity + moved / seconds) / 2.0
    }

    fn expected(&self, at_s: f64) -> Bounds {
        let moved = self.velocity * (at_s - self.at_s);
        let [x_min, y_min, x_max, y_max] = bounds(&self.found.oriented);
        [
            x_min + moved.x,
            y_min + moved.y,
            x_max + moved.x,
            y_max + moved.y,
        ]
    }

    fn with_margin(&self, places: Bounds) -> Bounds {
        let [x_min, y_min, x_max, y_max] = bounds(&self.found.oriented);
        widened(places, MARGIN * (x_max - x_min).max(y_max - y_min))
    }

    fn confirm(&mut self, found: Found, at_s: f64) {
        let gain = (self.searched.logit - found.logit).clamp(-MAX_GAIN, MAX_GAIN);
        let logit = found.logit + *self.gain.get_or_insert(gain);
        let oriented = OrientedBox {
            width: self.searched.oriented.width,
            height: self.searched.oriented.height,
            ..found.oriented
        };
        let oriented = oriented.fitted_to(bounds(&found.oriented));
        self.velocity = self.velocity_to(&found, at_s);
        self.trail = hull(self.trail, bounds(&found.oriented));
        self.at_s = at_s;
        self.is_seen = true;
        self.found = Found { oriented, logit };
    }
}

fn hull(one: Bounds, other: Bounds) -> Bounds {
    let [x_min, y_min] = [0, 1].map(|at: usize| one[at].min(other[at]));
    let [x_max, y_max] = [2, 3].map(|at: usize| one[at].max(other[at]));
    [x_min, y_min, x_max, y_max]
}

fn widened([x_min, y_min, x_max, y_max]: Bounds, margin: f64) -> Bounds {
    [
        x_min - margin,
        y_min - margin,
        x_max + margin,
        y_max + margin,
    ]
}

fn overlap(one: &Bounds, other: &Bounds) -> bool {
    one[0] <= other[2] && other[0] <= one[2] && one[1] <= other[3] && other[1] <= one[3]
}

fn iou(one: Bounds, other: Bounds) -> f64 {
    let side = |at: usize| (one[at + 2].min(other[at + 2]) - one[at].max(other[at])).max(0.0);
    let area = |of: Bounds| (of[2] - of[0]) * (of[3] - of[1]);
    let both = side(0) * side(1);
    both / (area(one) + area(other) - both)
}
