//! Lines that count crossings in two directions.
//!
//! A crossing is pending while its track is within the hysteresis band around the line, and counts
//! once the track is beyond the band. A track that returns within the band cancels it, so that a
//! person who hesitates on the line is never counted twice.

use std::collections::BTreeMap;

use lookdown_lens::geometry::polygon;
use nalgebra::{Point2, Vector2};
use serde::{Deserialize, Serialize};

use crate::{Plane, TailPoint, Track, TrackId};

/// The direction of a crossing.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Direction {
    /// To the right-hand side of a walk from the line's first point to its last, seen as on the
    /// screen (x right, y down).
    In,
    /// To the left-hand side.
    Out,
}

/// A line of one or more segments.
#[derive(Clone, Debug, PartialEq)]
pub struct Line {
    /// The name, unique within its counter.
    pub name: String,
    /// The plane of the points.
    pub plane: Plane,
    /// The points in order, at least 2.
    pub points: Vec<[f64; 2]>,
    /// Half the width of the hysteresis band, in the unit of the plane: meters or pixels.
    pub band: f64,
}

/// Half the width of the hysteresis band for lines on the floor, meters, where none is set.
pub const DEFAULT_BAND_M: f64 = 0.3;

/// A counted crossing.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Crossing {
    /// Index of the line.
    pub line: usize,
    /// Direction of the crossing.
    pub direction: Direction,
    /// Track of the person.
    pub track: TrackId,
    /// Time at which the person was beyond the band, seconds since the Unix epoch.
    pub at_s: f64,
}

/// The lines over the tracks of one tracker.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LineCounter {
    /// The lines.
    pub lines: Vec<Line>,
    /// The state to be stored with that of the tracker.
    pub state: LineState,
}

/// The part of a counter that must survive a restart together with the tracker.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LineState {
    /// The state of each track at each line.
    tracks: BTreeMap<TrackId, Vec<Approach>>,
}

/// A track and a line.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
struct Approach {
    /// Last place and its time.
    last: Option<([f64; 2], f64)>,
    /// True once the track was beyond the band.
    is_settled: bool,
    /// Crossings since then: those to the right minus those to the left.
    pending: i32,
}

impl LineCounter {
    /// Returns a counter of the lines that `state` was kept for; with an empty one, a new counter.
    pub fn new(lines: Vec<Line>, mut state: LineState) -> Self {
        state
            .tracks
            .retain(|_, approaches| approaches.len() == lines.len());
        Self { lines, state }
    }

    /// Returns the crossings since the last call. `tracks` are all confirmed tracks of the tracker,
    /// after each of its updates.
    pub fn update<'a>(&mut self, tracks: impl IntoIterator<Item = &'a Track>) -> Vec<Crossing> {
        let mut crossings = Vec::new();
        let mut states = BTreeMap::new();
        for track in tracks {
            let known = self.state.tracks.remove(&track.id);
            let mut approaches =
                known.unwrap_or_else(|| vec![Approach::default(); self.lines.len()]);
            for (index, (line, approach)) in self.lines.iter().zip(&mut approaches).enumerate() {
                for (direction, at_s) in approach.advance(line, track.tail()) {
                    crossings.push(Crossing {
                        line: index,
                        direction,
                        track: track.id,
                        at_s,
                    });
                }
            }
            states.insert(track.id, approaches);
        }
        self.state.tracks = states;
        crossings
    }
}

impl Approach {
    /// Follows the new points of a track and returns the crossings that now count.
    fn advance<'a>(
        &mut self,
        line: &Line,
        tail: impl Iterator<Item = &'a TailPoint>,
    ) -> Vec<(Direction, f64)> {
        let mut counted = Vec::new();
        for point in tail {
            let is_known = self.last.is_some_and(|(_, at_s)| point.at_s <= at_s);
            let Some(place) = point.place(line.plane).filter(|_| !is_known) else {
                continue;
            };
            if let Some((last, _)) = self.last {
                self.pending += signed_crossings(&line.points, last, place);
            }
            self.last = Some((place, point.at_s));
            if distance(&line.points, place) < line.band {
                continue;
            }
            if self.is_settled {
                let direction = if self.pending > 0 {
                    Direction::In
                } else {
                    Direction::Out
                };
                let count = self.pending.unsigned_abs() as usize;
                counted.extend(std::iter::repeat_n((direction, point.at_s), count));
            }
            self.is_settled = true;
            self.pending = 0;
        }
        counted
    }
}

/// Returns the crossings of the step `from` – `to` through the polyline to the right-hand side of a
/// walk along it (x right, y down), minus those to the left.
///
/// A point exactly on a line counts as on its left, and so does a corner exactly on the step's
/// line: a step through a corner crosses one of the two segments that meet there, never both or
/// none.
fn signed_crossings(points: &[[f64; 2]], from: [f64; 2], to: [f64; 2]) -> i32 {
    let segments = points.windows(2).map(|pair| (pair[0], pair[1]));
    segments
        .map(|(start, end)| {
            let was_right = is_right(start, end, from);
            let is_now_right = is_right(start, end, to);
            let is_within = is_right(from, to, start) != is_right(from, to, end);
            match (is_within, was_right, is_now_right) {
                (true, false, true) => 1,
                (true, true, false) => -1,
                _ => 0,
            }
        })
        .sum()
}

/// Returns true when `point` lies to the right of a walk from `start` to `end`.
fn is_right(start: [f64; 2], end: [f64; 2], point: [f64; 2]) -> bool {
    let [start, end, point] = [start, end, point].map(Vector2::from);
    (end - start).perp(&(point - start)) > 0.0
}

/// Returns the distance of a point from the polyline, its ends included.
fn distance(points: &[[f64; 2]], point: [f64; 2]) -> f64 {
    let edges = points
        .windows(2)
        .map(|pair| [pair[0], pair[1]].map(Point2::from));
    let distances = edges.map(|edge| polygon::distance(edge, point.into()));
    distances.fold(f64::INFINITY, f64::min)
}

#[cfg(test)]
mod tests;
