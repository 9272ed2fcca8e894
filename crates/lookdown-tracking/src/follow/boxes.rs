//! Boxes `[x_min, y_min, x_max, y_max]`, pixels.

/// Returns a box with a margin (pixels) on all sides.
pub fn widened([x_min, y_min, x_max, y_max]: [f64; 4], margin: f64) -> [f64; 4] {
    [
        x_min - margin,
        y_min - margin,
        x_max + margin,
        y_max + margin,
    ]
}

/// Returns true if two boxes share more than a border.
pub fn overlap(one: &[f64; 4], other: &[f64; 4]) -> bool {
    one[0] < other[2] && other[0] < one[2] && one[1] < other[3] && other[1] < one[3]
}

/// Returns the intersection over union, 0 to 1.
pub(super) fn iou(one: &[f64; 4], other: &[f64; 4]) -> f64 {
    let side = |at: usize| (one[at + 2].min(other[at + 2]) - one[at].max(other[at])).max(0.0);
    let area = |of: &[f64; 4]| (of[2] - of[0]) * (of[3] - of[1]);
    let both = side(0) * side(1);
    let union = area(one) + area(other) - both;
    if union > 0.0 { both / union } else { 0.0 }
}
