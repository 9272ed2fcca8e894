//! FRIDA: three synchronous cameras over one room, as one site.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use anyhow::{Context, Result};
use lookdown_tracking::{CameraPose, Plane, Tracker, TrackerSettings, Walk, relative_pose};
use nalgebra::{Rotation2, Vector2};
use serde_json::json;

use crate::{
    Number, Row, continued, counting,
    data::{Frame, Segment, Sequence},
    persons,
    scores::Sums,
    step_of,
    view::{View, overlap},
};

/// Places farther away than this do not count for the poses, in heights of the camera.
const REACH: f64 = 2.5;
/// Distance at which a pair of places has half its weight, meters.
const HALF_WEIGHT_M: f64 = 0.3;
const ROUNDS: usize = 20;

/// The cameras of all segments.
pub struct Site {
    views: Vec<View>,
    poses: Vec<CameraPose>,
}

impl Site {
    /// Returns the site with the poses that the identities give: a robust fit to the places of all
    /// people whom two cameras see.
    pub fn new(segments: &[Segment]) -> Result<Self> {
        let cameras = segments.first().map_or(0, |segment| segment.cameras.len());
        let mut views = Vec::new();
        for camera in 0..cameras {
            let own = segments.iter().map(|segment| &segment.cameras[camera]);
            let frames = own.flat_map(|sequence| &sequence.frames);
            views.push(View::new(&segments[0].cameras[camera].circle, frames)?);
        }
        let poses = (0..cameras)
            .map(|camera| pose(segments, &views, camera))
            .collect();
        Ok(Self { views, poses })
    }

    /// Follows the people of all cameras in one tracker.
    pub fn follow(&self, segment: &Segment, settings: &TrackerSettings) -> Result<Row> {
        let frames_per_s = segment.cameras[0].circle.frames_per_s;
        let mut tracker = Tracker::new(&self.poses, *settings)?;
        let (mut steps, mut number) = (Vec::new(), Number::default());
        for (at_s, frames) in moments(segment) {
            let mut people = BTreeSet::new();
            for (camera, frame) in frames {
                let (boxes, persons) = persons(&self.views[camera], frame);
                tracker.update(f64::INFINITY, camera, at_s, &persons)?;
                let tracks = continued(&tracker, camera, at_s, &boxes)?;
                steps.push(step_of(frame, &tracks));
                people.extend(frame.truth.iter().map(|(_, id)| *id));
            }
            number.add(people.len(), counting(&tracker));
        }
        Ok(Row {
            set: "frida",
            name: segment.name.clone(),
            rate: json!("own"),
            sums: Sums::new(&steps),
            number,
            frames_per_s,
            crossings: [0; 3],
            halves: Vec::new(),
        })
    }

    /// Prints what the walks of each two cameras tell about their places, and its errors.
    pub fn print_places(&self, segments: &[Segment], settings: &TrackerSettings) -> Result<()> {
        for segment in segments {
            let walks = (0..self.views.len()).map(|camera| self.walks(segment, camera, settings));
            let walks = walks.collect::<Result<Vec<_>>>()?;
            for first in 0..walks.len() {
                for second in (0..walks.len()).filter(|second| *second != first) {
                    let pair = format!(
                        "{}: {} on the floor of {}",
                        segment.name,
                        second + 1,
                        first + 1
                    );
                    match relative_pose(&walks[first], &walks[second]) {
                        Err(reason) => println!("{pair}: {reason}"),
                        Ok(found) => {
                            let truth = self.relative(first, second);
                            let error =
                                Vector2::from(found.position_m) - Vector2::from(truth.position_m);
                            let turn =
                                (found.yaw_deg - truth.yaw_deg + 180.0).rem_euclid(360.0) - 180.0;
                            println!(
                                "{pair}: {:.2} m, {turn:+.1}° off; deviations {:.2} m, {:.1}°; {} walks, {:.2} m",
                                error.norm(),
                                found.position_sd_m,
                                found.yaw_sd_deg,
                                found.walks,
                                found.residual_m,
                            );
                        }
                    }
                }
            }
        }
        Ok(())
    }

    fn walks(
        &self,
        segment: &Segment,
        camera: usize,
        settings: &TrackerSettings,
    ) -> Result<Vec<Walk>> {
        let view = &self.views[camera];
        let sequence = &segment.cameras[camera];
        let mut tracker = Tracker::new(&[CameraPose::alone(Some(view.height_m))], *settings)?;
        let mut walks: BTreeMap<_, Walk> = BTreeMap::new();
        for frame in &sequence.frames {
            let at_s = f64::from(frame.number) / sequence.circle.frames_per_s;
            tracker.update(f64::INFINITY, 0, at_s, &persons(view, frame).1)?;
            for track in tracker
                .tracks()
                .filter(|track| track.counts() && track.seen_s == at_s)
            {
                let place = track.place(Plane::FloorM).context("a place on the floor")?;
                walks.entry(track.id).or_default().push((at_s, place));
            }
        }
        Ok(walks.into_values().collect())
    }

    /// The pose of the second camera on the floor of the first one.
    fn relative(&self, first: usize, second: usize) -> CameraPose {
        let [one, other] = [self.poses[first], self.poses[second]];
        CameraPose {
            position_m: one.from_site(other.position_m),
            yaw_deg: other.yaw_deg - one.yaw_deg,
            height_m: other.height_m,
        }
    }
}

/// The frames of all cameras at one time.
fn moments(segment: &Segment) -> impl Iterator<Item = (f64, Vec<(usize, &Frame)>)> {
    let mut moments: BTreeMap<u32, Vec<(usize, &Frame)>> = BTreeMap::new();
    for (camera, sequence) in segment.cameras.iter().enumerate() {
        for frame in &sequence.frames {
            moments
                .entry(frame.number)
                .or_default()
                .push((camera, frame));
        }
    }
    let frames_per_s = segment.cameras[0].circle.frames_per_s;
    moments
        .into_iter()
        .map(move |(number, frames)| (f64::from(number) / frames_per_s, frames))
}

/// The pose of a camera on the floor of the first one, by the identities.
fn pose(segments: &[Segment], views: &[View], camera: usize) -> CameraPose {
    let mut pairs: Vec<[Vector2<f64>; 2]> = Vec::new();
    for (_, frames) in segments.iter().flat_map(moments) {
        let of = |camera: usize| {
            let mut places = HashMap::new();
            for (_, frame) in frames.iter().filter(|(number, _)| *number == camera) {
                for (rectangle, id) in &frame.truth {
                    let seen = views[camera].observation(rectangle, 1.0);
                    let place =
                        Vector2::from(seen.and_then(|seen| seen.floor_m).unwrap_or([f64::MAX; 2]));
                    if place.norm() < REACH * views[camera].height_m {
                        places.insert(*id, place);
                    }
                }
            }
            places
        };
        let (first, own) = (of(0), of(camera));
        let both = own
            .into_iter()
            .filter_map(|(id, place)| Some([*first.get(&id)?, place]));
        pairs.extend(both);
    }
    let mut weights = vec![1.0; pairs.len()];
    let (mut rotation, mut shift) = (Rotation2::identity(), Vector2::zeros());
    for _ in 0..ROUNDS {
        let total: f64 = weights.iter().sum();
        let weighted = || pairs.iter().zip(&weights);
        let mean = |side: usize| {
            weighted()
                .map(|(pair, weight)| pair[side] * *weight)
                .sum::<Vector2<f64>>()
                / total
        };
        let (to, from) = (mean(0), mean(1));
        let (mut dot, mut cross) = (0.0, 0.0);
        for ([one, other], weight) in weighted() {
            dot += weight * (other - from).dot(&(one - to));
            cross += weight * (other - from).perp(&(one - to));
        }
        rotation = Rotation2::new(cross.atan2(dot));
        shift = to - rotation * from;
        let distance = |[one, other]: &[Vector2<f64>; 2]| (rotation * other + shift - one).norm();
        weights = pairs
            .iter()
            .map(|pair| 1.0 / (1.0 + (distance(pair) / HALF_WEIGHT_M).powi(2)))
            .collect();
    }
    CameraPose {
        position_m: shift.into(),
        yaw_deg: rotation.angle().to_degrees(),
        height_m: Some(views[camera].height_m),
    }
}

/// Errors of a detector: of the center and the size as shares of the box, the share of boxes that
/// are missed, and the most frames in a row.
const CENTER: f64 = 0.05;
const SIZE: f64 = 0.08;
const MISSED: f64 = 0.1;
const LONGEST_MISS: f64 = 20.0;
/// Least overlap of a right detection.
const RIGHT: f64 = 0.5;

/// Gives the boxes the errors of a detector. Scores are those of right detections.
pub fn add_errors(segments: &mut [Segment], detected: &[Sequence]) {
    let mut scores = Vec::new();
    for frame in detected
        .iter()
        .flat_map(|sequence| sequence.frames.iter().step_by(10))
    {
        let truth = |found| {
            frame
                .truth
                .iter()
                .any(|(one, _)| overlap(one, found) >= RIGHT)
        };
        let right = frame.found.iter().filter(|(found, _)| truth(found));
        scores.extend(right.map(|(_, score)| *score));
    }
    let mut chance = Chance(58);
    // Runs of this mean length, each after a time that gives the share.
    let run = f64::midpoint(1.0, LONGEST_MISS);
    let begins = MISSED / (1.0 - MISSED) / run;
    for sequence in segments.iter_mut().flat_map(|segment| &mut segment.cameras) {
        let mut left: HashMap<i64, f64> = HashMap::new();
        for frame in &mut sequence.frames {
            frame.found.clear();
            for (rectangle, id) in &frame.truth {
                let missed = left.entry(*id).or_default();
                if *missed < 1.0 && chance.uniform() < begins {
                    *missed = 1.0 + (LONGEST_MISS * chance.uniform()).floor();
                }
                if *missed >= 1.0 {
                    *missed -= 1.0;
                    continue;
                }
                let [x, y, width, height, angle] = *rectangle;
                let away = Vector2::new(
                    width * CENTER * chance.normal(),
                    height * CENTER * chance.normal(),
                );
                let away = Rotation2::new(angle.to_radians()) * away;
                let [width, height] =
                    [width, height].map(|size| size * (1.0 + SIZE * chance.normal()));
                #[expect(
                    clippy::cast_possible_truncation,
                    clippy::cast_sign_loss,
                    reason = "an index"
                )]
                let score = scores[(chance.uniform() * scores.len() as f64) as usize];
                frame
                    .found
                    .push(([x + away.x, y + away.y, width, height, angle], score));
            }
        }
    }
}

/// A linear congruential generator (Knuth, MMIX): the same errors on all machines.
struct Chance(u64);

impl Chance {
    /// From 0 to 1.
    fn uniform(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as f64 / (1_u64 << 31) as f64
    }

    /// A standard normal number, nearly: the sum of twelve uniform ones.
    fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.uniform()).sum::<f64>() - 6.0
    }
}
