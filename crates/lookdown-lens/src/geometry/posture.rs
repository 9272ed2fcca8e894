//! The posture of a person, from the angles of the box alone.
//!
//! Bodies of spheres stand, sit, crouch and lie in eight directions below a camera. A box is
//! compared with the boxes of all of them at its place, in several sizes, so that the size of a
//! person and an unknown height of the camera are found as well. One box often fits several
//! postures: a person who lies along the line of sight covers what a smaller person who stands
//! would. So a [`PostureBelief`] keeps the size that earlier boxes showed.

use std::{f64::consts::TAU, sync::OnceLock};

use crate::saturating::to_usize;

use serde::{Deserialize, Serialize};

use super::{Lens, Mount, OrientedBox, Pixel, Ray, pixels::to_pixel_center};

/// The posture of a person.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, strum::IntoStaticStr)]
#[serde(rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
pub enum Posture {
    /// Standing or walking.
    Upright,
    /// On a chair.
    Seated,
    /// Crouching, kneeling, crawling or sitting on the floor.
    Low,
    /// Lying, stretched out or curled.
    Lying,
    /// No posture is likely enough.
    Unknown,
}

impl Posture {
    /// Returns the name, as in reports.
    pub fn name(self) -> &'static str {
        self.into()
    }
}

/// Number of known postures.
const POSTURES: usize = 4;
/// A posture with a lower probability is [`Posture::Unknown`]. With .6 instead, a third of the
/// people on chairs in 20 rendered rooms would be told no posture; half of them are told right.
const LEAST_PROBABILITY: f64 = 0.5;
/// A person is down from this probability of lying or being low, if lying has at least the second
/// one, and up from this one of standing or sitting. People who are low alone clean and play there.
const SURE: f64 = 0.9;
const LEAST_LYING: f64 = 0.5;
/// Someone who sat for this long in the same box has not come down in it, milliseconds: 10 instead
/// of 32 of 400 people who are simulated to sit for half an hour become an alert. Standing does not
/// count: someone who falls away from the camera can have the same box.
pub const SETTLED_MS: i64 = 60_000;
/// Limit of the same box: the factor by which the longer side changes.
pub const SAME_LENGTH: f64 = 1.4;
/// The least mean probability of being down since then, for an alert: 4 instead of 10 of 400 people
/// who are simulated to sit for half an hour become one, and as many of those who lie.
pub const MOSTLY_DOWN: f64 = 0.8;
/// A person who is up for this long is up again, milliseconds.
pub const UP_MS: i64 = 5_000;

/// Sizes of people and their steps, relative to the bodies below, who are 1.7 m tall.
const SIZES: usize = 13;
const SMALLEST: f64 = 0.6;
const STEP: f64 = 1.08;
/// Standard deviations of the logarithm of the size: of adults, and with an unknown height of the
/// camera, which is then 2.8 m. One person of ten is of any size: children, and wrong heights.
const SIZE_SD: f64 = 0.09;
const UNKNOWN_HEIGHT_SD: f64 = 0.2;
const USUAL_CAMERA_M: f64 = 2.8;
const ANY_SIZE: f64 = 0.02;

/// Shares of people by posture where nothing else is known.
const PRIOR: [f64; POSTURES] = [0.5, 0.35, 0.04, 0.11];
/// Rate at which a person takes another posture, per second; shares as in [`PRIOR`], but more lie
/// down or crouch than do so at a moment.
const CHANGE_RATE: f64 = 0.2;
const CHANGE_TO: [f64; POSTURES] = [0.35, 0.4, 0.07, 0.18];
/// Errors of successive boxes are alike for about this time, seconds.
const CORRELATION_S: f64 = 0.5;
/// All boxes so far count as this many at most: some errors last as long as a posture does.
const MOST_BOXES: f64 = 4.0;
/// Standard deviation of the logarithm of an extent: boxes (.08 for found people of the rendered
/// development set), clothes and limbs.
const EXTENT_SD: f64 = 0.13;
/// Share of boxes that fit no body.
const OUTLIERS: f64 = 0.001;
/// Most views whose votes count for one person.
const MOST_VOTES: usize = 3;
/// The votes for lying and for low by posture, with their correlation: of people found 2145 times
/// in 120 rendered frames whose rooms and clothes training never had.
const VOTES: [([(f64, f64); 2], f64); POSTURES] = [
    ([(0.09, 0.10), (0.24, 0.13)], 0.55),
    ([(0.13, 0.12), (0.27, 0.12)], 0.53),
    ([(0.31, 0.16), (0.44, 0.12)], 0.41),
    ([(0.54, 0.13), (0.29, 0.13)], 0.10),
];
/// Share of votes that tell nothing.
const WRONG_VOTES: f64 = 0.05;

/// Steps of the table of bodies: angles from straight down, and sizes per height of the camera.
const ANGLE_STEP: f64 = 5.0 * std::f64::consts::PI / 180.0;
const ANGLES: usize = 17;
const RATIOS: usize = 33;
const SMALLEST_RATIO: f64 = 0.08;
const DIRECTIONS: usize = 8;

/// The center of a sphere outward, aside and up, and its radius, meters.
type Sphere = [f64; 4];

/// Bodies that face outward, with their postures. A mirrored body has the same extents.
#[rustfmt::skip]
const BODIES: [(Posture, &[Sphere]); 10] = {
    use Posture::{Low, Lying, Seated, Upright};
    [
        // Standing, and walking.
        (Upright, &[[0.0, 0.0, 1.58, 0.12], [0.0, 0.2, 1.38, 0.1], [0.0, -0.2, 1.38, 0.1], [0.0, 0.24, 0.9, 0.08],
            [0.0, -0.24, 0.9, 0.08], [0.05, 0.1, 0.06, 0.1], [0.05, -0.1, 0.06, 0.1]]),
        (Upright, &[[0.05, 0.0, 1.56, 0.12], [0.0, 0.2, 1.38, 0.1], [0.0, -0.2, 1.38, 0.1], [0.25, 0.24, 0.95, 0.08],
            [-0.2, -0.24, 0.95, 0.08], [0.32, 0.1, 0.08, 0.1], [-0.3, -0.1, 0.1, 0.1]]),
        (Seated, &[[0.03, 0.0, 1.22, 0.12], [0.0, 0.2, 1.0, 0.1], [0.0, -0.2, 1.0, 0.1], [-0.02, 0.0, 0.52, 0.18],
            [0.42, 0.13, 0.5, 0.08], [0.42, -0.13, 0.5, 0.08], [0.5, 0.12, 0.06, 0.08], [0.5, -0.12, 0.06, 0.08]]),
        // Crouching, sitting on the floor, kneeling, and on hands and knees.
        (Low, &[[0.15, 0.0, 0.85, 0.12], [0.05, 0.2, 0.68, 0.1], [0.05, -0.2, 0.68, 0.1], [-0.1, 0.0, 0.25, 0.18],
            [0.3, 0.16, 0.42, 0.08], [0.3, -0.16, 0.42, 0.08], [0.1, 0.0, 0.06, 0.14]]),
        (Low, &[[0.0, 0.0, 0.8, 0.12], [0.0, 0.2, 0.58, 0.1], [0.0, -0.2, 0.58, 0.1], [0.0, 0.0, 0.14, 0.18],
            [0.42, 0.15, 0.3, 0.08], [0.42, -0.15, 0.3, 0.08], [0.8, 0.12, 0.08, 0.08], [0.8, -0.12, 0.08, 0.08]]),
        (Low, &[[0.08, 0.0, 1.1, 0.12], [0.03, 0.2, 0.9, 0.1], [0.03, -0.2, 0.9, 0.1], [-0.05, 0.0, 0.42, 0.18],
            [0.1, 0.0, 0.07, 0.16], [-0.4, 0.0, 0.07, 0.16]]),
        (Low, &[[0.55, 0.0, 0.62, 0.12], [0.35, 0.2, 0.5, 0.1], [0.35, -0.2, 0.5, 0.1], [-0.25, 0.0, 0.48, 0.18],
            [0.42, 0.0, 0.05, 0.2], [-0.7, 0.0, 0.07, 0.16]]),
        // Curled, on the back or face down, and with an arm out.
        (Lying, &[[0.55, 0.05, 0.12, 0.12], [0.35, 0.0, 0.2, 0.15], [-0.25, -0.05, 0.17, 0.18], [0.05, 0.4, 0.12, 0.1],
            [-0.4, 0.3, 0.1, 0.1]]),
        (Lying, &[[0.8, 0.0, 0.12, 0.12], [0.55, 0.2, 0.12, 0.1], [0.55, -0.2, 0.12, 0.1], [0.0, 0.0, 0.12, 0.2],
            [-0.82, 0.1, 0.08, 0.08], [-0.82, -0.1, 0.08, 0.08]]),
        (Lying, &[[0.75, 0.0, 0.14, 0.12], [0.52, 0.1, 0.2, 0.12], [0.5, 0.7, 0.06, 0.07], [0.0, 0.0, 0.17, 0.18],
            [-0.35, 0.2, 0.1, 0.08], [-0.75, 0.0, 0.1, 0.1]]),
    ]
};

/// The logarithms of the two extents of each body in each direction.
type Row = Vec<[f64; 2]>;

/// The extents of all bodies, by size per height of the camera and by angle.
static TABLE: [OnceLock<Vec<Row>>; RATIOS] = [const { OnceLock::new() }; RATIOS];

/// Returns the part of the table for a size per height of the camera, by angle.
fn rows(ratio: usize) -> Vec<Row> {
    let camera = 1.0 / (SMALLEST_RATIO * STEP.powf(float(ratio)));
    let row = |angle: usize| {
        let angle = float(angle) * ANGLE_STEP;
        let bodies = BODIES.iter().flat_map(|(_, body)| {
            let turns = (0..DIRECTIONS).map(|turn| float(turn) * std::f64::consts::FRAC_PI_4);
            turns.map(move |turn| extents(body, turn, angle, camera).map(f64::ln))
        });
        bodies.collect()
    };
    (0..ANGLES).map(row).collect()
}

/// A box as the camera sees it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct BoxAngles {
    /// The angle of the box's middle from straight down, radians.
    pub from_nadir: f64,
    /// Extent along the projected vertical, radians.
    pub along: f64,
    /// Extent across it, radians.
    pub across: f64,
}

impl BoxAngles {
    /// Returns the angles of a box; `None` where a side is outside the lens image, or the floor is
    /// too far away.
    pub fn new(person: &OrientedBox, lens: &Lens, mount: &Mount) -> Option<Self> {
        let ray = |end: Pixel| lens.unproject(&to_pixel_center(end));
        let aside = nalgebra::Vector2::new(-person.up.y, person.up.x) * (person.width / 2.0);
        let center = ray(person.center)?.normalize();
        let [foot, head] = [
            person.foot(),
            person.center + person.up * (person.height / 2.0),
        ]
        .map(ray);
        let [left, right] = [person.center - aside, person.center + aside].map(ray);
        let (foot, head) = (foot?, head?);
        let outward = head.normalize() - foot.normalize();
        let outward = (outward - center * outward.dot(&center)).try_normalize(f64::EPSILON)?;
        let sideward = center.cross(&outward);
        let angle = |ray: Ray, axis: &Ray| ray.dot(axis).atan2(ray.dot(&center));
        let [near, far] = [angle(foot, &outward), angle(head, &outward)];
        let across = (angle(right?, &sideward) - angle(left?, &sideward)).abs();
        let from_nadir = center.angle(&mount.nadir()) + f64::midpoint(near, far);
        let is_usable = (0.0..=float(ANGLES - 1) * ANGLE_STEP).contains(&from_nadir)
            && across > 0.0
            && far > near;
        is_usable.then_some(Self {
            from_nadir,
            along: far - near,
            across,
        })
    }

    /// Returns the likelihood of each posture and size below a camera of this height.
    #[expect(
        clippy::needless_range_loop,
        reason = "sizes and postures are two axes"
    )]
    fn likelihoods(&self, camera_m: Option<f64>) -> [[f64; SIZES]; POSTURES] {
        let measured = [self.along.ln(), self.across.ln()];
        let angle = self.from_nadir / ANGLE_STEP;
        let lower = to_usize(angle).min(ANGLES - 2);
        let share = angle - float(lower);
        let first =
            (SMALLEST / camera_m.unwrap_or(USUAL_CAMERA_M) / SMALLEST_RATIO).ln() / STEP.ln();
        let mut likelihoods = [[0.0; SIZES]; POSTURES];
        for size in 0..SIZES {
            let ratio = to_usize(first.round() + float(size)).min(RATIOS - 1);
            let rows = TABLE[ratio].get_or_init(|| rows(ratio));
            let (near, far) = (&rows[lower], &rows[lower + 1]);
            let mut counts = [0.0; POSTURES];
            for (index, (near, far)) in near.iter().zip(far).enumerate() {
                let posture = BODIES[index / DIRECTIONS].0 as usize;
                let mut squares = 0.0;
                for axis in 0..2 {
                    let expected = near[axis] * (1.0 - share) + far[axis] * share;
                    squares += ((measured[axis] - expected) / EXTENT_SD).powi(2);
                }
                likelihoods[posture][size] += (-squares / 2.0).exp();
                counts[posture] += 1.0;
            }
            for (posture, count) in counts.iter().enumerate() {
                likelihoods[posture][size] =
                    OUTLIERS + (1.0 - OUTLIERS) * likelihoods[posture][size] / count;
            }
        }
        likelihoods
    }
}

/// The votes of a network for a person on the floor, 0 to 1: the mean over the views that show the
/// person.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct FloorVotes {
    /// For a person who lies.
    pub lying: f64,
    /// For a person who crouches, kneels, crawls or sits on the floor.
    pub low: f64,
}

impl FloorVotes {
    /// Takes a score for a posture if it is higher. Other postures change nothing.
    pub fn raise(&mut self, posture: Posture, score: f64) {
        let vote = match posture {
            Posture::Lying => &mut self.lying,
            Posture::Low => &mut self.low,
            _ => return,
        };
        *vote = vote.max(score);
    }

    /// Returns the mean of the best votes, one for each of the `showing` views that show the person
    /// wholly, 3 at most.
    pub fn mean_of_best(mut votes: Vec<Self>, showing: usize) -> Self {
        votes.sort_by(|one, other| other.sum().total_cmp(&one.sum()));
        let counted = showing.clamp(1, MOST_VOTES);
        let mean =
            |of: fn(&Self) -> f64| votes.iter().take(counted).map(of).sum::<f64>() / float(counted);
        Self {
            lying: mean(|votes| votes.lying),
            low: mean(|votes| votes.low),
        }
    }

    fn sum(&self) -> f64 {
        self.lying + self.low
    }

    /// Returns the likelihood of each posture, from a bivariate normal distribution. A vote counts
    /// as a standard deviation above the mean for its own posture at most, so that the surest votes
    /// tell of it. For 3,533 boxes of rendered falls the likeliest posture is the same as without.
    fn likelihoods(self) -> [f64; POSTURES] {
        let [.., (of_low, _), (of_lying, _)] = VOTES;
        let capped = |vote: f64, (mean, sd): (f64, f64)| vote.min(mean + sd);
        let (lying_vote, low_vote) = (capped(self.lying, of_lying[0]), capped(self.low, of_low[1]));
        VOTES.map(|([lying, low], correlation)| {
            let standard = |vote: f64, (mean, sd): (f64, f64)| (vote - mean) / sd;
            let (x, y) = (standard(lying_vote, lying), standard(low_vote, low));
            let unique = 1.0 - correlation * correlation;
            let square = (x * x - 2.0 * correlation * x * y + y * y) / unique;
            let density = (-square / 2.0).exp() / (TAU * lying.1 * low.1 * unique.sqrt());
            WRONG_VOTES + (1.0 - WRONG_VOTES) * density
        })
    }
}

/// The signs of a person's posture in one frame.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PostureSigns {
    /// The person's box; `None` where it is outside the lens image or too far away.
    pub angles: Option<BoxAngles>,
    /// Votes for a person on the floor; `None` if no network that tells postures looked.
    pub votes: Option<FloorVotes>,
}

/// Returns the extents of a body that faces `turn` away from outward, at the place where the middle
/// of its box is at `angle` from straight down; `camera` is the height of the camera above the
/// floor for a body of 1.7 m.
fn extents(body: &[Sphere], turn: f64, angle: f64, camera: f64) -> [f64; 2] {
    let (sin, cos) = turn.sin_cos();
    let turned = body.iter().map(|[out, aside, up, radius]| {
        [
            out * cos - aside * sin,
            out * sin + aside * cos,
            (camera - up).max(2.0 * radius),
            *radius,
        ]
    });
    let spheres: Vec<Sphere> = turned.collect();
    let range = |angles: &mut dyn Iterator<Item = [f64; 2]>| {
        angles.fold(
            [f64::INFINITY, f64::NEG_INFINITY],
            |[low, high], [middle, half]| [low.min(middle - half), high.max(middle + half)],
        )
    };
    let along = |place: f64| {
        range(&mut spheres.iter().map(|[out, _, down, radius]| {
            let out = out + place;
            [
                out.atan2(*down),
                (radius / out.hypot(*down)).min(1.0).asin(),
            ]
        }))
    };
    // The tangent of the middle is nearly proportional to the place.
    let height = (camera - 0.6).max(0.5);
    let mut place = height * angle.tan();
    for _ in 0..6 {
        let [low, high] = along(place);
        place += height * (angle.tan() - f64::midpoint(low, high).min(1.5).tan());
    }
    let [low, high] = along(place);
    let (sin, cos) = angle.sin_cos();
    let [left, right] = range(&mut spheres.iter().map(|[out, aside, down, radius]| {
        let depth = (out + place) * sin + down * cos;
        let distance = depth.hypot(*aside);
        [aside.atan2(depth), (radius / distance).min(1.0).asin()]
    }));
    [high - low, right - left]
}

/// The evidence of all boxes of one person about the posture.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PostureBelief {
    /// Probabilities by posture and size.
    weights: [[f64; SIZES]; POSTURES],
}

impl PostureBelief {
    /// Returns the belief about a person without a box. `has_height` is true if the height of the
    /// camera is known.
    pub fn new(has_height: bool) -> Self {
        let sizes = sizes(has_height);
        Self {
            weights: PRIOR.map(|share| sizes.map(|size| size * share)),
        }
    }

    /// Adds a frame `since_s` after the last one of the same camera, infinity for its first one.
    /// `camera_m` is the height of the camera above the floor, meters.
    pub fn add(&mut self, signs: &PostureSigns, camera_m: Option<f64>, since_s: f64) {
        // A box that resembles the camera's last one adds little, and all boxes together no more
        // than a few.
        let news = -(-since_s.max(0.0) / CORRELATION_S).exp_m1();
        let kept = 1.0 - news / MOST_BOXES;
        let unknown = [[1.0; SIZES]; POSTURES];
        let by_box = signs
            .angles
            .map_or(unknown, |angles| angles.likelihoods(camera_m));
        let by_vote = signs.votes.map_or([1.0; POSTURES], FloorVotes::likelihoods);
        let sizes = sizes(camera_m.is_some());
        for (posture, weights) in self.weights.iter_mut().enumerate() {
            for (size, weight) in weights.iter_mut().enumerate() {
                let prior = PRIOR[posture] * sizes[size];
                let likelihood = (by_box[posture][size] * by_vote[posture]).powf(news);
                *weight = weight.powf(kept) * prior.powf(1.0 - kept) * likelihood;
            }
        }
        let sum: f64 = self.weights.iter().flatten().sum();
        for weight in self.weights.iter_mut().flatten() {
            *weight /= sum;
        }
    }

    /// Lets time pass: people change their posture and keep their size.
    pub fn pass(&mut self, elapsed_s: f64) {
        let share = -(-elapsed_s.max(0.0) * CHANGE_RATE).exp_m1();
        for size in 0..SIZES {
            let sum: f64 = self.weights.iter().map(|weights| weights[size]).sum();
            for (weights, to) in self.weights.iter_mut().zip(CHANGE_TO) {
                weights[size] = (1.0 - share) * weights[size] + share * to * sum;
            }
        }
    }

    /// Returns the probability of a posture; of any other for [`Posture::Unknown`], 0.
    pub fn probability(&self, posture: Posture) -> f64 {
        self.weights
            .get(posture as usize)
            .map_or(0.0, |weights| weights.iter().sum())
    }

    /// Returns true if the person is down, as for a floor alert.
    pub fn is_down(&self) -> bool {
        self.probability(Posture::Lying) >= LEAST_LYING && self.down_probability() >= SURE
    }

    /// Returns the probability that the person lies or is low.
    pub fn down_probability(&self) -> f64 {
        self.probability(Posture::Lying) + self.probability(Posture::Low)
    }

    /// Returns true if the person stands or sits. Someone may be neither down nor up.
    pub fn is_up(&self) -> bool {
        self.probability(Posture::Upright) + self.probability(Posture::Seated) >= SURE
    }

    /// Returns true if the person sits.
    pub fn sits(&self) -> bool {
        self.is_up() && self.posture().0 == Posture::Seated
    }

    /// Returns the most likely posture with its probability, [`Posture::Unknown`] below .5.
    pub fn posture(&self) -> (Posture, f64) {
        use Posture::{Low, Lying, Seated, Unknown, Upright};
        let likely =
            [Upright, Seated, Low, Lying].map(|posture| (posture, self.probability(posture)));
        let best = likely
            .into_iter()
            .max_by(|one, other| one.1.total_cmp(&other.1));
        let (posture, probability) = best.unwrap_or((Unknown, 0.0));
        if probability < LEAST_PROBABILITY {
            return (Unknown, probability);
        }
        (posture, probability)
    }
}

/// Returns the shares of people by size.
fn sizes(has_height: bool) -> [f64; SIZES] {
    let sd = if has_height {
        SIZE_SD
    } else {
        UNKNOWN_HEIGHT_SD
    };
    let shares: [f64; SIZES] = std::array::from_fn(|size| {
        let logarithm = (SMALLEST * STEP.powf(float(size))).ln();
        (-(logarithm / sd).powi(2) / 2.0).exp()
    });
    let sum: f64 = shares.iter().sum();
    shares.map(|share| (1.0 - ANY_SIZE) * share / sum + ANY_SIZE / float(SIZES))
}

fn float(number: usize) -> f64 {
    number as f64
}

#[cfg(test)]
mod tests;
