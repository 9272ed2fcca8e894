//! Random numbers that are the same on every machine.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// A seeded source of random numbers.
pub struct Chance(ChaCha8Rng);

impl Chance {
    /// Returns the source number `stream` of a seed.
    pub fn new(seed: u64, stream: u64) -> Self {
        let mut source = ChaCha8Rng::seed_from_u64(seed);
        source.set_stream(stream);
        Self(source)
    }

    /// Returns a number from `low` to `high`, uniformly.
    pub fn uniform(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.0.random::<f64>()
    }

    /// Returns true with the given probability.
    pub fn happens(&mut self, probability: f64) -> bool {
        self.0.random::<f64>() < probability
    }

    /// Returns a standard normal number (Box and Muller, 1958).
    pub fn normal(&mut self) -> f64 {
        let radius = (-2.0 * (1.0 - self.0.random::<f64>()).ln()).sqrt();
        radius * (std::f64::consts::TAU * self.0.random::<f64>()).cos()
    }

    /// Returns the index of an event in a Poisson process: the number of events in one step.
    pub fn count(&mut self, mean: f64) -> usize {
        let limit = (-mean).exp();
        let mut product = self.0.random::<f64>();
        let mut count = 0;
        while product > limit {
            product *= self.0.random::<f64>();
            count += 1;
        }
        count
    }
}

/// A standard normal number that changes slowly: an Ornstein-Uhlenbeck process.
#[derive(Clone, Copy, Default)]
pub struct Slow {
    value: f64,
    at_s: Option<f64>,
}

impl Slow {
    /// Returns the number at `at_s`, for a correlation time in seconds.
    pub fn at(&mut self, at_s: f64, correlation_s: f64, chance: &mut Chance) -> f64 {
        let kept = self
            .at_s
            .map_or(0.0, |before| (-(at_s - before) / correlation_s).exp());
        self.value = kept * self.value + (1.0 - kept * kept).sqrt() * chance.normal();
        self.at_s = Some(at_s);
        self.value
    }
}
