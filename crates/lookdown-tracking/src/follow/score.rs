//! Scores as probabilities and as logits.

/// Least distance of a probability from 0 and from 1, for a finite logit.
const LEAST: f64 = 1e-6;

/// Returns the logit of a probability.
pub fn logit(score: f64) -> f64 {
    let score = score.clamp(LEAST, 1.0 - LEAST);
    (score / (1.0 - score)).ln()
}

/// Returns the probability of a logit.
pub fn from_logit(logit: f64) -> f64 {
    1.0 / (1.0 + (-logit).exp())
}
