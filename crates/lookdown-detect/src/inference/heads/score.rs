//! Conversion of raw values to scores, cheapest test first.

use serde::Deserialize;

/// Deviation from 0 to 1 that is accepted as rounding of a quantized network.
const PROBABILITY_TOLERANCE: f32 = 0.01;
/// Logits below the floor's logit by this much are dropped without the sigmoid. The margin is far
/// larger than `f64` rounding.
const LOGIT_MARGIN: f64 = 1e-3;
/// Above this logit, sigmoids are so close to 1 that the margin would not cover the rounding.
const MAX_FLOOR_LOGIT: f64 = 27.0;

/// Activation applied to a raw score.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Activation {
    /// None: the graph applied it, and values are 0 to 1.
    #[default]
    None,
    /// `1 / (1 + e^-x)`.
    Sigmoid,
}

/// Activation applied to the raw scores of all classes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ClassActivation {
    /// None: the graph applied it, and values are 0 to 1.
    None,
    /// `1 / (1 + e^-x)` for each class separately.
    #[default]
    Sigmoid,
    /// `e^x / Σ e^x` over all classes, including background or "no object".
    Softmax,
}

/// A score compared with the floor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Score {
    /// At least the floor, 0 to 1.
    Kept(f64),
    /// Below the floor.
    Below,
    /// Computed from a NaN or an infinity.
    NotFinite,
    /// Declared as 0 to 1, but out of that range.
    NotAProbability(f32),
}

/// The least score that is kept.
#[derive(Debug, Clone, Copy)]
pub(super) struct Floor {
    score: f64,
    logit: f64,
}

/// `1 / (1 + e^-x)`; 0 and 1 at the infinities.
pub(super) fn sigmoid(x: f64) -> f64 {
    1.0 / (1.0 + (-x).exp())
}

impl Floor {
    pub(super) fn new(score: f64) -> Self {
        let share = score.clamp(0.0, 1.0);
        let logit = (share / (1.0 - share)).ln().min(MAX_FLOOR_LOGIT) - LOGIT_MARGIN;
        Self { score, logit }
    }

    fn judge(self, score: f64) -> Score {
        if score >= self.score {
            Score::Kept(score)
        } else {
            Score::Below
        }
    }

    pub(super) fn sigmoid(self, logit: f32) -> Score {
        let logit = f64::from(logit);
        if !logit.is_finite() {
            Score::NotFinite
        } else if logit < self.logit {
            Score::Below
        } else {
            self.judge(sigmoid(logit))
        }
    }

    fn probability(self, raw: f32) -> Score {
        if !raw.is_finite() {
            Score::NotFinite
        } else if (-PROBABILITY_TOLERANCE..=1.0 + PROBABILITY_TOLERANCE).contains(&raw) {
            self.judge(f64::from(raw.clamp(0.0, 1.0)))
        } else {
            Score::NotAProbability(raw)
        }
    }

    /// The softmax of `logits` at `class`, which must be a valid index.
    pub(super) fn softmax(self, logits: &[f32], class: usize) -> Score {
        if !logits.iter().all(|logit| logit.is_finite()) {
            return Score::NotFinite;
        }
        let own = f64::from(logits[class]);
        let greatest = f64::from(logits.iter().copied().fold(f32::MIN, f32::max));
        // A softmax over all classes is at most the softmax over two of them, which is a sigmoid.
        if own < greatest && own - greatest < self.logit {
            return Score::Below;
        }
        let sum: f64 = logits
            .iter()
            .map(|&logit| (f64::from(logit) - greatest).exp())
            .sum();
        self.judge((own - greatest).exp() / sum)
    }
}

impl Activation {
    pub(super) fn score(self, raw: f32, floor: Floor) -> Score {
        match self {
            Self::None => floor.probability(raw),
            Self::Sigmoid => floor.sigmoid(raw),
        }
    }
}

impl ClassActivation {
    /// The score of `class`, which must be an index of `raw`.
    pub(super) fn score(self, raw: &[f32], class: usize, floor: Floor) -> Score {
        match self {
            Self::None => floor.probability(raw[class]),
            Self::Sigmoid => floor.sigmoid(raw[class]),
            Self::Softmax => floor.softmax(raw, class),
        }
    }
}

impl Score {
    /// The product with `other`. `other` is computed only if this factor is kept, because a product
    /// is at most either factor.
    pub(super) fn times(self, floor: Floor, other: impl FnOnce() -> Self) -> Self {
        let Self::Kept(own) = self else {
            return self;
        };
        match other() {
            Self::Kept(other) => floor.judge(own * other),
            other => other,
        }
    }
}

#[cfg(test)]
mod tests;
