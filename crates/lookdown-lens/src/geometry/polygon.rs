//! Simple polygons: areas whose outline neither crosses nor touches itself.

use nalgebra::{Point2, Vector2};

/// Most corners of a polygon: every edge is compared with every other.
pub const MAX_CORNERS: usize = 64;
/// Far outside any frame or room, and near enough for products of coordinates to mean something.
const MAX_COORDINATE: f64 = 1e6;

/// An area with straight edges, in whatever unit its corners have. Closed: the last corner is
/// followed by the first.
#[derive(Debug, Clone, PartialEq)]
pub struct Polygon {
    corners: Vec<Point2<f64>>,
}

/// From one corner to the next.
pub type Edge = [Point2<f64>; 2];

/// Corners that bound no area. They are counted from 1.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{0}")]
pub struct PolygonError(String);

impl Polygon {
    /// The area within `corners`, which follow each other along its outline, either way around.
    ///
    /// # Errors
    /// [`PolygonError`] when there are fewer than three corners or more than [`MAX_CORNERS`], one
    /// is not finite or beyond a million, or the outline meets itself.
    pub fn new(corners: &[[f64; 2]]) -> Result<Self, PolygonError> {
        if !(3..=MAX_CORNERS).contains(&corners.len()) {
            let count = corners.len();
            let problem = format!("it has {count} corners: give 3 to {MAX_CORNERS}");
            return Err(PolygonError(problem));
        }
        for (index, &[x, y]) in corners.iter().enumerate() {
            // Not so where it is not a number either.
            let is_near = x.abs() <= MAX_COORDINATE && y.abs() <= MAX_COORDINATE;
            if !is_near {
                let number = index + 1;
                return Err(PolygonError(format!(
                    "corner {number} is [{x}, {y}]: give two finite numbers of at most a million \
                     on either side of 0"
                )));
            }
        }
        let polygon = Self {
            corners: corners.iter().copied().map(Point2::from).collect(),
        };
        polygon.check_outline()?;
        Ok(polygon)
    }

    /// A frame of `width` × `height` pixels, corner-origin.
    pub fn for_frame(width: u32, height: u32) -> Self {
        let (width, height) = (f64::from(width), f64::from(height));
        let corners = [(0.0, 0.0), (width, 0.0), (width, height), (0.0, height)];
        Self {
            corners: corners.map(|(x, y)| Point2::new(x, y)).to_vec(),
        }
    }

    /// The corners along the outline.
    pub fn corners(&self) -> &[Point2<f64>] {
        &self.corners
    }

    /// The edges along the outline; the last one leads back to the first corner.
    pub fn edges(&self) -> impl Iterator<Item = Edge> {
        let following = self.corners.iter().cycle().skip(1);
        self.corners.iter().zip(following).map(|(&a, &b)| [a, b])
    }

    /// Returns true for a point inside: a ray from it toward growing x crosses the outline an odd
    /// number of times (the even-odd rule). Of areas with a common edge, one holds a point on it.
    pub fn holds(&self, point: Point2<f64>) -> bool {
        let crossed = self
            .edges()
            .filter_map(|edge| crossing(edge, point.y))
            .filter(|&x| point.x < x);
        crossed.count() % 2 == 1
    }

    /// Returns true for a point inside, or at most `margin` away from the outline.
    pub fn holds_within(&self, point: Point2<f64>, margin: f64) -> bool {
        self.holds(point) || self.edges().any(|edge| distance(edge, point) <= margin)
    }

    /// Returns true when two areas have a point in common, be it one of their outlines.
    pub fn meets(&self, other: &Self) -> bool {
        let crosses = |edge: Edge| other.edges().any(|another| meet(edge, another));
        self.edges().any(crosses) || self.holds(other.corners[0]) || other.holds(self.corners[0])
    }

    /// Returns the width and the height of the bounding box.
    pub fn extent(&self) -> Vector2<f64> {
        let corners = self.corners.iter();
        let (least, most) = corners.fold(
            (self.corners[0], self.corners[0]),
            |(least, most), corner| (least.inf(corner), most.sup(corner)),
        );
        most - least
    }

    /// Returns the share of a frame of `width` × `height` pixels that the area covers, 0 to 1. The
    /// outline is cut at each side of the frame (Sutherland and Hodgman, 1974).
    pub fn share_of_frame(&self, width: u32, height: u32) -> f64 {
        let mut corners = self.corners.clone();
        for [from, to] in Self::for_frame(width, height).edges() {
            let inside = |point: Point2<f64>| (to - from).perp(&(point - from));
            let following: Vec<_> = corners
                .iter()
                .copied()
                .cycle()
                .skip(1)
                .take(corners.len())
                .collect();
            let edges = corners.into_iter().zip(following);
            corners = edges
                .flat_map(|(a, b)| {
                    let (of_a, of_b) = (inside(a), inside(b));
                    let is_cut = (of_a < 0.0) != (of_b < 0.0);
                    let cut = is_cut.then(|| a + (b - a) * (of_a / (of_a - of_b)));
                    (of_a >= 0.0).then_some(a).into_iter().chain(cut)
                })
                .collect();
        }
        let following = corners.iter().cycle().skip(1);
        let twice: f64 = corners
            .iter()
            .zip(following)
            .map(|(a, b)| a.coords.perp(&b.coords))
            .sum();
        twice.abs() / 2.0 / (f64::from(width) * f64::from(height))
    }

    /// The same area with its coordinates multiplied by two factors above 0.
    pub fn scaled(&self, scale_x: f64, scale_y: f64) -> Self {
        let corners = self.corners.iter();
        Self {
            corners: corners
                .map(|corner| Point2::new(corner.x * scale_x, corner.y * scale_y))
                .collect(),
        }
    }

    fn check_outline(&self) -> Result<(), PolygonError> {
        let count = self.corners.len();
        let following = |index: usize| (index + 1) % count;
        let edges: Vec<Edge> = self.edges().collect();
        for (index, [from, to]) in edges.iter().enumerate() {
            if from == to {
                return Err(PolygonError(format!(
                    "corners {} and {} are the same: leave one out (the last corner is joined to \
                     the first by itself)",
                    index + 1,
                    following(index) + 1
                )));
            }
        }
        for (one, edge) in edges.iter().enumerate() {
            for (other, another) in edges.iter().enumerate().skip(one + 1) {
                let is_met = if following(one) == other {
                    folds_back(*edge, *another)
                } else if following(other) == one {
                    folds_back(*another, *edge)
                } else {
                    meet(*edge, *another)
                };
                if is_met {
                    return Err(PolygonError(format!(
                        "the edge from corner {} to {} meets the one from corner {} to {}: list \
                         the corners in the order in which a walk along the outline passes them",
                        one + 1,
                        following(one) + 1,
                        other + 1,
                        following(other) + 1
                    )));
                }
            }
        }
        Ok(())
    }
}

/// Returns the place at which an edge passes the height `y`, if it does; its upper end belongs to
/// it, its lower one does not, so that of two edges which meet there one passes.
pub fn crossing([a, b]: Edge, y: f64) -> Option<f64> {
    // The same number whichever way the edge leads: areas side by side have it both ways.
    let [upper, lower] = if a.y <= b.y { [a, b] } else { [b, a] };
    let passes = upper.y <= y && y < lower.y;
    passes.then(|| upper.x + (lower.x - upper.x) * ((y - upper.y) / (lower.y - upper.y)))
}

/// The distance of a point from an edge.
pub fn distance([a, b]: Edge, point: Point2<f64>) -> f64 {
    let along = b - a;
    let share = (point - a).dot(&along) / along.norm_squared().max(f64::MIN_POSITIVE);
    (a + along * share.clamp(0.0, 1.0) - point).norm()
}

/// On which side of the line through an edge a point lies: 1, −1, or 0 on it.
fn side([a, b]: Edge, point: Point2<f64>) -> i8 {
    let turn = (b - a).perp(&(point - a));
    i8::from(turn > 0.0) - i8::from(turn < 0.0)
}

/// Returns true when two edges have a point in common: each has its ends on both sides of the
/// other's line or on it, and, for those on one line, their bounding boxes meet.
fn meet(one: Edge, other: Edge) -> bool {
    let straddles = |edge: Edge, [a, b]: Edge| side(edge, a) * side(edge, b) <= 0;
    let overlap = |axis: usize| {
        let [(low, high), (other_low, other_high)] = [one, other].map(|[a, b]| {
            let (a, b) = (a[axis], b[axis]);
            (a.min(b), a.max(b))
        });
        low <= other_high && other_low <= high
    };
    overlap(0) && overlap(1) && straddles(one, other) && straddles(other, one)
}

/// Returns true when the second of two consecutive edges leads back along the first.
fn folds_back(one: Edge, [from, to]: Edge) -> bool {
    side(one, to) == 0 && (to - from).dot(&(one[0] - one[1])) > 0.0
}

#[cfg(test)]
mod tests;
