//! HOTA, IDF1 and MOTA as `TrackEval` defines them, and the protocol of published figures.

use std::collections::BTreeMap;

use pathfinding::{kuhn_munkres::kuhn_munkres, matrix::Matrix};
use serde_json::{Value, json};

/// Least overlap of the same person for IDF1 and MOTA.
const THRESHOLD: f64 = 0.5;
/// Thresholds of HOTA: .05, .10, … .95.
const THRESHOLDS: usize = 19;
/// Integer steps of a weight of 1: the assignment compares exactly.
const STEPS: f64 = 1e9;

/// One frame: identities, tracks, and the overlap of each identity with each track.
pub struct Step {
    pub truth: Vec<i64>,
    pub tracks: Vec<i64>,
    pub similarity: Vec<Vec<f64>>,
}

/// Sums over frames, which add up over sequences.
#[derive(Clone, Copy, Default)]
pub struct Sums {
    truth: f64,
    tracks: f64,
    /// The matches of each threshold, and the sum of their association scores.
    hota: [(f64, f64); THRESHOLDS],
    matched: f64,
    switches: f64,
    identified: f64,
    published: Published,
}

/// The protocol of published figures: CLEAR matches without a least overlap, and identities that
/// are in a frame together.
#[derive(Clone, Copy, Default)]
struct Published {
    sequences: f64,
    /// HOTA is a mean over sequences.
    hota: f64,
    matched: f64,
    switches: f64,
    identified: f64,
}

/// The heaviest assignment, complete on the shorter side.
fn assigned(
    rows: usize,
    columns: usize,
    weight: impl Fn(usize, usize) -> f64,
) -> Vec<(usize, usize)> {
    if rows == 0 || columns == 0 {
        return Vec::new();
    }
    let swap = rows > columns;
    let (short, long) = if swap {
        (columns, rows)
    } else {
        (rows, columns)
    };
    let ordered = |(a, b): (usize, usize)| if swap { (b, a) } else { (a, b) };
    #[expect(clippy::cast_possible_truncation, reason = "far below 2^63")]
    let weights = Matrix::from_fn(short, long, |cell| {
        let (row, column) = ordered(cell);
        (weight(row, column) * STEPS).round() as i64
    });
    let (_, matched) = kuhn_munkres(&weights);
    matched.into_iter().enumerate().map(ordered).collect()
}

/// Numbers of identities or tracks: 0, 1, … in order of their first frame.
#[derive(Default)]
struct Numbers {
    known: BTreeMap<i64, usize>,
    frames: Vec<f64>,
}

impl Numbers {
    fn count(&mut self, ids: &[i64]) -> Vec<usize> {
        let mut numbers = Vec::new();
        for id in ids {
            let next = self.known.len();
            let number = *self.known.entry(*id).or_insert(next);
            self.frames.resize(self.known.len(), 0.0);
            self.frames[number] += 1.0;
            numbers.push(number);
        }
        numbers
    }
}

/// Counts of pairs of an identity and a track.
type Pairs = BTreeMap<(usize, usize), f64>;

/// The sum of frames of the best assignment of identities to tracks.
fn identified(pairs: &Pairs, identities: usize, tracks: usize) -> f64 {
    let count = |a, b| pairs.get(&(a, b)).copied().unwrap_or(0.0);
    // Counts are integers: small weights keep the sums in range.
    let best = assigned(identities, tracks, |a, b| count(a, b) / 1e6);
    best.into_iter().map(|(a, b)| count(a, b)).sum()
}

impl Sums {
    /// Returns the sums of one sequence.
    pub fn new(steps: &[Step]) -> Self {
        let (mut truth, mut tracks) = (Numbers::default(), Numbers::default());
        let numbered: Vec<_> = steps
            .iter()
            .map(|step| {
                (
                    truth.count(&step.truth),
                    tracks.count(&step.tracks),
                    &step.similarity,
                )
            })
            .collect();
        let mut sums = Self {
            truth: truth.frames.iter().sum(),
            tracks: tracks.frames.iter().sum(),
            ..Self::default()
        };
        sums.add_hota(&numbered, &truth.frames, &tracks.frames);
        sums.add_clear(&numbered);
        let mut together = Pairs::new();
        for (a, b, similarity) in &numbered {
            for (row, a) in a.iter().enumerate() {
                for (column, b) in b.iter().enumerate() {
                    if similarity[row][column] >= THRESHOLD {
                        *together.entry((*a, *b)).or_default() += 1.0;
                    }
                }
            }
        }
        sums.identified = identified(&together, truth.frames.len(), tracks.frames.len());
        sums.add_published(&numbered, &truth.frames, &tracks.frames);
        sums
    }

    fn add_hota(&mut self, steps: &[Numbered], truth: &[f64], tracks: &[f64]) {
        let mut possible = Pairs::new();
        for (a, b, similarity) in steps {
            let column_sum = |column: usize| similarity.iter().map(|row| row[column]).sum::<f64>();
            let columns: Vec<f64> = (0..b.len()).map(column_sum).collect();
            for (row, a) in a.iter().enumerate() {
                let row_sum: f64 = similarity[row].iter().sum();
                for (column, b) in b.iter().enumerate() {
                    let overlap = similarity[row][column];
                    let either = columns[column] + row_sum - overlap;
                    if either > f64::EPSILON {
                        *possible.entry((*a, *b)).or_default() += overlap / either;
                    }
                }
            }
        }
        let alignment = |a: usize, b: usize| {
            let together = possible.get(&(a, b)).copied().unwrap_or(0.0);
            together / (truth[a] + tracks[b] - together)
        };
        let mut matches = vec![Pairs::new(); THRESHOLDS];
        for (a, b, similarity) in steps {
            let weight =
                |row: usize, column: usize| alignment(a[row], b[column]) * similarity[row][column];
            for (row, column) in assigned(a.len(), b.len(), weight) {
                for (pairs, threshold) in matches.iter_mut().zip(thresholds()) {
                    if similarity[row][column] >= threshold - f64::EPSILON {
                        *pairs.entry((a[row], b[column])).or_default() += 1.0;
                    }
                }
            }
        }
        for (sum, pairs) in self.hota.iter_mut().zip(&matches) {
            for ((a, b), count) in pairs {
                sum.0 += count;
                sum.1 += count * count / (truth[*a] + tracks[*b] - count).max(1.0);
            }
        }
    }

    fn add_clear(&mut self, steps: &[Numbered]) {
        let mut last: BTreeMap<usize, usize> = BTreeMap::new();
        let mut before: BTreeMap<usize, usize> = BTreeMap::new();
        for (a, b, similarity) in steps
            .iter()
            .filter(|(a, b, _)| !a.is_empty() && !b.is_empty())
        {
            let weight = |row: usize, column: usize| {
                let overlap = similarity[row][column];
                let continues = before.get(&a[row]) == Some(&b[column]);
                if overlap >= THRESHOLD - f64::EPSILON {
                    overlap + if continues { 1000.0 } else { 0.0 }
                } else {
                    0.0
                }
            };
            let mut now = BTreeMap::new();
            for (row, column) in assigned(a.len(), b.len(), weight) {
                if weight(row, column) > 0.0 {
                    let (a, b) = (a[row], b[column]);
                    self.matched += 1.0;
                    self.switches += f64::from(last.insert(a, b).is_some_and(|last| last != b));
                    now.insert(a, b);
                }
            }
            before = now;
        }
    }

    fn add_published(&mut self, steps: &[Numbered], truth: &[f64], tracks: &[f64]) {
        let mut last: BTreeMap<usize, usize> = BTreeMap::new();
        let (mut matches, mut together) = (Pairs::new(), Pairs::new());
        let mut published = Published {
            sequences: 1.0,
            ..Published::default()
        };
        for (a, b, similarity) in steps {
            let (mut rows, mut columns) = (
                (0..a.len()).collect::<Vec<_>>(),
                (0..b.len()).collect::<Vec<_>>(),
            );
            for a in a {
                for b in b {
                    *together.entry((*a, *b)).or_default() += 1.0;
                }
            }
            let mut pairs = Vec::new();
            rows.retain(|&row| {
                let known = last.get(&a[row]);
                let at = columns.iter().position(|&column| Some(&b[column]) == known);
                if let Some(at) = at {
                    pairs.push((row, columns.remove(at)));
                }
                at.is_none()
            });
            let weight = |row: usize, column: usize| similarity[rows[row]][columns[column]];
            let new = assigned(rows.len(), columns.len(), weight);
            pairs.extend(
                new.into_iter()
                    .map(|(row, column)| (rows[row], columns[column])),
            );
            for (row, column) in pairs {
                let (a, b) = (a[row], b[column]);
                published.matched += 1.0;
                published.switches += f64::from(last.insert(a, b).is_some_and(|last| last != b));
                *matches.entry((a, b)).or_default() += 1.0;
            }
        }
        published.identified = identified(&together, truth.len(), tracks.len());
        let association: f64 = matches
            .iter()
            .map(|((a, b), count)| count * count / (truth[*a] + tracks[*b] - count))
            .sum();
        let detection = published.matched / (self.truth + self.tracks - published.matched).max(1.0);
        published.hota = (detection * association / published.matched.max(1.0)).sqrt();
        self.published = published;
    }

    /// Adds the sums of another sequence.
    pub fn add(&mut self, other: &Self) {
        self.truth += other.truth;
        self.tracks += other.tracks;
        for (sum, other) in self.hota.iter_mut().zip(&other.hota) {
            *sum = (sum.0 + other.0, sum.1 + other.1);
        }
        self.matched += other.matched;
        self.switches += other.switches;
        self.identified += other.identified;
        let (sum, other) = (&mut self.published, &other.published);
        sum.sequences += other.sequences;
        sum.hota += other.hota;
        sum.matched += other.matched;
        sum.switches += other.switches;
        sum.identified += other.identified;
    }

    fn idf1(&self, identified: f64) -> f64 {
        2.0 * identified / (self.truth + self.tracks).max(1.0)
    }

    fn mota(&self, matched: f64, switches: f64) -> f64 {
        (2.0 * matched - self.tracks - switches) / self.truth.max(1.0)
    }

    /// Returns the figures of a row.
    pub fn figures(&self) -> Value {
        let hota = self.hota.iter().map(|(matched, association)| {
            let detection = matched / (self.truth + self.tracks - matched).max(1.0);
            (detection * association / matched.max(1.0)).sqrt()
        });
        let hota = hota.sum::<f64>() / THRESHOLDS as f64;
        let published = &self.published;
        json!({
            "hota": rounded(hota),
            "idf1": rounded(self.idf1(self.identified)),
            "mota": rounded(self.mota(self.matched, self.switches)),
            "switches": self.switches,
            "published": {
                "hota": rounded(published.hota / published.sequences.max(1.0)),
                "idf1": rounded(self.idf1(published.identified)),
                "mota": rounded(self.mota(published.matched, published.switches)),
                "switches": published.switches,
            },
        })
    }
}

type Numbered<'a> = (Vec<usize>, Vec<usize>, &'a Vec<Vec<f64>>);

fn thresholds() -> impl Iterator<Item = f64> {
    (1..=THRESHOLDS).map(|step| {
        let step = step as f64;
        0.05 * step
    })
}

/// Returns a value with four decimals.
pub fn rounded(value: f64) -> f64 {
    (value * 1e4).round() / 1e4
}
