//! The fit of a camera: the best maximum, its uncertainty, and reasons to refuse it.
//!
//! Standard deviations from a bootstrap over the edges.
//!
//! A fit to edges that are drawn again, with replacement, moves by one step of Newton,
//! `H^-1 (sum of m_i g_i)`: `H` is the curvature of the evidence, `g_i` the slope of the evidence
//! of group `i`, and `m_i` how often it was drawn. The covariance of these steps is
//! `H^-1 S H^-1` with the scatter `S` of the slopes (B. Efron, "Bootstrap methods: another look at
//! the jackknife", Annals of Statistics 7 (1), 1979), so nothing has to be drawn.

use std::f64::consts::FRAC_PI_2;

use nalgebra::{Matrix3, Rotation3};

use super::{
    camera::{Angles, MIN_SLOPE, RoomCamera, curve, ideal_shape},
    evidence::{EdgeCurve, evaluate, followed_direction},
    known_camera::{IdealLens, KnownCamera},
    maxima::{Maximum, climb, fine_maxima, maxima},
    prior::{CircleGuess, Evaluation, Normal, Parameters, Prior},
    refusal::FitRefusal,
    search::has_lens,
    uncertainty::{FitUncertainty, deviations, distance, loose_covariance, loose_curvature},
};
use crate::geometry::Ray;

/// Fewer curves do not determine a camera.
const MIN_CURVES: usize = 60;
/// Less evidence (logarithm of the likelihood ratio) may be chance.
const MIN_EVIDENCE: f64 = 100.0;
/// Least evidence in a cluttered room.
const CLUTTERED_EVIDENCE: f64 = 150.0;
/// Least share of the edges along each of the three directions.
const MIN_SHARE: f64 = 0.015;
/// So many edges along a direction are enough, however many there are along the others.
const MIN_ALONG: f64 = 10.0;
/// Least share of the edges along any of them.
const MIN_SHARES: f64 = 0.45;
/// Least share along any of them in a cluttered room, where most edges follow none: things of all
/// shapes do not make the edges of the walls less exact.
const CLUTTERED_SHARES: f64 = 0.30;
/// A second maximum with so much less evidence is within reach.
const RIVAL_EVIDENCE: f64 = 12.0;
/// Difference of two maxima that matters: share of the radius, and radians of the level.
const RIVAL_DISTANCE: (f64, f64) = (0.03, 0.026);
/// Part of the share of explained edges that a frame of the same camera has at least.
const STRANGER_SHARE: f64 = 0.6;
/// Difference of the radius, as a share, between a known lens and one that the edges like better.
const CONTRADICTION_DISTANCE: f64 = 0.02;
/// Largest uncertainty of the radius, as a share, and of the level, degrees.
const MAX_UNCERTAINTY: (f64, f64) = (0.026, 0.8);
/// Standard deviation of the second coefficient of a lens from that of an ideal lens. A wider one
/// exchanges curvature at the rim for focal length, and makes the middle too large.
const K2_SIGMA: f64 = 0.0015;
/// Standard deviation of the known angle at the circle, radians: detected circles are not exact.
const KNOWN_RIM: f64 = 5e-3;
/// Errors are larger than the edges say, because no lens is exactly one of the family and edges
/// come in groups: by this factor, and for the radius by this share however many edges there are.
const MISFIT: f64 = 1.2;
const LENS_FLOOR: f64 = 0.003;
/// If so much of the length of all edges follows three directions, few of the others are clutter.
pub const CLEARLY_EXPLAINED: f64 = 0.5;
/// Errors are larger where things of all shapes stand nearly along the walls: by this factor for
/// each unit by which less than [`CLEARLY_EXPLAINED`] is explained.
const CLUTTER_MISFIT: f64 = 4.0;

/// The largest angle from the axis that a lens without a visible circle is taken to see, radians:
/// few lenses have more than 200°.
const MAX_UNSEEN_THETA: f64 = 1.745;
/// Precision of that angle, radians.
const STEP_BEYOND: f64 = 0.001;

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
    /// Pixels of the frame per pixel of the raster in which the edges were found.
    pub edge_scale: f64,
    /// Standard deviations.
    pub uncertainty: FitUncertainty,
    /// False if no frame shows a lens circle, so that the angle at it says nothing about the lens.
    pub is_circle_detected: bool,
}

impl RoomFit {
    /// Returns the camera without a lens circle, whose image reaches to a distance from the center,
    /// in pixels, and to 100° from the axis at most.
    pub fn without_circle(self, distance: f64) -> Self {
        let [k1, k2, k3, _] = self.k;
        let is_within = |theta: &f64| {
            let (radius, slope) = curve([k1, k2, k3], *theta);
            slope > MIN_SLOPE && self.focal * radius <= distance
        };
        let beyond = (1..)
            .map(|step| self.max_theta + STEP_BEYOND * f64::from(step))
            .take_while(|theta| *theta <= MAX_UNSEEN_THETA && is_within(theta));
        Self {
            max_theta: beyond.last().unwrap_or(self.max_theta),
            is_circle_detected: false,
            ..self
        }
    }

    /// Fits a camera to the edges of its frames. Circles are tried in turn, a later one must
    /// explain the edges clearly better than those before. The result is deterministic.
    ///
    /// # Errors
    /// [`FitRefusal`] when the edges do not determine the camera.
    pub fn new(
        frames: &[Vec<EdgeCurve>],
        circles: &[CircleGuess],
        known: KnownCamera,
    ) -> Result<Self, FitRefusal> {
        let all = frames.concat();
        let curves = all.as_slice();
        let edges = curves.len() / frames.len().max(1);
        if edges < MIN_CURVES {
            return Err(FitRefusal::TooFewEdges { edges });
        }
        // Frames of one camera show the same edges, so they are not independent evidence.
        let weight = 1.0 / frames.len() as f64;
        let mut best: Option<(Vec<Maximum>, Prior)> = None;
        let mut others: Vec<Maximum> = Vec::new();
        for circle in circles {
            let prior = prior(circle, known);
            if !has_lens(&prior, known) {
                return Err(FitRefusal::NoSuchLens);
            }
            // Directions that are clear with one circle are those with another one.
            let clear = best.as_ref().filter(|(maxima, _)| is_ordered(maxima));
            let mut found = match clear {
                Some((maxima, _)) => {
                    let starts = maxima.iter().map(|maximum| maximum.camera.clone());
                    fine_maxima(starts, curves, weight, &prior)
                }
                None => maxima(curves, weight, &prior, known),
            };
            if best.is_some() {
                for maximum in &mut found {
                    maximum.evaluation.evidence -= OTHER_CIRCLE;
                }
            }
            let Some(first) = found.first() else { continue };
            let before = best.as_ref().and_then(|(maxima, _)| maxima.first());
            if before.is_none_or(|before| first.evaluation.evidence > before.evaluation.evidence) {
                let worse = best.replace((found, prior));
                others.extend(worse.into_iter().flat_map(|(maxima, _)| maxima));
            } else {
                others.extend(found);
            }
        }
        let (mut maxima, prior) = best.ok_or(FitRefusal::NoDirections { explained: 0.0 })?;
        // The camera of another circle is a rival, too.
        maxima.extend(others);
        let fit = checked(curves, weight, &maxima, &prior);
        let Some(found) = maxima.first() else {
            return fit;
        };
        if let Ok(fit) = &fit
            && let Some(refusal) = stranger(frames, found, fit.explained)
        {
            return Err(refusal);
        }
        // False values are the cause of other refusals as well.
        match contradiction(curves, weight, found, &prior, known) {
            Some(field_of_view_deg) => Err(FitRefusal::Contradicted {
                field_of_view_deg,
                explained: found.explained(),
            }),
            None => fit,
        }
    }
}

/// Evidence that a circle after the first one loses: it is wrong more often, and it leaves the
/// center more room.
const OTHER_CIRCLE: f64 = 6.0;

fn is_ordered(maxima: &[Maximum]) -> bool {
    maxima
        .first()
        .is_some_and(|first| has_order(first.explained(), first.evaluation.evidence))
}

pub(super) fn prior(circle: &CircleGuess, known: KnownCamera) -> Prior {
    let k1 = known.lens.map(IdealLens::k1);
    let rim = known
        .field_of_view
        .map(|field| (field.max_theta(), KNOWN_RIM));
    Prior {
        circle: *circle,
        k1: k1.map_or((-0.03, 0.15), |k1| (k1, 1e-4)),
        k2_sigma: if k1.is_some() { 1e-5 } else { K2_SIGMA },
        rim: rim.unwrap_or((FRAC_PI_2, 0.22)),
        is_on_ceiling: known.is_on_ceiling,
    }
}

/// Returns the refusal of a frame whose edges do not follow the camera of all frames, if there is
/// one.
fn stranger(frames: &[Vec<EdgeCurve>], found: &Maximum, explained: f64) -> Option<FitRefusal> {
    let mut responsibilities = found.evaluation.explained.iter();
    let shares = frames.iter().map(|curves| {
        let lengths = curves.iter().map(EdgeCurve::length);
        let along: f64 = lengths
            .clone()
            .zip(responsibilities.by_ref())
            .map(|(length, share)| length * share)
            .sum();
        along / lengths.sum::<f64>().max(1e-9)
    });
    let shares: Vec<f64> = shares.collect();
    let index = shares
        .iter()
        .position(|share| *share < STRANGER_SHARE * explained)?;
    Some(FitRefusal::FrameDisagrees {
        frame: index + 1,
        explained: shares[index],
    })
}

/// Returns the field of view in degrees of another lens that explains the edges clearly better than
/// the known values permit, if there is one.
fn contradiction(
    curves: &[EdgeCurve],
    weight: f64,
    found: &Maximum,
    within: &Prior,
    known: KnownCamera,
) -> Option<f64> {
    if known.lens.is_none() && known.field_of_view.is_none() {
        return None;
    }
    let free = KnownCamera {
        is_on_ceiling: known.is_on_ceiling,
        ..KnownCamera::default()
    };
    let free = prior(&within.circle, free);
    let others = fine_maxima([found.camera.clone()].into_iter(), curves, weight, &free);
    let other = others.first()?;
    let gain = other.evaluation.evidence - found.evaluation.evidence;
    let (radius, _) = distance(&found.camera, &other.camera);
    if gain < RIVAL_EVIDENCE || radius < CONTRADICTION_DISTANCE {
        return None;
    }
    // Edges that do not determine a lens do not contradict one.
    let other = checked(curves, weight, &others, &free).ok()?;
    Some(2.0 * other.max_theta.to_degrees())
}

fn checked(
    curves: &[EdgeCurve],
    weight: f64,
    maxima: &[Maximum],
    prior: &Prior,
) -> Result<RoomFit, FitRefusal> {
    let Some(best) = maxima.first() else {
        return Err(FitRefusal::NoDirections { explained: 0.0 });
    };
    let Maximum {
        camera,
        evaluation,
        is_upright,
    } = best;
    let explained = best.explained();
    if !has_order(explained, evaluation.evidence) {
        return Err(FitRefusal::NoDirections { explained });
    }
    let edges = weight * curves.len() as f64;
    let is_missing = |share: &f64| *share < MIN_SHARE && share * edges < MIN_ALONG;
    if evaluation.shares.iter().any(is_missing) {
        return Err(FitRefusal::MissingDirection);
    }
    if !is_upright {
        return Err(FitRefusal::VerticalUnclear);
    }
    let ambiguous = FitRefusal::Ambiguous { explained };
    let is_rival = |rival: &Maximum| {
        let (radius, level) = distance(camera, &rival.camera);
        let is_near = evaluation.evidence - rival.evaluation.evidence < RIVAL_EVIDENCE;
        is_near && (radius > RIVAL_DISTANCE.0 || level > RIVAL_DISTANCE.1)
    };
    if maxima[1..].iter().any(is_rival) {
        return Err(ambiguous);
    }
    let halves = halves(camera, curves, weight, prior).ok_or(ambiguous)?;
    let uncertainty = loose_curvature(camera, evaluation, prior)
        .zip(bootstrap(camera, curves, weight, evaluation, prior))
        .map(|(curvature, bootstrap)| curvature.larger(&bootstrap))
        .ok_or(ambiguous)?;
    let clutter = 1.0 + CLUTTER_MISFIT * (CLEARLY_EXPLAINED - explained).max(0.0);
    let uncertainty = uncertainty.scaled(MISFIT * clutter);
    let uncertainty = FitUncertainty {
        radius: uncertainty.radius.hypot(LENS_FLOOR),
        ..uncertainty
    };
    if let Some(half) = halves.iter().find(|half| half.disagrees()) {
        return Err(FitRefusal::HalvesDisagree {
            radius_percent: 100.0 * half.radius,
            level_deg: half.level_deg,
            explained,
        });
    }
    if uncertainty.radius > MAX_UNCERTAINTY.0 || uncertainty.level_deg > MAX_UNCERTAINTY.1 {
        return Err(FitRefusal::Uncertain {
            radius_percent: 100.0 * uncertainty.radius,
            level_deg: uncertainty.level_deg,
            explained,
        });
    }
    let [k1, k2, k3] = camera.shape();
    Ok(RoomFit {
        focal: camera.focal,
        k: [k1, k2, k3, 0.0],
        center: camera.center,
        max_theta: camera.theta(prior.circle.radius).ok_or(ambiguous)?,
        directions: camera.directions(),
        explained,
        edges: curves.len(),
        edge_scale: curves.first().map_or(1.0, |curve| curve.scale),
        uncertainty,
        is_circle_detected: true,
    })
}

/// Returns true if the edges along the directions are more than chance.
fn has_order(explained: f64, evidence: f64) -> bool {
    explained >= MIN_SHARES && evidence >= MIN_EVIDENCE
        || explained >= CLUTTERED_SHARES && evidence >= CLUTTERED_EVIDENCE
}

/// Groups of edges. Edges of one thing are neighbors, and neighbors are in one group.
const GROUPS: usize = 40;

/// Standard deviations of the fit with this evaluation.
fn bootstrap(
    camera: &RoomCamera,
    curves: &[EdgeCurve],
    weight: f64,
    evaluation: &Evaluation,
    prior: &Prior,
) -> Option<FitUncertainty> {
    let inverse = loose_covariance(evaluation, prior)?;
    let own = evaluate(camera, &[], &[], prior, 1.0, true)?.right;
    let size = curves.len().div_ceil(GROUPS).max(1);
    let slopes = curves.chunks(size).map(|group| {
        let weights = vec![weight; group.len()];
        let found = evaluate(camera, group, &weights, prior, 1.0, true);
        found.map(|found| found.right - own)
    });
    let slopes: Vec<_> = slopes.collect::<Option<_>>()?;
    let count = slopes.len() as f64;
    let mean = slopes.iter().sum::<Parameters>() / count;
    let scatter: Normal = slopes
        .iter()
        .map(|slope| (slope - mean) * (slope - mean).transpose())
        .sum();
    Some(deviations(camera, &(inverse * scatter * inverse)))
}

/// Most steps of a fit.
const STEPS: usize = 12;
/// Halves disagree if one of them gains more evidence.
const MAX_GAIN: f64 = 10.0;
/// Differences of the radius and of the level, degrees, that are not a disagreement.
const NEAR: (f64, f64) = (0.03, 2.0);
/// Neither are differences within so many standard deviations of the half.
const DEVIATIONS: f64 = 2.5;

/// The camera of half of the edges, beside that of all of them.
struct Half {
    /// Evidence of the half for its own camera, beyond that for the camera of all.
    gain: f64,
    /// Difference of the radius, as a share.
    radius: f64,
    /// Difference of the level, degrees.
    level_deg: f64,
    /// Standard deviations of the half.
    own: FitUncertainty,
}

impl Half {
    /// Returns true if the half clearly shows another camera.
    fn disagrees(&self) -> bool {
        let is_far = self.radius > NEAR.0.max(DEVIATIONS * self.own.radius)
            || self.level_deg > NEAR.1.max(DEVIATIONS * self.own.level_deg);
        is_far && self.gain > MAX_GAIN
    }
}

/// Fits two interleaved halves of the edges, then those of two halves of the image.
fn halves(
    camera: &RoomCamera,
    curves: &[EdgeCurve],
    weight: f64,
    prior: &Prior,
) -> Option<Vec<Half>> {
    let fitted = |half: usize| {
        let weights: Vec<f64> = curves
            .iter()
            .enumerate()
            .map(|(index, curve)| {
                let side = match half {
                    0 | 1 => index % 2 == half,
                    _ => (curve.points[0][0] < camera.center[0]) == (half == 2),
                };
                if side { weight } else { 0.0 }
            })
            .collect();
        let before = evaluate(camera, curves, &weights, prior, 1.0, false)?;
        let (other, evaluation) = climb(camera.clone(), curves, &weights, prior, 1.0, STEPS)?;
        let (radius, level) = distance(camera, &other);
        Some(Half {
            gain: evaluation.evidence - before.evidence,
            radius,
            level_deg: level.to_degrees(),
            own: loose_curvature(&other, &evaluation, prior)?,
        })
    };
    (0..4).map(fitted).collect()
}

impl RoomFit {
    /// Returns the edges that follow each of the directions, in the order of the directions. Edges
    /// that follow none of them are left out.
    pub fn edges_along<'a>(&self, edges: &'a [EdgeCurve]) -> [Vec<&'a EdgeCurve>; 3] {
        let mut along: [Vec<&EdgeCurve>; 3] = Default::default();
        let camera = RoomCamera::from(self);
        let (radius, _) = camera.curve(self.max_theta);
        if let Some(angles) = Angles::from_camera(&camera, self.focal * radius) {
            for edge in edges {
                if let Some(direction) = followed_direction(edge, &camera, &angles) {
                    along[direction].push(edge);
                }
            }
        }
        along
    }
}

impl From<&RoomFit> for RoomCamera {
    fn from(fit: &RoomFit) -> Self {
        let [k1, k2, ..] = fit.k;
        let [down, x, y] = fit.directions;
        let axes = Matrix3::from_columns(&[x, y, down]);
        Self {
            focal: fit.focal,
            k1,
            k2_offset: k2 - ideal_shape(k1)[1],
            center: fit.center,
            room: Rotation3::from_matrix_unchecked(axes),
        }
    }
}
