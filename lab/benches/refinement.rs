//! Benchmarks of refinements of 100,000 candidates, in milliseconds (median and minimum of many
//! rounds): `cargo bench --bench refinement`.
//!
//! `raw-like` has the candidates of a score floor of 0.01: a hundred persons in many views, and
//! background with mostly low scores. `random` and `strong` have no persons; of `random`,
//! 7 % reach the score threshold, of `strong` 70 %.

#[path = "support/times.rs"]
mod times;

use std::{error::Error, hint::black_box};

use lookdown_detect::detection::{BBox, Candidate, Refinement, RefinementParameters, refine};
use strum::VariantArray;

use self::times::times;

const CANDIDATES: usize = 100_000;
const FRAME_SIDE: f64 = 1680.0;
const VIEWS: f64 = 24.0;
const SCORE_FLOOR: f64 = 0.01;
const SCORE_THRESHOLD: f64 = 0.3;
const ROUNDS: usize = 15;

type Outcome<T> = Result<T, Box<dyn Error>>;

fn main() -> Outcome<()> {
    for (name, candidates) in [
        ("raw-like", raw_like()?),
        ("random", random(0.07)?),
        ("strong", random(0.7)?),
    ] {
        for &refinement in Refinement::VARIANTS {
            let parameters = RefinementParameters {
                refinement,
                iou_threshold: 0.5,
                sigma: 0.3,
                score_threshold: SCORE_THRESHOLD,
                max_detections: 1000,
            };
            let found = refine(&candidates, &parameters).len();
            let time = times(ROUNDS, || {
                black_box(refine(&candidates, &parameters));
            });
            println!("{name}, {refinement}: {time}, {found} found");
        }
    }
    Ok(())
}

/// A tenth of the candidates are boxes of a hundred persons with small deviations. The others have
/// random positions, and high scores are rare.
fn raw_like() -> Outcome<Vec<Candidate>> {
    let mut noise = Noise(7);
    let mut candidates = Vec::with_capacity(CANDIDATES);
    let persons: Vec<[f64; 4]> = (0..100).map(|_| noise.place()).collect();
    for number in 0..CANDIDATES / 10 {
        let [x, y, width, height] = persons[number % persons.len()];
        let mut off = |side: f64| side * 0.15 * (noise.share() - 0.5);
        let place = [
            x + off(width),
            y + off(height),
            width + off(width),
            height + off(height),
        ];
        candidates.push(noise.candidate(place, 1.0)?);
    }
    while candidates.len() < CANDIDATES {
        let place = noise.place();
        candidates.push(noise.candidate(place, 8.0)?);
    }
    Ok(candidates)
}

/// Candidates at random positions; the fraction `strong` reaches the score threshold.
fn random(strong: f64) -> Outcome<Vec<Candidate>> {
    let mut noise = Noise(7);
    let threshold = (SCORE_THRESHOLD - SCORE_FLOOR) / (1.0 - SCORE_FLOOR);
    let exponent = threshold.ln() / (1.0 - strong).ln();
    (0..CANDIDATES)
        .map(|_| {
            let place = noise.place();
            noise.candidate(place, exponent)
        })
        .collect()
}

/// Random numbers, the same in every run (Knuth's 64-bit linear congruential generator).
struct Noise(u64);

impl Noise {
    /// At least 0, below 1.
    fn share(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Left, top, width and height of a person anywhere in the frame, 30 to 150 pixels a side.
    fn place(&mut self) -> [f64; 4] {
        let [width, height] = [(); 2].map(|()| 30.0 + 120.0 * self.share());
        let [x, y] = [width, height].map(|side| (FRAME_SIDE - side) * self.share());
        [x, y, width, height]
    }

    /// A candidate at this position; a greater `exponent` makes high scores rarer.
    fn candidate(&mut self, [x, y, width, height]: [f64; 4], exponent: f64) -> Outcome<Candidate> {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "below 24"
        )]
        let view = (self.share() * VIEWS) as usize;
        Ok(Candidate {
            bbox: BBox::new([x, y, x + width, y + height])?,
            score: SCORE_FLOOR + (1.0 - SCORE_FLOOR) * self.share().powf(exponent),
            view,
            coordinate_weight: if self.share() < 0.2 { 0.1 } else { 1.0 },
            expected_views: 1.0 + 5.0 * self.share(),
        })
    }
}
