//! The place of a camera on the floor of another, from the people who walk through both views.
//!
//! Two walks that overlap in time are taken for the same person, which gives a rotation and a shift
//! of the floor (least squares, S. Umeyama, "Least-squares estimation of transformation parameters
//! between two point patterns", IEEE TPAMI 13 (4), 1991, without scale). The pair whose rotation
//! and shift most other walks agree with wins, and is fitted again to all of these.

use nalgebra::{Rotation2, Vector2};

/// The interval at which walks are compared, seconds.
const STEP_S: f64 = 0.5;
/// A walk has no place between two points that are further apart than this, seconds.
const MAX_GAP_S: f64 = 2.0;
/// Common steps of two walks that may be the same person.
const LEAST_STEPS: usize = 6;
/// Common time of two walks that is compared, seconds.
const MAX_COMMON_S: f64 = 600.0;
/// Standard deviation of the places of a walk that tells a direction, meters: a person who stands
/// fits any rotation.
const LEAST_SPREAD_M: f64 = 0.5;
/// Mean distance of the places of one person from two cameras, meters.
const MAX_DISTANCE_M: f64 = 0.6;
/// Walks of a camera that are compared, the longest of them.
const MAX_WALKS: usize = 200;
/// Walks that must agree.
const LEAST_PAIRS: usize = 4;
/// Another pose that this share of the steps agrees with makes the result ambiguous.
const AMBIGUOUS: f64 = 0.5;
/// Poses that differ by less are the same: meters and degrees.
const SAME_POSE: (f64, f64) = (1.0, 20.0);
/// Fits to the walks that agree with the fit before.
const ROUNDS: usize = 5;
/// The largest difference of the floors' scales.
const MAX_SCALE_ERROR: f64 = 0.15;

/// The walk of a person over the floor of a camera: times in seconds, in order, and places in
/// meters.
pub type Walk = Vec<(f64, [f64; 2])>;

/// The place of a camera on the floor of another.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RelativePose {
    /// The floor point below the camera, meters of the other camera's floor.
    pub position_m: [f64; 2],
    /// Rotation of the camera's floor axes into those of the other, degrees, -180 to 180.
    pub yaw_deg: f64,
    /// Standard deviation of the position, meters (jackknife over the walks).
    pub position_sd_m: f64,
    /// Standard deviation of the rotation, degrees (jackknife over the walks).
    pub yaw_sd_deg: f64,
    /// Walks that both cameras saw.
    pub walks: usize,
    /// Root mean square of the distance between the places of one person, meters.
    pub residual_m: f64,
    /// Length on the other camera's floor of a meter on this camera's floor. It differs from 1 if a
    /// height is wrong.
    pub scale: f64,
}

/// Walks that tell no pose.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum NoPose {
    /// Too few walks of the same people.
    #[error(
        "{0} walks were seen by both cameras: at least {LEAST_PAIRS} are needed, by people who cross the floor that both see"
    )]
    TooFew(usize),
    /// Two poses fit.
    #[error(
        "two places of the camera fit the walks: let people walk on other ways, one after the other"
    )]
    Ambiguous,
    /// The floors have different scales.
    #[error(
        "a meter on the floor of the camera is {0:.2} m on that of the other: correct mount.height_m of one of them"
    )]
    Scale(f64),
}

/// The places of one person at common times, from both cameras.
struct Pair {
    first: Vec<Vector2<f64>>,
    second: Vec<Vector2<f64>>,
}

/// A rotation and a shift of the second floor onto the first one.
#[derive(Clone, Copy)]
struct Motion {
    rotation: Rotation2<f64>,
    shift: Vector2<f64>,
}

/// Returns the place of the second camera on the floor of the first one.
///
/// # Errors
/// [`NoPose`].
pub fn relative_pose(first: &[Walk], second: &[Walk]) -> Result<RelativePose, NoPose> {
    let (first, second) = (longest(first), longest(second));
    let pairs: Vec<Pair> = first
        .iter()
        .flat_map(|one| second.iter().filter_map(|other| Pair::new(one, other)))
        .collect();
    let mut poses: Vec<(Motion, usize)> = pairs
        .iter()
        .filter(|pair| pair.tells_direction())
        .filter_map(|pair| {
            let motion = Motion::fitted([pair].into_iter());
            (pair.distance(&motion) <= MAX_DISTANCE_M).then(|| (motion, support(&pairs, &motion)))
        })
        .collect();
    poses.sort_by_key(|(_, support)| std::cmp::Reverse(*support));
    let Some(&(best, most)) = poses.first() else {
        return Err(NoPose::TooFew(0));
    };
    #[expect(clippy::cast_precision_loss, reason = "far below 2^52 steps")]
    let is_rival = |support: usize| support as f64 >= AMBIGUOUS * most as f64;
    let (motion, agreeing) = refined(&pairs, best);
    if agreeing.len() < LEAST_PAIRS {
        return Err(NoPose::TooFew(agreeing.len()));
    }
    // A pose of one short walk is rough, and may be the same as the best one.
    let mut rivals = poses.iter().filter(|(_, support)| is_rival(*support));
    let is_another = |(rival, _): &(Motion, usize)| {
        !rival.is_near(&motion) && !refined(&pairs, *rival).0.is_near(&motion)
    };
    if rivals.any(is_another) {
        return Err(NoPose::Ambiguous);
    }
    let scale = scale(&agreeing);
    if (scale - 1.0).abs() > MAX_SCALE_ERROR {
        return Err(NoPose::Scale(scale));
    }
    let (position_sd_m, yaw_sd_deg) = deviations(&agreeing, &motion);
    let steps: usize = agreeing.iter().map(|pair| pair.first.len()).sum();
    let squares: f64 = agreeing.iter().map(|pair| pair.squares(&motion)).sum();
    #[expect(clippy::cast_precision_loss, reason = "far below 2^52 steps")]
    let residual_m = (squares / steps as f64).sqrt();
    Ok(RelativePose {
        position_m: motion.shift.into(),
        yaw_deg: motion.rotation.angle().to_degrees(),
        position_sd_m,
        yaw_sd_deg,
        walks: agreeing.len(),
        residual_m,
        scale,
    })
}

/// The walks with the most points.
fn longest(walks: &[Walk]) -> Vec<&Walk> {
    let mut walks: Vec<&Walk> = walks.iter().collect();
    walks.sort_by_key(|walk| std::cmp::Reverse(walk.len()));
    walks.truncate(MAX_WALKS);
    walks
}

/// The place at a time, between two points.
fn place_at(walk: &Walk, at_s: f64) -> Option<Vector2<f64>> {
    let after = walk.partition_point(|(time, _)| *time < at_s);
    let (from, to) = (walk.get(after.checked_sub(1)?)?, walk.get(after)?);
    let span = to.0 - from.0;
    let share = (at_s - from.0) / span;
    (span <= MAX_GAP_S).then(|| Vector2::from(from.1).lerp(&Vector2::from(to.1), share))
}

/// Steps of all pairs that agree with a motion.
fn support(pairs: &[Pair], motion: &Motion) -> usize {
    agreeing(pairs, motion)
        .iter()
        .map(|pair| pair.first.len())
        .sum()
}

fn agreeing<'a>(pairs: &'a [Pair], motion: &Motion) -> Vec<&'a Pair> {
    let near = pairs
        .iter()
        .filter(|pair| pair.distance(motion) <= MAX_DISTANCE_M);
    near.collect()
}

/// A pose that is fitted to the pairs that agree with it, and these.
fn refined(pairs: &[Pair], mut motion: Motion) -> (Motion, Vec<&Pair>) {
    let mut near = agreeing(pairs, &motion);
    for _ in 0..ROUNDS {
        if near.is_empty() {
            break;
        }
        motion = Motion::fitted(near.iter().copied());
        near = agreeing(pairs, &motion);
    }
    (motion, near)
}

/// The ratio of the spreads of the first and the second places.
fn scale(pairs: &[&Pair]) -> f64 {
    let spread = |side: fn(&Pair) -> &[Vector2<f64>]| -> f64 {
        pairs.iter().map(|pair| moment(side(pair))).sum()
    };
    (spread(|pair| &pair.first) / spread(|pair| &pair.second)).sqrt()
}

/// Standard deviations of the position in meters and of the rotation in degrees: the jackknife,
/// with one walk left out at a time.
fn deviations(pairs: &[&Pair], all: &Motion) -> (f64, f64) {
    let (mut shifts, mut angles) = (0.0, 0.0);
    for left_out in 0..pairs.len() {
        let others = pairs.iter().enumerate().filter(|(at, _)| *at != left_out);
        let motion = Motion::fitted(others.map(|(_, pair)| *pair));
        shifts += (motion.shift - all.shift).norm_squared();
        angles += all.rotation.angle_to(&motion.rotation).powi(2);
    }
    #[expect(clippy::cast_precision_loss, reason = "far below 2^52 walks")]
    let count = pairs.len() as f64;
    let factor = (count - 1.0) / count;
    (
        (factor * shifts).sqrt(),
        (factor * angles).sqrt().to_degrees(),
    )
}

/// The sum of the squared distances from the mean.
fn moment(places: &[Vector2<f64>]) -> f64 {
    let mean = mean(places.iter());
    places
        .iter()
        .map(|place| (place - mean).norm_squared())
        .sum()
}

fn mean<'a>(places: impl Iterator<Item = &'a Vector2<f64>>) -> Vector2<f64> {
    let (mut sum, mut count) = (Vector2::zeros(), 0.0);
    for place in places {
        sum += place;
        count += 1.0;
    }
    sum / count
}

impl Pair {
    /// The common steps of two walks, if there are enough.
    fn new(first: &Walk, second: &Walk) -> Option<Self> {
        let begin = first.first()?.0.max(second.first()?.0);
        let end = first.last()?.0.min(second.last()?.0);
        let end = end.min(begin + MAX_COMMON_S);
        let mut pair = Self {
            first: Vec::new(),
            second: Vec::new(),
        };
        let mut at_s = (begin / STEP_S).ceil() * STEP_S;
        while at_s <= end {
            if let (Some(one), Some(other)) = (place_at(first, at_s), place_at(second, at_s)) {
                pair.first.push(one);
                pair.second.push(other);
            }
            at_s += STEP_S;
        }
        (pair.first.len() >= LEAST_STEPS).then_some(pair)
    }

    fn tells_direction(&self) -> bool {
        #[expect(clippy::cast_precision_loss, reason = "far below 2^52 steps")]
        let count = self.first.len() as f64;
        let spread = moment(&self.first).min(moment(&self.second)) / count;
        spread >= LEAST_SPREAD_M * LEAST_SPREAD_M
    }

    /// The sum of the squared distances.
    fn squares(&self, motion: &Motion) -> f64 {
        let both = self.first.iter().zip(&self.second);
        both.map(|(one, other)| (motion.moved(other) - one).norm_squared())
            .sum()
    }

    /// The root mean square of the distances, meters.
    fn distance(&self, motion: &Motion) -> f64 {
        #[expect(clippy::cast_precision_loss, reason = "far below 2^52 steps")]
        let count = self.first.len() as f64;
        (self.squares(motion) / count).sqrt()
    }
}

impl Motion {
    /// The motion of the second places onto the first ones with the least squares.
    fn fitted<'a>(pairs: impl Iterator<Item = &'a Pair> + Clone) -> Self {
        let (to, from) = (
            mean(pairs.clone().flat_map(|pair| &pair.first)),
            mean(pairs.clone().flat_map(|pair| &pair.second)),
        );
        let (mut dot, mut cross) = (0.0, 0.0);
        for (one, other) in pairs.flat_map(|pair| pair.first.iter().zip(&pair.second)) {
            let (one, other) = (one - to, other - from);
            dot += other.dot(&one);
            cross += other.perp(&one);
        }
        let rotation = Rotation2::new(cross.atan2(dot));
        Self {
            rotation,
            shift: to - rotation * from,
        }
    }

    fn moved(&self, place: &Vector2<f64>) -> Vector2<f64> {
        self.rotation * place + self.shift
    }

    fn is_near(&self, other: &Self) -> bool {
        let (meters, degrees) = SAME_POSE;
        let angle = self.rotation.angle_to(&other.rotation).to_degrees();
        (self.shift - other.shift).norm() < meters && angle.abs() < degrees
    }
}

#[cfg(test)]
mod tests;
