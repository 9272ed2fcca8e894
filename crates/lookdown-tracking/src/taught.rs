//! The number of persons in frames of one camera, taught by frames whose number a person gave, and
//! its error bar.
//!
//! * **Number.** For each of some score thresholds, the boxes from there on, times the ratio of
//!   given to found persons. The thresholds vote with exponential weights: `exp(-RATE · error)`, by
//!   the sum of their errors in the reference frames.
//! * **Bar.** Jackknife+ (Barber et al., "Predictive inference with the jackknife+", 2021), with
//!   errors in units of the square root of the number. Frames close in time are left out together.
//!
//! `cargo run -p lookdown-simulate --bin taught < SEQUENCES` measures both.

use lookdown_lens::saturating::to_usize;

/// Candidates with a lower score are not needed: with the lowest thresholds, most boxes are none.
pub const LEAST_SCORE: f64 = 0.02;
/// Least number of reference frames for a threshold of the camera's own.
pub const MIN_FRAMES: usize = 5;
/// Most reference frames: the oldest make room.
pub const MAX_FRAMES: usize = 60;
/// The share of true numbers within a bar.
pub const COVERAGE: f64 = 0.9;

/// Number of thresholds, and the factor between two: from 0.02 to 0.5.
const THRESHOLDS: usize = 24;
const STEP: f64 = 1.15;
/// The rate of the exponential weights, per person. Half or twice of it changes the error by 3 %.
const RATE: f64 = 0.5;
/// Persons by which the ratio of few frames is drawn to 1. 5 and 20 are as good within 3 %.
const PRIOR_PERSONS: f64 = 10.0;
/// One in so many frames before a frame, and as many after it, are left out with it, while enough
/// remain.
const NEIGHBORS: usize = 5;

/// The bar without reference frames: how much lower and higher the true number is than that of the
/// reports, in units of the square root of the number + 1, as in [`TaughtNumber`]. The largest
/// error of our four rendered rooms, .71, widened as for four frames. It holds for few real rooms
/// (`docs/lab/count-accuracy.md`).
const DEFAULT_BAR: [f64; 2] = [-1.0, 1.0];

/// A frame whose number of persons is given.
#[derive(Debug, Clone, PartialEq)]
pub struct ReferenceFrame {
    /// The number of persons in the frame.
    pub persons: u32,
    /// The scores of all boxes from [`LEAST_SCORE`] on, 0 to 1, in any order.
    pub scores: Vec<f32>,
}

/// A number of persons, in a frame or who crossed a line, with its bar.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NumberWithBar {
    /// The number.
    pub persons: usize,
    /// In 90 % of frames or times, the true number is at least this one …
    pub low: usize,
    /// … and at most this one. Both include the number.
    pub high: usize,
}

impl NumberWithBar {
    /// Returns the number of reports with the default bar, which is wide.
    pub fn untaught(persons: usize) -> Self {
        let [low, high] = default_bar(to_f64(persons));
        Self::new(to_f64(persons), low, high)
    }

    /// Rounds the number, and the bar to the whole numbers within half a person of it.
    pub(crate) fn new(number: f64, low: f64, high: f64) -> Self {
        let persons = to_usize(number.round());
        Self {
            persons,
            low: to_usize((low + 0.5).floor()).min(persons),
            high: to_usize((high - 0.5).ceil()).max(persons),
        }
    }
}

/// Returns the bar of a number without reference frames, such as the mean of a time.
pub fn default_bar(number: f64) -> [f64; 2] {
    DEFAULT_BAR.map(|error| (number + error * scale(number)).max(0.0))
}

/// The factors of the thresholds.
type Weights = [f64; THRESHOLDS];

/// The number of persons of a camera with reference frames.
#[derive(Debug, Clone)]
pub struct TaughtNumber {
    weights: Weights,
    /// For each reference frame the weights without it and its neighbors, and their error there in
    /// units of [`scale`].
    left_out: Vec<(Weights, f64)>,
}

impl TaughtNumber {
    /// Learns from reference frames in the order of their times. Returns `None` for fewer than
    /// [`MIN_FRAMES`].
    pub fn new(frames: &[ReferenceFrame]) -> Option<Self> {
        if frames.len() < MIN_FRAMES {
            return None;
        }
        let counts: Vec<(f64, Weights)> = frames
            .iter()
            .map(|frame| (f64::from(frame.persons), found(&frame.scores)))
            .collect();
        let spare = (counts.len() - MIN_FRAMES) / 2;
        let neighbors = (counts.len() / NEIGHBORS).min(spare);
        let left_out = counts.iter().enumerate().map(|(index, (persons, found))| {
            let others = counts.iter().enumerate();
            let others = others.filter(|(other, _)| other.abs_diff(index) > neighbors);
            let others: Vec<_> = others.map(|(_, frame)| frame).collect();
            let weights = weights(&others);
            let number = estimate(&weights, found);
            (weights, (persons - number).abs() / scale(number))
        });
        Some(Self {
            left_out: left_out.collect(),
            weights: weights(&counts.iter().collect::<Vec<_>>()),
        })
    }

    /// Returns the number in a frame with boxes of these scores, from [`LEAST_SCORE`] on.
    pub fn number(&self, scores: &[f32]) -> NumberWithBar {
        let found = found(scores);
        let count = self.left_out.len();
        // Fewer frames than a bar of this coverage needs: the tail is taken as exponential.
        let widened = (1.0 - COVERAGE).ln() / (1.0 / to_f64(count + 1)).ln();
        let bars = self.left_out.iter().map(|(weights, error)| {
            let number = estimate(weights, &found);
            (number, error * scale(number) * widened.max(1.0))
        });
        let (mut lows, mut highs): (Vec<f64>, Vec<f64>) = bars
            .map(|(number, error)| (number - error, number + error))
            .unzip();
        lows.sort_by(f64::total_cmp);
        highs.sort_by(f64::total_cmp);
        let rank = to_usize((COVERAGE * to_f64(count + 1)).ceil()).min(count);
        NumberWithBar::new(
            estimate(&self.weights, &found),
            lows[count - rank],
            highs[rank - 1],
        )
    }

    /// Returns the mean threshold, for people to see.
    pub fn threshold(&self) -> f64 {
        let sum: f64 = self.weights.iter().sum();
        let thresholds = self.weights.iter().zip(thresholds());
        thresholds.map(|(weight, at)| weight * at).sum::<f64>() / sum
    }
}

fn thresholds() -> impl Iterator<Item = f64> {
    (0..THRESHOLDS).map(|index| LEAST_SCORE * STEP.powi(i32::try_from(index).unwrap_or(0)))
}

/// Returns the number of boxes from each threshold on.
fn found(scores: &[f32]) -> Weights {
    let mut found = [0.0; THRESHOLDS];
    for (count, threshold) in found.iter_mut().zip(thresholds()) {
        let boxes = scores
            .iter()
            .filter(|score| f64::from(**score) >= threshold);
        *count = to_f64(boxes.count());
    }
    found
}

/// Returns the weight of each threshold times its ratio.
fn weights(frames: &[&(f64, Weights)]) -> Weights {
    let given: f64 = frames.iter().map(|(persons, _)| persons).sum();
    let mut ratios = [0.0; THRESHOLDS];
    let mut errors = [0.0; THRESHOLDS];
    for (index, (ratio, error)) in ratios.iter_mut().zip(&mut errors).enumerate() {
        let seen: f64 = frames.iter().map(|(_, found)| found[index]).sum();
        let of_frames = (given + PRIOR_PERSONS) / (seen + PRIOR_PERSONS);
        let off = |(persons, found): &&(f64, Weights)| (persons - of_frames * found[index]).abs();
        *ratio = of_frames;
        *error = frames.iter().map(off).sum();
    }
    let least = errors.iter().copied().fold(f64::INFINITY, f64::min);
    let votes = errors.map(|error| (-RATE * (error - least)).exp());
    let sum: f64 = votes.iter().sum();
    let mut weights = ratios;
    for (weight, vote) in weights.iter_mut().zip(votes) {
        *weight *= vote / sum;
    }
    weights
}

fn estimate(weights: &Weights, found: &Weights) -> f64 {
    weights
        .iter()
        .zip(found)
        .map(|(weight, found)| weight * found)
        .sum()
}

/// The unit of errors at a level of the number.
fn scale(number: f64) -> f64 {
    (number + 1.0).sqrt()
}

fn to_f64(number: usize) -> f64 {
    number as f64
}

/// The true number of crossings of a line, taught by times whose crossings a person counted, and
/// its error bar.
///
/// * **Ratio.** Given over counted crossings of those times, drawn to 1 by `PRIOR_CROSSINGS`.
/// * **Bar.** Of a Poisson number whose dispersion is estimated (McCullagh and Nelder,
///   "Generalized Linear Models", 1989, section 6.2.3), with the doubt about the ratio.
///
/// `docs/lab/real-walks.md` has its coverage.
///
/// Crossings by which the ratio of few of them is drawn to 1. 5 and 20 are as good within 4 %.
const PRIOR_CROSSINGS: f64 = 10.0;
/// Times with the dispersion 1, that of independent misses, which weight like those of a person.
const PRIOR_TIMES: f64 = 3.0;
/// Standard deviations of a normal distribution with 90 % between them.
const DEVIATIONS: f64 = 1.645;

/// A time in which a person counted the crossings of a line.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct ReferenceCrossings {
    /// The crossings that the person gave.
    pub given: u64,
    /// The crossings that were counted without the person.
    pub counted: u64,
}

/// The ratio of true to counted crossings of a line.
#[derive(Debug, Clone, Copy)]
pub struct CrossingRatio {
    /// The ratio.
    pub ratio: f64,
    /// The variance of a true number in units of the number.
    dispersion: f64,
    /// The crossings that determine the ratio.
    weight: f64,
}

impl CrossingRatio {
    /// Learns from some times; without any, the ratio is 1 with a wide bar.
    pub fn new(times: &[ReferenceCrossings]) -> Self {
        let given: u64 = times.iter().map(|time| time.given).sum();
        let counted: u64 = times.iter().map(|time| time.counted).sum();
        let weight = given as f64 + PRIOR_CROSSINGS;
        let ratio = weight / (counted as f64 + PRIOR_CROSSINGS);
        let mut errors = PRIOR_TIMES;
        for time in times {
            let number = ratio * time.counted as f64;
            errors += (time.given as f64 - number).powi(2) / (number + 1.0);
        }
        Self {
            ratio,
            dispersion: errors / (times.len() as f64 + PRIOR_TIMES),
            weight,
        }
    }

    /// Returns the true number of crossings of a time with so many counted ones.
    pub fn number(&self, counted: u64) -> NumberWithBar {
        let number = self.ratio * counted as f64;
        let variance = self.dispersion * (number + 1.0 + number * number / self.weight);
        let error = DEVIATIONS * variance.sqrt();
        NumberWithBar::new(number, number - error, number + error)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A frame in which `low` persons have the score .1, and `high` ones .8.
    fn frame(persons: u32, low: u8, high: u8) -> ReferenceFrame {
        let scores = [vec![0.1; low.into()], vec![0.8; high.into()]].concat();
        ReferenceFrame { persons, scores }
    }

    #[test]
    fn five_frames_give_a_threshold_of_the_camera() {
        // Persons have low scores here; elsewhere boxes of such scores are none.
        let quiet: Vec<_> = (1..6)
            .map(|low| frame(4 + u32::from(low), low, 4))
            .collect();
        let strict: Vec<_> = (1..6).map(|low| frame(4, low, 4)).collect();
        let new = frame(0, 3, 4).scores;
        assert!(TaughtNumber::new(&quiet[..4]).is_none());
        let [quiet, strict] = [quiet, strict].map(|frames| TaughtNumber::new(&frames).unwrap());
        assert_eq!(quiet.number(&new).persons, 7);
        assert_eq!(strict.number(&new).persons, 4);
        assert!(quiet.threshold() < 0.1 && strict.threshold() > 0.1);
    }

    #[test]
    fn persons_without_a_box_become_a_ratio() {
        let frames: Vec<_> = (0..10).map(|_| frame(12, 0, 8)).collect();
        let taught = TaughtNumber::new(&frames).unwrap();
        assert_eq!(taught.number(&frame(0, 0, 8).scores).persons, 12);
        assert_eq!(taught.number(&frame(0, 0, 4).scores).persons, 6);
    }

    #[test]
    fn bar_holds_the_errors_of_the_reference_frames() {
        let frames: Vec<_> = [8, 10, 12, 10, 8, 12, 10, 9, 11, 10]
            .map(|persons| frame(persons, 0, 10))
            .into();
        let taught = TaughtNumber::new(&frames).unwrap();
        let NumberWithBar { persons, low, high } = taught.number(&frame(0, 0, 10).scores);
        assert_eq!(persons, 10);
        assert!(
            (7..=8).contains(&low) && (12..=13).contains(&high),
            "{low} {high}"
        );
    }

    #[test]
    fn bar_is_wider_for_more_persons_and_without_frames() {
        let widths = [0, 5, 20].map(|persons| {
            let bar = NumberWithBar::untaught(persons);
            assert!(bar.low <= persons && persons <= bar.high);
            bar.high - bar.low
        });
        assert!(widths[0] < widths[1] && widths[1] < widths[2], "{widths:?}");
    }

    fn time(given: u64, counted: u64) -> ReferenceCrossings {
        ReferenceCrossings { given, counted }
    }

    #[test]
    fn missed_crossings_become_a_ratio_with_a_bar() {
        let ratio = CrossingRatio::new(&[time(110, 90), time(90, 70)]);
        let NumberWithBar { persons, low, high } = ratio.number(160);
        assert_eq!(persons, 198, "210 / 170 · 160");
        assert!((160..180).contains(&low) && (216..236).contains(&high));
        assert!(ratio.number(0).low == 0 && ratio.number(0).high <= 2);
    }

    #[test]
    fn bar_narrows_with_times_that_agree_and_widens_with_others() {
        let width = |times: &[_]| {
            let bar = CrossingRatio::new(times).number(50);
            bar.high - bar.low
        };
        let agreeing = [time(50, 40); 4];
        let untaught = width(&[]);
        assert!(width(&agreeing[..1]) < untaught && width(&agreeing) < width(&agreeing[..1]));
        let differing = [time(80, 40), time(20, 40), time(80, 40), time(20, 40)];
        assert!(width(&differing) > width(&agreeing));
    }
}
