//! Measures the taught number of persons and its bar on sequences with known numbers.
//!
//! Standard input: one JSON array per sequence of `[persons, [score, …]]`, a frame each, in order
//! of time. Reference frames are drawn from the first quarter, and the second half is scored: mean
//! over sequences, with 20 draws each.

use std::{error::Error, io::stdin};

use lookdown_tracking::taught::{LEAST_SCORE, NumberWithBar, ReferenceFrame, TaughtNumber};
use rand::{SeedableRng, seq::SliceRandom};
use rand_chacha::ChaCha8Rng;

const DRAWS: usize = 20;
/// Most scored frames of a sequence, evenly.
const SCORED: usize = 400;

/// The sums over scored frames.
#[derive(Default)]
struct Sums {
    frames: f64,
    error: f64,
    covered: f64,
    width: f64,
}

impl Sums {
    fn add(&mut self, persons: u32, found: NumberWithBar) {
        let NumberWithBar {
            persons: number,
            low,
            high,
        } = found;
        self.frames += 1.0;
        self.error += (f64::from(persons) - number as f64).abs();
        self.covered += f64::from(u8::from((low..=high).contains(&(persons as usize))));
        self.width += (high - low) as f64;
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut sequences: Vec<Vec<ReferenceFrame>> = Vec::new();
    for line in stdin().lines() {
        let frames: Vec<(u32, Vec<f32>)> = serde_json::from_str(&line?)?;
        let frames = frames.into_iter().map(|(persons, mut scores)| {
            scores.retain(|score| f64::from(*score) >= LEAST_SCORE);
            ReferenceFrame { persons, scores }
        });
        sequences.push(frames.collect());
    }
    println!("told error coverage width; coverage of each sequence");
    for told in [0, 5, 10, 20, 40] {
        let mut random = ChaCha8Rng::seed_from_u64(3);
        let mut rows = Vec::new();
        for frames in &sequences {
            let mut sums = Sums::default();
            let scored = &frames[frames.len() / 2..];
            for _ in 0..if told == 0 { 1 } else { DRAWS } {
                let mut drawn: Vec<usize> = (0..frames.len() / 4).collect();
                drawn.shuffle(&mut random);
                drawn.truncate(told);
                drawn.sort_unstable();
                let drawn: Vec<_> = drawn
                    .into_iter()
                    .map(|index| frames[index].clone())
                    .collect();
                let taught = TaughtNumber::new(&drawn);
                for frame in scored.iter().step_by(scored.len().div_ceil(SCORED)) {
                    let found = if let Some(taught) = &taught {
                        taught.number(&frame.scores)
                    } else {
                        let boxes = frame.scores.iter().filter(|score| **score >= 0.3);
                        NumberWithBar::untaught(boxes.count())
                    };
                    sums.add(frame.persons, found);
                }
            }
            rows.push([sums.error, sums.covered, sums.width].map(|sum| sum / sums.frames));
        }
        let mean =
            |column: usize| rows.iter().map(|row| row[column]).sum::<f64>() / rows.len() as f64;
        let each: Vec<_> = rows.iter().map(|row| format!("{:.2}", row[1])).collect();
        println!(
            "{told} {:.2} {:.3} {:.2}; {}",
            mean(0),
            mean(1),
            mean(2),
            each.join(" ")
        );
    }
    Ok(())
}
