//! The fit of a camera: starts, the best maximum, its uncertainty, and reasons to refuse it.

use std::f64::consts::FRAC_PI_2;

use super::{
    camera::{RoomCamera, ideal_shape_slope},
    climb::climb,
    edge_curve::EdgeCurve,
    evaluation::Evaluation,
    prior::Prior,
    refusal::FitRefusal,
    search,
    upright::upright,
};
use crate::geometry::Ray;

/// Curves of the first steps: the longest.
const COARSE_CURVES: usize = 300;
/// Starts that are followed.
const COARSE_STARTS: usize = 12;
/// Maxima that are followed with all curves.
const FINE_STARTS: usize = 4;
/// Fewer curves do not determine a camera.
const MIN_CURVES: usize = 60;
/// Less evidence (logarithm of the likelihood ratio) may be chance.
const MIN_EVIDENCE: f64 = 100.0;
/// Least evidence in a cluttered room.
const CLUTTERED_EVIDENCE: f64 = 150.0;
/// Least share of the edges along each of the three directions.
const MIN_SHARE: f64 = 0.02;
/// So many edges along a direction are enough, however many there are along the others.
const MIN_ALONG: f64 = 15.0;
/// Least share of the edges along any of them.
const MIN_SHARES: f64 = 0.45;
/// Least share along any of them in a cluttered room, where most edges follow none: things of all
/// shapes do not make the edges of the walls less exact.
const CLUTTERED_SHARES: f64 = 0.25;
/// A second maximum with so much less evidence is within reach.
const RIVAL_EVIDENCE: f64 = 12.0;
/// Difference of two maxima that matters: share of the radius, and radians of the level.
const RIVAL_DISTANCE: (f64, f64) = (0.03, 0.026);
/// Largest uncertainty of the radius, as a share, and of the level, degrees.
const MAX_UNCERTAINTY: (f64, f64) = (0.028, 0.8);
/// Standard deviation of the second coefficient of a lens from that of an ideal lens. A wider one
/// exchanges curvature at the rim for focal length, and makes the middle too large.
const K2_SIGMA: f64 = 0.0015;
/// Errors of the radius are larger than the edges say, because no lens is exactly one of the
/// family: by this factor, and by this share of the radius however many edges there are. 68 % of
/// 177 errors in rendered frames are within 0.8 of the deviations that result, 95 % within 2.0.
const LENS_MISFIT: f64 = 1.4;
const LENS_FLOOR: f64 = 0.003;
/// Standard deviation of the radius, as a share, from which further starts look for rivals.
const FLAT: f64 = 0.006;
/// Vertical scales of the room of these starts.
const STRETCHES: [f64; 4] = [0.8, 0.9, 1.12, 1.25];
/// Most rounds of these starts: a further one only if one of them was better.
const STRETCH_ROUNDS: usize = 2;
/// Largest difference of a fit of half of the edges.
const MAX_HALF: (f64, f64) = (0.03, 2.0);
/// Differences within so many standard deviations of the fit of the half are not a disagreement.
const HALF_DEVIATIONS: f64 = 2.5;

/// A lens circle, detected or assumed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CircleGuess {
    /// Center in pixels.
    pub center: [f64; 2],
    /// Radius in pixels.
    pub radius: f64,
    /// Standard deviation of the optical center from it, pixels.
    pub center_sigma: f64,
}

/// Values that are kept.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct KnownLens {
    /// Field of view of the circle, radians.
    pub field_of_view: Option<f64>,
    /// First coefficient of an ideal lens: 0 equidistant, -1/24 equisolid, 1/12 stereographic, -1/6
    /// orthographic.
    pub k1: Option<f64>,
}

/// Standard deviations of a fit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FitUncertainty {
    /// Largest share of the radius between 20° and 80° from the axis.
    pub radius: f64,
    /// Pixels.
    pub center: f64,
    /// Degrees.
    pub level_deg: f64,
}

/// A camera from the edges of a room.
#[derive(Debug, Clone, PartialEq)]
pub struct RoomFit {
    /// Focal length in pixels.
    pub focal: f64,
    /// Coefficients of a Kannala-Brandt lens.
    pub k: [f64; 4],
    /// Center in pixels.
    pub center: [f64; 2],
    /// Angle at the circle, radians.
    pub max_theta: f64,
    /// Vertical and two horizontal directions of edges, in the camera frame; the first is down.
    pub directions: [Ray; 3],
    /// Share of the length of all edges along one of the directions.
    pub explained: f64,
    /// Number of edges.
    pub edges: usize,
    /// Standard deviations.
    pub uncertainty: FitUncertainty,
}

impl RoomFit {
    /// Fits a camera to the edges of its frames. Circles are tried in turn, a later one must
    /// explain the edges clearly better than those before. The result is deterministic.
    ///
    /// # Errors
    /// [`FitRefusal`] when the edges do not determine the camera.
    pub fn of(
        frames: &[Vec<EdgeCurve>],
        circles: &[CircleGuess],
        known: KnownLens,
    ) -> Result<Self, FitRefusal> {
        let all = frames.concat();
        let curves = all.as_slice();
        let edges = curves.len() / frames.len().max(1);
        if edges < MIN_CURVES {
            return Err(FitRefusal::TooFewEdges { edges });
        }
        // Frames of one camera show the same edges, so they are not independent evidence.
        #[expect(clippy::cast_precision_loss, reason = "a few frames")]
        let weight = 1.0 / frames.len() as f64;
        let mut best: Option<(Vec<Maximum>, Prior)> = None;
        let mut others: Vec<Maximum> = Vec::new();
        for (index, circle) in circles.iter().enumerate() {
            let prior = prior(circle, known);
            let found = maxima(curves, weight, &prior, known);
            let Some(first) = found.first() else { continue };
            let least = if index == 0 { 0.0 } else { CLEARLY_BETTER };
            let before = best.as_ref().and_then(|(maxima, _)| maxima.first());
            if before
                .is_none_or(|before| first.evaluation.evidence > before.evaluation.evidence + least)
            {
                let worse = best.replace((found, prior));
                others.extend(worse.into_iter().flat_map(|(maxima, _)| maxima));
            } else {
                others.extend(found);
            }
        }
        let (mut maxima, prior) = best.ok_or(FitRefusal::NoDirections { explained: 0.0 })?;
        // The camera of another circle is a rival, too.
        maxima.extend(others);
        checked(curves, weight, &maxima, &prior)
    }
}

/// Evidence by which a further circle must be better.
const CLEARLY_BETTER: f64 = 3.0;

/// A maximum of the evidence.
struct Maximum {
    camera: RoomCamera,
    evaluation: Evaluation,
    /// False if another direction may as well be the vertical.
    is_upright: bool,
}

impl Maximum {
    fn of(camera: RoomCamera, evaluation: Evaluation) -> Self {
        Self {
            camera,
            evaluation,
            is_upright: true,
        }
    }
}

fn prior(circle: &CircleGuess, known: KnownLens) -> Prior {
    let half = known.field_of_view.map(|field| (field / 2.0, 1e-3));
    Prior {
        center: circle.center,
        center_sigma: circle.center_sigma,
        radius: circle.radius,
        k1: known.k1.map_or((-0.03, 0.15), |k1| (k1, 1e-4)),
        k2_sigma: if known.k1.is_some() { 1e-5 } else { K2_SIGMA },
        rim: half.unwrap_or((FRAC_PI_2, 0.22)),
    }
}

/// The best maxima, best first, each different from the others.
fn maxima(curves: &[EdgeCurve], weight: f64, prior: &Prior, known: KnownLens) -> Vec<Maximum> {
    let mut longest = curves.to_vec();
    longest.sort_by_key(|segment| std::cmp::Reverse(segment.points.len()));
    longest.truncate(COARSE_CURVES);
    let weights = vec![weight; curves.len()];
    let rim = known.field_of_view.map(|field| field / 2.0);
    let mut coarse: Vec<Maximum> = Vec::new();
    for start in search::starts(&longest, prior, rim, known.k1) {
        let mut found = None;
        let mut camera = start;
        for (blur, steps) in [(6.0, 5), (3.0, 5), (1.5, 6)] {
            found = climb(camera.clone(), &longest, &weights, prior, blur, steps);
            let Some((next, _)) = &found else { break };
            camera = next.clone();
        }
        coarse.extend(found.map(|(camera, evaluation)| Maximum::of(camera, evaluation)));
        if coarse.len() == COARSE_STARTS {
            break;
        }
    }
    best_first(&mut coarse);
    let mut fine: Vec<Maximum> = Vec::new();
    let mut tried: Vec<RoomCamera> = Vec::new();
    for Maximum { camera, .. } in coarse {
        let is_known = tried.iter().any(|other| {
            let (radius, level) = distance(&camera, other);
            radius < 0.01 && level < 0.02
        });
        if is_known || tried.len() == FINE_STARTS {
            continue;
        }
        tried.push(camera.clone());
        let found = climb(camera, curves, &weights, prior, 1.5, 4)
            .and_then(|(camera, _)| climb(camera, curves, &weights, prior, 1.0, 12));
        fine.extend(found.map(|(camera, evaluation)| Maximum::of(camera, evaluation)));
    }
    best_first(&mut fine);
    add_stretched(&mut fine, curves, &weights, prior);
    for maximum in &mut fine {
        (maximum.camera, maximum.is_upright) =
            upright(&maximum.camera, curves, &maximum.evaluation, prior.radius);
    }
    fine
}

/// Adds the maxima that are reached from stretched cameras, where the edges hardly determine the
/// lens, and sorts all of them. If a camera looks straight down, a room of another height with
/// another lens has nearly the same edges.
fn add_stretched(fine: &mut Vec<Maximum>, curves: &[EdgeCurve], weights: &[f64], prior: &Prior) {
    for _ in 0..STRETCH_ROUNDS {
        let Some(best) = fine.first().filter(|best| is_flat(best)) else {
            break;
        };
        let (camera, evidence) = (best.camera.clone(), best.evaluation.evidence);
        for start in STRETCHES
            .iter()
            .filter_map(|share| camera.stretched(*share))
        {
            let found = climb(start, curves, weights, prior, 1.5, 4)
                .and_then(|(camera, _)| climb(camera, curves, weights, prior, 1.0, 10));
            fine.extend(found.map(|(camera, evaluation)| Maximum::of(camera, evaluation)));
        }
        best_first(fine);
        if fine[0].evaluation.evidence < evidence + 1.0 {
            break;
        }
    }
}

fn best_first(maxima: &mut [Maximum]) {
    maxima.sort_by(|a, b| b.evaluation.evidence.total_cmp(&a.evaluation.evidence));
}

/// Largest relative difference of the radius between 20° and 80°, and the angle between verticals.
fn distance(one: &RoomCamera, other: &RoomCamera) -> (f64, f64) {
    let radius = angles().map(|theta| {
        (one.focal * one.curve(theta).0 / (other.focal * other.curve(theta).0) - 1.0).abs()
    });
    let level = (one.room * Ray::z()).angle(&(other.room * Ray::z()));
    (radius.fold(0.0, f64::max), level)
}

/// 20° to 80°, radians.
fn angles() -> impl Iterator<Item = f64> {
    (2..=8).map(|tens| (10.0 * f64::from(tens)).to_radians())
}

fn checked(
    curves: &[EdgeCurve],
    weight: f64,
    maxima: &[Maximum],
    prior: &Prior,
) -> Result<RoomFit, FitRefusal> {
    let Some(Maximum {
        camera,
        evaluation,
        is_upright,
    }) = maxima.first()
    else {
        return Err(FitRefusal::NoDirections { explained: 0.0 });
    };
    let explained: f64 = evaluation.shares.iter().sum();
    if !has_order(explained, evaluation.evidence) {
        return Err(FitRefusal::NoDirections { explained });
    }
    #[expect(clippy::cast_precision_loss, reason = "a few thousand edges")]
    let edges = weight * curves.len() as f64;
    let is_missing = |share: &f64| *share < MIN_SHARE && share * edges < MIN_ALONG;
    if evaluation.shares.iter().any(is_missing) {
        return Err(FitRefusal::MissingDirection);
    }
    if !is_upright {
        return Err(FitRefusal::VerticalUnclear);
    }
    let is_rival = |rival: &Maximum| {
        let (radius, level) = distance(camera, &rival.camera);
        let is_near = evaluation.evidence - rival.evaluation.evidence < RIVAL_EVIDENCE;
        is_near && (radius > RIVAL_DISTANCE.0 || level > RIVAL_DISTANCE.1)
    };
    if maxima[1..].iter().any(is_rival) {
        return Err(FitRefusal::Ambiguous);
    }
    let mut uncertainty = curvature(camera, evaluation).ok_or(FitRefusal::Ambiguous)?;
    let mut disagreement: Option<(f64, f64)> = None;
    let (mut squares, mut center_squares) = ([0.0; 2], 0.0);
    for half in 0..4_usize {
        // Two interleaved halves, then two halves of the image.
        let weights: Vec<f64> = curves
            .iter()
            .enumerate()
            .map(|(index, curve)| {
                let first = curve.points[0];
                let side = match half {
                    0 | 1 => index % 2 == half,
                    _ => (first[0] < camera.center[0]) == (half == 2),
                };
                if side { weight } else { 0.0 }
            })
            .collect();
        let found = climb(camera.clone(), curves, &weights, prior, 1.0, 6);
        let (other, of_half) = found.ok_or(FitRefusal::Ambiguous)?;
        let (apart, turned) = distance(camera, &other);
        let own = curvature(&other, &of_half).ok_or(FitRefusal::Ambiguous)?;
        let limits = (
            MAX_HALF.0.max(HALF_DEVIATIONS * own.radius),
            MAX_HALF.1.max(HALF_DEVIATIONS * own.level_deg),
        );
        if apart > limits.0 || turned.to_degrees() > limits.1 {
            let (radius, level) = disagreement.unwrap_or_default();
            disagreement = Some((radius.max(apart), level.max(turned.to_degrees())));
        }
        if half < 2 {
            squares[0] += apart * apart / 2.0;
            squares[1] += turned.to_degrees().powi(2) / 2.0;
            let [x, y] = [0, 1].map(|axis| other.center[axis] - camera.center[axis]);
            center_squares += f64::midpoint(x * x, y * y);
        }
    }
    let edges = uncertainty.radius.max(squares[0].sqrt());
    uncertainty.radius = (LENS_MISFIT * edges).hypot(LENS_FLOOR);
    uncertainty.level_deg = uncertainty.level_deg.max(squares[1].sqrt());
    uncertainty.center = uncertainty.center.max(center_squares.sqrt());
    if uncertainty.radius > MAX_UNCERTAINTY.0 || uncertainty.level_deg > MAX_UNCERTAINTY.1 {
        return Err(FitRefusal::Uncertain {
            radius_percent: 100.0 * uncertainty.radius,
            level_deg: uncertainty.level_deg,
        });
    }
    if let Some((radius, level)) = disagreement {
        return Err(FitRefusal::HalvesDisagree {
            radius_percent: 100.0 * radius,
            level_deg: level,
        });
    }
    let [k1, k2, k3] = camera.shape();
    Ok(RoomFit {
        focal: camera.focal,
        k: [k1, k2, k3, 0.0],
        center: camera.center,
        max_theta: camera.theta(prior.radius).ok_or(FitRefusal::Ambiguous)?,
        directions: camera.directions(),
        explained,
        edges: curves.len(),
        uncertainty,
    })
}

/// Returns true if the edges along the directions are more than chance.
fn has_order(explained: f64, evidence: f64) -> bool {
    explained >= MIN_SHARES && evidence >= MIN_EVIDENCE
        || explained >= CLUTTERED_SHARES && evidence >= CLUTTERED_EVIDENCE
}

/// Returns true if the edges hardly determine the lens.
fn is_flat(maximum: &Maximum) -> bool {
    curvature(&maximum.camera, &maximum.evaluation)
        .is_none_or(|uncertainty| uncertainty.radius > FLAT)
}

/// Standard deviations from the curvature of the evidence.
fn curvature(camera: &RoomCamera, evaluation: &Evaluation) -> Option<FitUncertainty> {
    let covariance = evaluation.normal.clone().try_inverse()?;
    let ideal = ideal_shape_slope(camera.k1);
    let radius = angles().map(|theta| {
        let (radius, _) = camera.curve(theta);
        let (square, cube) = (theta * theta, theta.powi(3));
        let along = cube * (ideal[0] + square * (ideal[1] + square * ideal[2]));
        let slopes = [1.0, along / radius, cube * square / radius];
        let mut variance = 0.0;
        for (row, slope) in slopes.iter().enumerate() {
            for (column, other) in slopes.iter().enumerate() {
                variance += slope * other * covariance[(row, column)];
            }
        }
        variance.max(0.0).sqrt()
    });
    let both =
        |first: usize| (covariance[(first, first)] + covariance[(first + 1, first + 1)]).sqrt();
    Some(FitUncertainty {
        radius: radius.fold(0.0, f64::max),
        center: both(3),
        level_deg: both(5).to_degrees(),
    })
}
