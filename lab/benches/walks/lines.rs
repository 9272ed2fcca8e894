//! Crossings of lines through the busiest places of a sequence.

use crate::data::Rectangle;
use crate::{data::Sequence, view::View};
use lookdown_tracking::{
    Plane,
    lines::{Direction, Line},
    taught::ReferenceCrossings,
};
use std::collections::BTreeMap;

/// Shares of the radius of the circle: half the band of a line, half its length, the least
/// distance of two lines, the least step of a person who walks, and the part with lines.
const BAND: f64 = 0.05;
const HALF_LENGTH: f64 = 0.22;
const APART: f64 = 0.25;
const STEP: f64 = 0.01;
const INNER: f64 = 0.75;
/// Lines that are tried, and those that are used.
const TRIED: usize = 60;
const USED: usize = 3;
/// A crossing is right within this time, seconds, and at least within these frames.
const NEAR_S: f64 = 2.0;
const NEAR_FRAMES: f64 = 3.0;

/// A crossing: the number of the line, 1 or -1 for its direction, and the time.
pub type Event = (usize, i32, f64);

type Walks = BTreeMap<i64, Vec<(f64, [f64; 2])>>;

/// The lines of a sequence and their true crossings.
pub struct Crossings {
    pub lines: Vec<Line>,
    pub truth: Vec<Event>,
}

impl Crossings {
    pub fn new(sequence: &Sequence, view: &View) -> Self {
        let circle = &sequence.circle;
        let mut walks = Walks::new();
        for frame in &sequence.frames {
            let at_s = f64::from(frame.number) / circle.frames_per_s;
            for (rectangle, id) in &frame.truth {
                walks
                    .entry(*id)
                    .or_default()
                    .push((at_s, place(view, rectangle)));
            }
        }
        let distance = |one: [f64; 2], other: [f64; 2]| {
            (one[0] - other[0]).hypot(one[1] - other[1]) / circle.radius
        };
        let steps = walks.values().flat_map(|walk| walk.windows(2));
        let moved = steps.filter(|pair| distance(pair[0].1, pair[1].1) > STEP);
        let busy: Vec<[f64; 2]> = moved
            .map(|pair| pair[0].1)
            .filter(|place| distance(*place, circle.center) < INNER)
            .collect();
        let mut tried: Vec<([f64; 2], Line, usize)> = Vec::new();
        for number in 0..TRIED.min(busy.len()) {
            // Evenly over the steps, with directions by the golden angle.
            let middle = busy[(2 * number + 1) * busy.len() / (2 * TRIED.min(busy.len()))];
            let (sin, cos) = (number as f64 * 2.399_963).sin_cos();
            let half = [cos, sin].map(|part| part * HALF_LENGTH * circle.radius);
            let ends = [-1.0, 1.0].map(|sign| [0, 1].map(|axis| middle[axis] + sign * half[axis]));
            let line = Line {
                name: number.to_string(),
                plane: Plane::FramePx,
                points: ends.to_vec(),
                band: BAND * circle.radius,
            };
            let count = walks
                .values()
                .map(|walk| crossings(&line, walk).len())
                .sum();
            tried.push((middle, line, count));
        }
        tried.sort_by_key(|(_, _, count)| std::cmp::Reverse(*count));
        let mut middles: Vec<[f64; 2]> = Vec::new();
        let mut lines = Vec::new();
        for (middle, line, count) in tried {
            if count > 0
                && lines.len() < USED
                && middles.iter().all(|other| distance(*other, middle) > APART)
            {
                middles.push(middle);
                lines.push(line);
            }
        }
        let mut truth = Vec::new();
        for (number, line) in lines.iter().enumerate() {
            for walk in walks.values() {
                let crossed = crossings(line, walk).into_iter();
                truth.extend(crossed.map(|(sign, at_s)| (number, sign, at_s)));
            }
        }
        Self { lines, truth }
    }

    /// Returns the crossings of both halves of the time for each line.
    pub fn halves(&self, counted: &[Event], middle_s: f64) -> Vec<[ReferenceCrossings; 2]> {
        let of = |line: usize, is_later: bool| {
            let within = |event: &&Event| event.0 == line && (event.2 >= middle_s) == is_later;
            ReferenceCrossings {
                given: self.truth.iter().filter(within).count() as u64,
                counted: counted.iter().filter(within).count() as u64,
            }
        };
        (0..self.lines.len())
            .map(|line| [of(line, false), of(line, true)])
            .collect()
    }

    /// Returns how many of the counted crossings are right, each by another true one.
    pub fn matched(&self, counted: &[Event], frames_per_s: f64) -> usize {
        let near_s = NEAR_S.max(NEAR_FRAMES / frames_per_s);
        let mut left = counted.to_vec();
        let mut matched = 0;
        for (line, sign, at_s) in &self.truth {
            let near = left
                .iter()
                .enumerate()
                .filter(|(_, (other_line, other_sign, other_s))| {
                    (other_line, other_sign) == (line, sign) && (other_s - at_s).abs() <= near_s
                });
            let nearest =
                near.min_by(|(_, a), (_, b)| (a.2 - at_s).abs().total_cmp(&(b.2 - at_s).abs()));
            if let Some((at, _)) = nearest {
                left.swap_remove(at);
                matched += 1;
            }
        }
        matched
    }
}

/// Returns 1 for a crossing to the right of a line, else -1.
pub fn sign(direction: Direction) -> i32 {
    if direction == Direction::In { 1 } else { -1 }
}

fn place(view: &View, rectangle: &Rectangle) -> [f64; 2] {
    view.foot(rectangle)
}

/// Twice the area of the triangle of the line and a place: positive to the right as on the screen.
fn side(ends: &[[f64; 2]], place: [f64; 2]) -> f64 {
    let [from, to] = [ends[0], ends[1]];
    (to[0] - from[0]) * (place[1] - from[1]) - (to[1] - from[1]) * (place[0] - from[0])
}

fn distance(ends: &[[f64; 2]], place: [f64; 2]) -> f64 {
    let [from, to] = [ends[0], ends[1]];
    let way = [to[0] - from[0], to[1] - from[1]];
    let away = [place[0] - from[0], place[1] - from[1]];
    let share = (away[0] * way[0] + away[1] * way[1]) / (way[0].powi(2) + way[1].powi(2));
    let share = share.clamp(0.0, 1.0);
    (away[0] - share * way[0]).hypot(away[1] - share * way[1])
}

/// The crossings of a true walk, by the rule of the product: beyond the band on both sides.
fn crossings(line: &Line, walk: &[(f64, [f64; 2])]) -> Vec<(i32, f64)> {
    let mut counted = Vec::new();
    let (mut last, mut pending, mut settled) = (None, 0, false);
    for &(at_s, place) in walk {
        if let Some(last) = last {
            pending += crossed(&line.points, last, place);
        }
        last = Some(place);
        if distance(&line.points, place) < line.band {
            continue;
        }
        if settled {
            for _ in 0..pending.abs() {
                counted.push((pending.signum(), at_s));
            }
        }
        (settled, pending) = (true, 0);
    }
    counted
}

fn crossed(ends: &[[f64; 2]], from: [f64; 2], to: [f64; 2]) -> i32 {
    let is_right = side(ends, to) >= 0.0;
    let step = [from, to];
    let changes = (side(ends, from) >= 0.0) != is_right;
    let is_beside = (side(&step, ends[0]) >= 0.0) == (side(&step, ends[1]) >= 0.0);
    match (changes && !is_beside, is_right) {
        (false, _) => 0,
        (true, true) => 1,
        (true, false) => -1,
    }
}
