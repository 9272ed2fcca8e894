//! Measured figures of the detector: its misses, false alarms and errors of boxes.
//!
//! `lab/benches/count/measure_detector.py` derives them from detections of `lookdown eval`, with
//! `fusion`.

use lookdown_tracking::follow::logit;

/// Scores at which the recall is measured.
const SCORES: [f64; 10] = [0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9];
/// Least score of a simulated person: the tracker ignores those below 0.06.
pub const SCORE_FLOOR: f64 = SCORES[0];
/// Highest score.
const SCORE_TOP: f64 = 0.99;

/// Measured figures of a profile on one data set.
#[derive(Clone, Copy)]
pub struct Figures {
    /// Recall at each of the scores, up to an angle off the axis in degrees.
    pub recall: [(f64, [f64; SCORES.len()]); 4],
    /// Standard deviation of each edge of the oriented box, as a share of its extent.
    pub edge: f64,
    /// False alarms of the background, per frame.
    pub background: FalseAlarms,
    /// Parts and duplicates, per visible person.
    pub parts: FalseAlarms,
}

/// False alarms from the score floor on.
#[derive(Clone, Copy)]
pub struct FalseAlarms {
    /// Mean number.
    pub count: f64,
    /// Mean of the logit of the score above that of the floor. It is distributed exponentially.
    pub logit: f64,
}

/// `balanced` in the 34 rendered rooms, which have no persons beyond 70°: those are as from 50° on.
pub const RENDERED: Figures = Figures {
    recall: [
        (
            30.0,
            [
                0.940, 0.900, 0.900, 0.900, 0.900, 0.820, 0.780, 0.740, 0.540, 0.220,
            ],
        ),
        (
            50.0,
            [
                0.961, 0.934, 0.934, 0.934, 0.934, 0.934, 0.934, 0.934, 0.882, 0.671,
            ],
        ),
        (
            70.0,
            [
                0.864, 0.864, 0.833, 0.803, 0.803, 0.803, 0.773, 0.773, 0.773, 0.652,
            ],
        ),
        (
            90.0,
            [
                0.864, 0.864, 0.833, 0.803, 0.803, 0.803, 0.773, 0.773, 0.773, 0.652,
            ],
        ),
    ],
    edge: 0.066,
    background: FalseAlarms {
        count: 0.706,
        logit: 0.96,
    },
    parts: FalseAlarms {
        count: 0.258,
        logit: 1.41,
    },
};

/// `balanced` on the 10 photographs.
pub const PHOTOGRAPHS: Figures = Figures {
    recall: [
        (
            30.0,
            [
                0.900, 0.900, 0.900, 0.900, 0.700, 0.500, 0.500, 0.500, 0.500, 0.500,
            ],
        ),
        (
            50.0,
            [
                0.925, 0.925, 0.875, 0.825, 0.775, 0.775, 0.675, 0.625, 0.625, 0.525,
            ],
        ),
        (
            70.0,
            [
                0.877, 0.840, 0.802, 0.783, 0.745, 0.726, 0.670, 0.613, 0.557, 0.387,
            ],
        ),
        (
            90.0,
            [
                0.838, 0.824, 0.796, 0.768, 0.669, 0.655, 0.570, 0.514, 0.444, 0.204,
            ],
        ),
    ],
    edge: 0.079,
    background: FalseAlarms {
        count: 4.9,
        logit: 1.42,
    },
    parts: FalseAlarms {
        count: 0.503,
        logit: 0.8,
    },
};

/// `fast` in the rendered rooms.
pub const RENDERED_FAST: Figures = Figures {
    recall: [
        (
            30.0,
            [
                0.940, 0.900, 0.900, 0.900, 0.900, 0.900, 0.860, 0.820, 0.740, 0.620,
            ],
        ),
        (
            50.0,
            [
                0.961, 0.961, 0.961, 0.961, 0.961, 0.961, 0.961, 0.961, 0.961, 0.908,
            ],
        ),
        (
            70.0,
            [
                0.924, 0.924, 0.894, 0.894, 0.894, 0.894, 0.894, 0.864, 0.833, 0.803,
            ],
        ),
        (
            90.0,
            [
                0.924, 0.924, 0.894, 0.894, 0.894, 0.894, 0.894, 0.864, 0.833, 0.803,
            ],
        ),
    ],
    edge: 0.064,
    background: FalseAlarms {
        count: 1.206,
        logit: 1.12,
    },
    parts: FalseAlarms {
        count: 0.183,
        logit: 1.7,
    },
};

/// `fast` on the photographs.
pub const PHOTOGRAPHS_FAST: Figures = Figures {
    recall: [
        (
            30.0,
            [
                0.700, 0.700, 0.700, 0.700, 0.300, 0.300, 0.300, 0.300, 0.300, 0.300,
            ],
        ),
        (
            50.0,
            [
                0.875, 0.875, 0.875, 0.875, 0.775, 0.775, 0.775, 0.775, 0.725, 0.525,
            ],
        ),
        (
            70.0,
            [
                0.783, 0.783, 0.764, 0.764, 0.689, 0.670, 0.651, 0.613, 0.538, 0.368,
            ],
        ),
        (
            90.0,
            [
                0.838, 0.796, 0.725, 0.655, 0.599, 0.528, 0.458, 0.401, 0.359, 0.246,
            ],
        ),
    ],
    edge: 0.085,
    background: FalseAlarms {
        count: 6.1,
        logit: 1.31,
    },
    parts: FalseAlarms {
        count: 0.593,
        logit: 1.32,
    },
};

impl Figures {
    /// Returns the figures of a name on the command line.
    pub fn from_name(name: &str) -> Option<Self> {
        match name {
            "rendered" => Some(RENDERED),
            "photographs" => Some(PHOTOGRAPHS),
            "rendered-fast" => Some(RENDERED_FAST),
            "photographs-fast" => Some(PHOTOGRAPHS_FAST),
            _ => None,
        }
    }

    /// Returns the logit of a person's score at this angle, for a standard normal number: the score
    /// at which the recall is the share of higher numbers. Minus infinity for a missed person.
    pub fn logit_of_person(&self, off_axis_deg: f64, normal: f64) -> f64 {
        let rows = &self.recall;
        let row = rows.iter().find(|row| off_axis_deg <= row.0);
        let (_, recall) = row.unwrap_or(&rows[rows.len() - 1]);
        let share = distribution(-normal);
        let points = recall.iter().zip(&SCORES).chain([(&0.0, &SCORE_TOP)]);
        let points: Vec<_> = points
            .map(|(&recall, &score)| (recall, logit(score)))
            .collect();
        let pairs = points.windows(2).map(|pair| (pair[0], pair[1]));
        let mut between = pairs.filter(|(first, last)| (last.0..first.0).contains(&share));
        between.next().map_or(f64::NEG_INFINITY, |(first, last)| {
            first.1 + (last.1 - first.1) * (first.0 - share) / (first.0 - last.0)
        })
    }
}

impl FalseAlarms {
    /// Returns the logit of a score, for a standard normal number.
    pub fn logit_of(&self, normal: f64) -> f64 {
        let share = distribution(-normal).max(f64::MIN_POSITIVE);
        logit(SCORE_FLOOR) - self.logit * share.ln()
    }
}

/// The distribution function of the standard normal distribution (Abramowitz and Stegun (1964),
/// 26.2.17).
fn distribution(x: f64) -> f64 {
    if x < 0.0 {
        return 1.0 - distribution(-x);
    }
    let t = 1.0 / (1.0 + 0.231_641_9 * x);
    let factors = [
        0.319_381_530,
        -0.356_563_782,
        1.781_477_937,
        -1.821_255_978,
        1.330_274_429,
    ];
    let sum = factors
        .iter()
        .rev()
        .fold(0.0, |sum, factor| (sum + factor) * t);
    1.0 - (-x * x / 2.0).exp() / std::f64::consts::TAU.sqrt() * sum
}
