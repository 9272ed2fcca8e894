//! The place of a camera on the floor of another, from the people who walk through both views.
//!
//! Two walks in the same seconds are taken for one person, which gives a rotation and a shift of
//! the floor (least squares, S. Umeyama, "Least-squares estimation of transformation parameters
//! between two point patterns", IEEE TPAMI 13 (4), 1991, without scale). Each of these poses is
//! scored by all walks, and the best one is fitted again to the pairs that agree.
//!
//! A camera places a person who sits, leans or is half hidden wrongly for as long as that lasts,
//! the more the farther away. So the mean place of some seconds has this lasting error, and the
//! movement around it a smaller one. Both cameras count alike: exchanged cameras give the inverse.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{Matrix2x3, Matrix3, Rotation2, Vector2};

/// The interval at which walks are compared, seconds.
const STEP_S: f64 = 0.5;
/// A walk has no place between two points that are further apart than this, seconds.
const MAX_GAP_S: f64 = 2.0;
/// Steps in which the error of a place is taken as lasting: 20 s.
const WINDOW_STEPS: i64 = 40;
/// Common steps of two walks that may be the same person.
const LEAST_STEPS: usize = 6;
/// Pairs that are compared, those of evenly chosen windows: 25 minutes of 15 people.
const MAX_PAIRS: usize = 30_000;
/// Poses that are scored, those with the longest ways near the cameras, and those that are fitted.
const MAX_POSES: usize = 500;
const MAX_FITTED: usize = 40;
/// Standard deviation of the places of a pair that tells a direction, meters: a person who stands
/// fits any rotation.
const LEAST_SPREAD_M: f64 = 0.5;
/// Lasting error of a place: meters, and degrees off the axis of a camera at the usual height, as
/// for the tracker ([`MeasurementNoise`](crate::MeasurementNoise)).
const BIAS_M: f64 = 0.2;
const BIAS_DEG: f64 = 3.0;
const USUAL_HEIGHT_M: f64 = 2.7;
/// Beyond this variance of the lasting errors a pair proposes no pose, square meters.
const MAX_VARIANCE_M2: f64 = 3.0;
/// Variance of the movement within a window: square meters, and as a share of that of the bias.
const MOVEMENT_M2: f64 = 0.02;
const MOVEMENT_SHARE: f64 = 0.1;
/// Independent places of a movement in a window.
const INDEPENDENT: f64 = 4.0;
/// Density of people: other people near a place, number per square meter.
const DENSITY: f64 = 0.15;
/// People whom both cameras saw.
const LEAST_PAIRS: usize = 4;
/// Least mean gain of the pairs. On FRIDA's crowd the true poses have 2.1 to 4.1. With the walks of
/// one camera mirrored or delayed, the best pose has .6 to 2.6, and the second is as good.
const LEAST_GAIN: f64 = 1.8;
/// Another pose with this share of the gain makes the result ambiguous.
const AMBIGUOUS: f64 = 0.7;
/// Poses between which the people differ by less (root mean square) are the same, meters.
const SAME_POSE_M: f64 = 1.5;
/// Fits to the pairs that agree with the fit before.
const ROUNDS: usize = 6;
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
    /// Standard deviation of the position, meters: of the people (jackknife), and of their lasting
    /// errors.
    pub position_sd_m: f64,
    /// Standard deviation of the rotation, degrees, likewise.
    pub yaw_sd_deg: f64,
    /// Pairs of walks of the same person.
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
        "more than one place of the camera fits the walks: let people walk on other ways, one after the other"
    )]
    Ambiguous,
    /// The floors have different scales.
    #[error(
        "a meter on the floor of the camera is {0:.2} m on that of the other: correct mount.height_m of one of them"
    )]
    Scale(f64),
}

/// Two walks in one window of time: statistics of their common steps.
struct Pair {
    window: i64,
    walks: [usize; 2],
    steps: f64,
    means: [Vector2<f64>; 2],
    /// Mean squared distances from the means.
    moments: [f64; 2],
    /// Mean products of the offsets of the second walk and the first one.
    dot: f64,
    cross: f64,
    /// Variance of the lasting errors of both cameras, square meters.
    variance: f64,
}

/// A rotation and a shift of the second floor onto the first one.
#[derive(Clone, Copy)]
struct Motion {
    rotation: Rotation2<f64>,
    shift: Vector2<f64>,
}

/// A motion, the pairs that agree with it, and the sum of their gains.
struct Fit<'a> {
    motion: Motion,
    pairs: Vec<&'a Pair>,
    gain: f64,
}

/// Returns the place of the second camera on the floor of the first one.
///
/// # Errors
/// [`NoPose`].
pub fn relative_pose(first: &[Walk], second: &[Walk]) -> Result<RelativePose, NoPose> {
    let pairs = pairs(first, second);
    let mut proposals: Vec<(f64, Motion)> = pairs.iter().filter_map(Pair::proposal).collect();
    proposals.sort_by(|(a, _), (b, _)| b.total_cmp(a));
    proposals.truncate(MAX_POSES);
    for (value, motion) in &mut proposals {
        *value = pairs.iter().map(|pair| pair.gain(motion).max(0.0)).sum();
    }
    proposals.sort_by(|(a, _), (b, _)| b.total_cmp(a));
    let proposals = proposals.into_iter().take(MAX_FITTED);
    let mut fits: Vec<Fit> = proposals
        .map(|(_, motion)| Fit::refined(&pairs, motion))
        .collect();
    fits.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    let best = fits.first().ok_or(NoPose::TooFew(0))?;
    let people = best.people();
    if people.len() < LEAST_PAIRS {
        return Err(NoPose::TooFew(people.len()));
    }
    let is_rival = |fit: &Fit| fit.gain >= AMBIGUOUS * best.gain && best.differs_from(&fit.motion);
    if best.gain < LEAST_GAIN * count(&best.pairs) || fits.iter().any(is_rival) {
        return Err(NoPose::Ambiguous);
    }
    let scale = best.scale();
    if scale.ln().abs() > MAX_SCALE_ERROR.ln_1p() {
        return Err(NoPose::Scale(scale));
    }
    let (position_sd_m, yaw_sd_deg) = best.deviations(&people);
    let steps: f64 = best.pairs.iter().map(|pair| pair.steps).sum();
    let distance = |pair: &&Pair| {
        pair.steps * (pair.offset(&best.motion).norm_squared() + pair.movement(&best.motion))
    };
    let squares: f64 = best.pairs.iter().map(distance).sum();
    Ok(RelativePose {
        position_m: best.motion.shift.into(),
        yaw_deg: best.motion.rotation.angle().to_degrees(),
        position_sd_m,
        yaw_sd_deg,
        walks: people.len(),
        residual_m: (squares / steps).sqrt(),
        scale,
    })
}

/// The places of a walk by window: steps and places.
type Windows = BTreeMap<i64, Vec<(usize, BTreeMap<i64, Vector2<f64>>)>>;

/// All pairs of walks in the same window, of evenly chosen windows.
fn pairs(first: &[Walk], second: &[Walk]) -> Vec<Pair> {
    let (first, second) = (windows(first), windows(second));
    let common: Vec<_> = first
        .iter()
        .filter_map(|(window, walks)| Some((*window, walks, second.get(window)?)))
        .collect();
    let count: usize = common
        .iter()
        .map(|(_, one, other)| one.len() * other.len())
        .sum();
    let mut pairs = Vec::new();
    for (window, one, other) in common.iter().step_by(count / MAX_PAIRS + 1) {
        for (at, walk) in *one {
            let further = other.iter().filter_map(|(other_at, other)| {
                Pair::new(*window, [*at, *other_at], [walk, other])
            });
            pairs.extend(further.take(MAX_PAIRS.saturating_sub(pairs.len())));
        }
    }
    pairs
}

#[expect(clippy::cast_possible_truncation, reason = "steps of half a second")]
fn windows(walks: &[Walk]) -> Windows {
    let mut windows = Windows::new();
    for (at, walk) in walks.iter().enumerate() {
        let [Some((begin, _)), Some((end, _))] = [walk.first(), walk.last()] else {
            continue;
        };
        for step in (begin / STEP_S).ceil() as i64..=(end / STEP_S).floor() as i64 {
            let Some(place) = place_at(walk, step as f64 * STEP_S) else {
                continue;
            };
            let window = windows.entry(step.div_euclid(WINDOW_STEPS)).or_default();
            if window.last().is_none_or(|(last, _)| *last != at) {
                window.push((at, BTreeMap::new()));
            }
            if let Some((_, places)) = window.last_mut() {
                places.insert(step, place);
            }
        }
    }
    windows
}

/// The place at a time, between two points.
fn place_at(walk: &Walk, at_s: f64) -> Option<Vector2<f64>> {
    let after = walk.partition_point(|(time, _)| *time < at_s);
    let (from, to) = (walk.get(after.checked_sub(1)?)?, walk.get(after)?);
    let span = to.0 - from.0;
    let share = (at_s - from.0) / span;
    (span <= MAX_GAP_S).then(|| Vector2::from(from.1).lerp(&Vector2::from(to.1), share))
}

/// The variance of the lasting error of a place at this distance from its camera, square meters.
fn bias(range_m: f64) -> f64 {
    let slant_squared = range_m.powi(2) + USUAL_HEIGHT_M.powi(2);
    BIAS_M.powi(2) + (BIAS_DEG.to_radians() * slant_squared / USUAL_HEIGHT_M).powi(2)
}

fn count<T>(values: &[T]) -> f64 {
    values.len() as f64
}

impl Pair {
    /// The common steps of two walks, if there are enough.
    fn new(
        window: i64,
        walks: [usize; 2],
        places: [&BTreeMap<i64, Vector2<f64>>; 2],
    ) -> Option<Self> {
        let both = places[0]
            .iter()
            .filter_map(|(step, place)| Some([*place, *places[1].get(step)?]));
        let both: Vec<[Vector2<f64>; 2]> = both.collect();
        if both.len() < LEAST_STEPS {
            return None;
        }
        let steps = count(&both);
        let means =
            [0, 1].map(|side| both.iter().map(|pair| pair[side]).sum::<Vector2<f64>>() / steps);
        let (mut moments, mut dot, mut cross) = ([0.0; 2], 0.0, 0.0);
        for pair in &both {
            let [one, other] = [0, 1].map(|side| pair[side] - means[side]);
            moments = [
                moments[0] + one.norm_squared() / steps,
                moments[1] + other.norm_squared() / steps,
            ];
            dot += other.dot(&one) / steps;
            cross += other.perp(&one) / steps;
        }
        let variance = means.iter().map(|mean| bias(mean.norm())).sum();
        Some(Self {
            window,
            walks,
            steps,
            means,
            moments,
            dot,
            cross,
            variance,
        })
    }

    /// The variance of the movement of one person around its mean, square meters.
    fn noise(&self) -> f64 {
        MOVEMENT_M2 + MOVEMENT_SHARE * self.variance
    }

    /// A motion that takes one walk to the other, with its value; `None` without a direction.
    fn proposal(&self) -> Option<(f64, Motion)> {
        let spread = self.moments[0].min(self.moments[1]);
        let motion = Motion::fitted([self].into_iter());
        let fits = self.movement(&motion) <= 6.0 * self.noise();
        let tells = spread >= LEAST_SPREAD_M.powi(2) && self.variance < MAX_VARIANCE_M2;
        (tells && fits).then_some((spread / self.variance, motion))
    }

    /// The difference of the mean places.
    fn offset(&self, motion: &Motion) -> Vector2<f64> {
        motion.rotation * self.means[1] + motion.shift - self.means[0]
    }

    /// The mean squared difference of the movements around the means.
    fn movement(&self, motion: &Motion) -> f64 {
        let (sin, cos) = motion.rotation.angle().sin_cos();
        let same = 2.0 * (cos * self.dot + sin * self.cross);
        (self.moments[0] + self.moments[1] - same).max(0.0)
    }

    /// The logarithm of the likelihood ratio of "one person" to "two people".
    fn gain(&self, motion: &Motion) -> f64 {
        let offset = self.offset(motion).norm_squared() / self.variance;
        let density = std::f64::consts::TAU * self.variance * DENSITY;
        let spread = f64::midpoint(self.moments[0], self.moments[1]);
        let (noise, apart) = (self.noise(), spread + self.noise());
        let movement =
            (apart / noise).ln() - self.movement(motion) / (2.0 * noise) + spread / apart;
        -0.5 * offset - density.ln() + INDEPENDENT * movement
    }
}

impl<'a> Fit<'a> {
    /// The pairs that agree with a motion: each walk in one pair of a window.
    fn new(pairs: &'a [Pair], motion: Motion) -> Self {
        let gains = pairs.iter().map(|pair| (pair.gain(&motion), pair));
        let mut gains: Vec<(f64, &Pair)> = gains.filter(|(gain, _)| *gain > 0.0).collect();
        gains.sort_by(|(a, _), (b, _)| b.total_cmp(a));
        let mut used = [BTreeSet::new(), BTreeSet::new()];
        let is_free = |(_, pair): &(f64, &Pair)| {
            let keys = [0, 1].map(|side| (pair.window, pair.walks[side]));
            let is_free = !used[0].contains(&keys[0]) && !used[1].contains(&keys[1]);
            if is_free {
                used[0].insert(keys[0]);
                used[1].insert(keys[1]);
            }
            is_free
        };
        gains.retain(is_free);
        let gain = gains.iter().map(|(gain, _)| gain).sum();
        let pairs = gains.into_iter().map(|(_, pair)| pair).collect();
        Self {
            motion,
            pairs,
            gain,
        }
    }

    /// The fit to the pairs that agree with the fit before.
    fn refined(pairs: &'a [Pair], motion: Motion) -> Self {
        let mut fit = Self::new(pairs, motion);
        for _ in 0..ROUNDS {
            if !fit.pairs.is_empty() {
                fit = Self::new(pairs, Motion::fitted(fit.pairs.iter().copied()));
            }
        }
        fit
    }

    /// The pairs of walks, with the number of their windows.
    fn people(&self) -> BTreeMap<[usize; 2], f64> {
        let mut people = BTreeMap::new();
        for pair in &self.pairs {
            *people.entry(pair.walks).or_insert(0.0) += 1.0;
        }
        people
    }

    /// Returns true if another motion moves the people to other places.
    fn differs_from(&self, other: &Motion) -> bool {
        let offsets = self
            .pairs
            .iter()
            .map(|pair| pair.offset(&self.motion) - pair.offset(other));
        let squares: f64 = offsets.map(|offset| offset.norm_squared()).sum();
        squares > count(&self.pairs) * SAME_POSE_M.powi(2)
    }

    /// The ratio of the spreads of the first and the second places.
    fn scale(&self) -> f64 {
        let weight: f64 = self.pairs.iter().map(|pair| 1.0 / pair.variance).sum();
        let spread = |side: usize| -> f64 {
            let mean = self
                .pairs
                .iter()
                .map(|pair| pair.means[side] / pair.variance);
            let mean = mean.sum::<Vector2<f64>>() / weight;
            let own = |pair: &&Pair| {
                (pair.moments[side] + (pair.means[side] - mean).norm_squared()) / pair.variance
            };
            self.pairs.iter().map(own).sum()
        };
        (spread(0) / spread(1)).sqrt()
    }

    /// Standard deviations of the position in meters and of the rotation in degrees: the jackknife,
    /// with one person left out at a time, and the lasting error of each person.
    fn deviations(&self, people: &BTreeMap<[usize; 2], f64>) -> (f64, f64) {
        let (mut shifts, mut angles) = (0.0, 0.0);
        for left_out in people.keys() {
            let others = self
                .pairs
                .iter()
                .copied()
                .filter(|pair| pair.walks != *left_out);
            let motion = Motion::fitted(others);
            shifts += (motion.shift - self.motion.shift).norm_squared();
            angles += self.motion.rotation.angle_to(&motion.rotation).powi(2);
        }
        let number: f64 = people.keys().map(|_| 1.0).sum();
        let factor = (number - 1.0) / number;
        let mut information = Matrix3::zeros();
        for pair in &self.pairs {
            let weight = 1.0 / (pair.variance * people[&pair.walks]);
            let away = self.motion.rotation * pair.means[1];
            let change = Matrix2x3::new(1.0, 0.0, -away.y, 0.0, 1.0, away.x);
            information += change.transpose() * change * weight;
            information[(2, 2)] += pair.moments[1] * weight;
        }
        let known = information
            .try_inverse()
            .unwrap_or_else(|| Matrix3::repeat(f64::INFINITY));
        (
            (factor * shifts + known[(0, 0)] + known[(1, 1)]).sqrt(),
            (factor * angles + known[(2, 2)]).sqrt().to_degrees(),
        )
    }
}

impl Motion {
    /// The motion of the second places onto the first ones with the least weighted squares.
    fn fitted<'a>(pairs: impl Iterator<Item = &'a Pair> + Clone) -> Self {
        let weight: f64 = pairs.clone().map(|pair| 1.0 / pair.variance).sum();
        let [to, from] = [0, 1].map(|side: usize| {
            let weighted = pairs.clone().map(|pair| pair.means[side] / pair.variance);
            weighted.sum::<Vector2<f64>>() / weight
        });
        let (mut dot, mut cross) = (0.0, 0.0);
        for pair in pairs {
            let (one, other) = (pair.means[0] - to, pair.means[1] - from);
            dot += (other.dot(&one) + pair.dot) / pair.variance;
            cross += (other.perp(&one) + pair.cross) / pair.variance;
        }
        let rotation = Rotation2::new(cross.atan2(dot));
        Self {
            rotation,
            shift: to - rotation * from,
        }
    }
}

#[cfg(test)]
mod tests;
