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
                0.900, 0.900, 0.900, 0.900, 0.860, 0.740, 0.700, 0.500, 0.260, 0.140,
            ],
        ),
        (
            50.0,
            [
                0.987, 0.961, 0.934, 0.934, 0.934, 0.934, 0.934, 0.908, 0.829, 0.566,
            ],
        ),
        (
            70.0,
            [
                0.894, 0.864, 0.864, 0.833, 0.803, 0.803, 0.773, 0.742, 0.682, 0.591,
            ],
        ),
        (
            90.0,
            [
                0.894, 0.864, 0.864, 0.833, 0.803, 0.803, 0.773, 0.742, 0.682, 0.591,
            ],
        ),
    ],
    edge: 0.066,
    background: FalseAlarms {
        count: 2.235,
        logit: 0.91,
    },
    parts: FalseAlarms {
        count: 0.376,
        logit: 1.16,
    },
};

/// `balanced` on the 10 photographs.
pub const PHOTOGRAPHS: Figures = Figures {
    recall: [
        (
            30.0,
            [
                0.900, 0.900, 0.900, 0.900, 0.700, 0.500, 0.500, 0.500, 0.300, 0.300,
            ],
        ),
        (
            50.0,
            [
                0.929, 0.929, 0.881, 0.786, 0.786, 0.738, 0.643, 0.643, 0.595, 0.405,
            ],
        ),
        (
            70.0,
            [
                0.823, 0.781, 0.760, 0.740, 0.740, 0.698, 0.594, 0.552, 0.427, 0.177,
            ],
        ),
        (
            90.0,
            [
                0.828, 0.766, 0.714, 0.682, 0.599, 0.516, 0.432, 0.339, 0.193, 0.099,
            ],
        ),
    ],
    edge: 0.08,
    background: FalseAlarms {
        count: 10.000,
        logit: 1.14,
    },
    parts: FalseAlarms {
        count: 0.639,
        logit: 0.84,
    },
};

/// `fast` in the rendered rooms.
pub const RENDERED_FAST: Figures = Figures {
    recall: [
        (
            30.0,
            [
                0.940, 0.900, 0.900, 0.900, 0.900, 0.860, 0.860, 0.860, 0.660, 0.340,
            ],
        ),
        (
            50.0,
            [
                0.961, 0.961, 0.961, 0.961, 0.961, 0.961, 0.961, 0.961, 0.882, 0.776,
            ],
        ),
        (
            70.0,
            [
                0.924, 0.924, 0.894, 0.894, 0.894, 0.894, 0.833, 0.803, 0.773, 0.712,
            ],
        ),
        (
            90.0,
            [
                0.924, 0.924, 0.894, 0.894, 0.894, 0.894, 0.833, 0.803, 0.773, 0.712,
            ],
        ),
    ],
    edge: 0.066,
    background: FalseAlarms {
        count: 2.412,
        logit: 1.03,
    },
    parts: FalseAlarms {
        count: 0.355,
        logit: 1.15,
    },
};

/// `fast` on the photographs.
pub const PHOTOGRAPHS_FAST: Figures = Figures {
    recall: [
        (
            30.0,
            [
                0.700, 0.700, 0.500, 0.500, 0.500, 0.300, 0.300, 0.300, 0.300, 0.300,
            ],
        ),
        (
            50.0,
            [
                0.881, 0.881, 0.881, 0.833, 0.833, 0.786, 0.786, 0.690, 0.595, 0.500,
            ],
        ),
        (
            70.0,
            [
                0.781, 0.760, 0.719, 0.698, 0.677, 0.656, 0.531, 0.469, 0.385, 0.260,
            ],
        ),
        (
            90.0,
            [
                0.714, 0.641, 0.589, 0.526, 0.464, 0.401, 0.328, 0.307, 0.203, 0.120,
            ],
        ),
    ],
    edge: 0.086,
    background: FalseAlarms {
        count: 10.900,
        logit: 1.06,
    },
    parts: FalseAlarms {
        count: 0.711,
        logit: 1.00,
    },
};

impl Figures {
    /// Returns the figures of a name on the command line.
    pub fn of_name(name: &str) -> Option<Self> {
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
