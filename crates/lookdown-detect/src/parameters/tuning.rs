//! Tuning: the constants of a profile that fit it to our own networks.

/// The constants of a profile that fit it to our own networks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tuning {
    /// The score merged by fusion at which a person is as likely as not, above 0 and below 1.
    /// `docs/lab/results.md` has the error of the number of persons with the profiles' own values.
    pub even_odds: f64,
    /// The power of the odds of a merged score, relative to those of `even_odds`, 0.1 to 20. One
    /// value serves all profiles with their own models, on photographs and on rendered frames.
    pub odds_power: f64,
    /// The share of a crop's side that the larger side of a person's box fills, 0.05 to 0.9.
    pub crop_fill: f64,
    /// The factor for scores from crops, in which persons lean by up to 45° and more, above 0 and
    /// at most 1. Where many upright views see a person, they give better scores, and crops give
    /// better extents.
    pub crop_vote: f64,
}
