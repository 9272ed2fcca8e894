//! The true number of crossings of a line, taught by times whose crossings a person counted, and
//! its error bar.
//!
//! * **Ratio.** Given over counted crossings of those times, drawn to 1 by `PRIOR_CROSSINGS`.
//! * **Bar.** Of a Poisson number whose dispersion is estimated (McCullagh and Nelder,
//!   "Generalized Linear Models", 1989, section 6.2.3), with the doubt about the ratio.
//!
//! `docs/lab/real-walks.md` has its coverage.

use crate::taught::NumberWithBar;

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
