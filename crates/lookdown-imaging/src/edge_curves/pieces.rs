//! Pieces of chains without corners.

/// Largest distance of a point from the parabola through its piece, pixels.
const TOLERANCE: f64 = 1.0;
/// Shorter pieces say little about a direction, pixels.
const MIN_LENGTH: f64 = 14.0;
/// Points left out at both ends, where a corner bends the edge.
const ENDS: usize = 2;
/// Distance of the supports, in pixels.
const SUPPORT_DISTANCE: f64 = 8.0;
/// Most supports of a piece.
const MAX_SUPPORTS: f64 = 24.0;

/// Splits a chain at its corners.
pub(super) fn smooth(chain: &[[f64; 2]]) -> Vec<&[[f64; 2]]> {
    let mut open = vec![chain];
    let mut pieces = Vec::new();
    while let Some(piece) = open.pop() {
        let (Some(first), Some(last)) = (piece.first(), piece.last()) else {
            continue;
        };
        let length = (last[0] - first[0]).hypot(last[1] - first[1]);
        if piece.len() < 2 * ENDS + 6 {
            continue;
        }
        if length >= 0.5 * count(piece.len()) && is_parabola(piece, *first, *last, length) {
            if length >= MIN_LENGTH {
                pieces.push(&piece[ENDS..piece.len() - ENDS]);
            }
            continue;
        }
        let corner = farthest(piece, *first, *last).clamp(3, piece.len() - 4);
        open.push(&piece[..=corner]);
        open.push(&piece[corner..]);
    }
    pieces
}

fn count(length: usize) -> f64 {
    length as f64
}

/// Index of the point farthest from the chord.
fn farthest(piece: &[[f64; 2]], first: [f64; 2], last: [f64; 2]) -> usize {
    let [x, y] = [last[0] - first[0], last[1] - first[1]];
    let far = |point: &[f64; 2]| {
        let [px, py] = [point[0] - first[0], point[1] - first[1]];
        if x.hypot(y) < 3.0 {
            px.hypot(py)
        } else {
            (px * y - py * x).abs()
        }
    };
    let indexed = piece.iter().enumerate();
    indexed
        .max_by(|a, b| far(a.1).total_cmp(&far(b.1)))
        .map_or(0, |(index, _)| index)
}

/// Returns true if a parabola over the chord describes the piece.
fn is_parabola(piece: &[[f64; 2]], first: [f64; 2], last: [f64; 2], length: f64) -> bool {
    let [x, y] = [(last[0] - first[0]) / length, (last[1] - first[1]) / length];
    let local = |point: &[f64; 2]| {
        let [px, py] = [point[0] - first[0], point[1] - first[1]];
        // Along the chord from -1 to 1, and across it in pixels.
        [2.0 * (px * x + py * y) / length - 1.0, py * x - px * y]
    };
    let mut normal = nalgebra::Matrix3::<f64>::zeros();
    let mut right = nalgebra::Vector3::<f64>::zeros();
    for point in piece {
        let [along, across] = local(point);
        let row = nalgebra::Vector3::new(1.0, along, along * along);
        normal += row * row.transpose();
        right += row * across;
    }
    let Some(cholesky) = normal.cholesky() else {
        return false;
    };
    let coefficients = cholesky.solve(&right);
    let inner = &piece[ENDS..piece.len() - ENDS];
    inner.iter().all(|point| {
        let [along, across] = local(point);
        let fitted = coefficients[0] + along * (coefficients[1] + along * coefficients[2]);
        (across - fitted).abs() <= TOLERANCE
    })
}

/// Averages groups of points to supports, whose noise is smaller.
pub(super) fn supports(piece: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let wanted = (count(piece.len()) / SUPPORT_DISTANCE).clamp(3.0, MAX_SUPPORTS);
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "3 to 24"
    )]
    let wanted = wanted.round() as usize;
    let mean = |index: usize| {
        let group = &piece[index * piece.len() / wanted..(index + 1) * piece.len() / wanted];
        let share = 1.0 / count(group.len()).max(1.0);
        group.iter().fold([0.0, 0.0], |sum, point| {
            [sum[0] + share * point[0], sum[1] + share * point[1]]
        })
    };
    (0..wanted).map(mean).collect()
}
