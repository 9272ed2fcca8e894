//! A person of a report as a measurement: a place with its covariance.
//!
//! Errors along the ray's floor direction (radial) are larger than those across it: the box of a
//! person is several times as long as wide, and its lower end decides the place.

use lookdown_lens::geometry::PostureSigns;
use nalgebra::{Matrix2, Unit, Vector2, Vector3};

use crate::{CameraPose, MeasurementNoise, settings::Place};

/// Extents in the radial direction and across it: meters, or radians.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Extents {
    pub along: f64,
    pub across: f64,
}

impl Extents {
    /// Returns true for an offset within the ellipse of these semi-axes.
    fn holds(&self, along: f64, across: f64) -> bool {
        (along / self.along).hypot(across / self.across) < 1.0
    }

    /// Returns the covariance of these deviations in a plane with this radial direction.
    pub fn covariance(&self, radial: &Unit<Vector2<f64>>) -> Matrix2<f64> {
        let outer = radial.into_inner() * radial.transpose();
        let more = self.along.powi(2) - self.across.powi(2);
        Matrix2::identity() * self.across.powi(2) + outer * more
    }
}

/// A measured place, its error and its score.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Measurement {
    pub place: Place,
    /// The radial direction: on the floor (z is 0), or a tangent of the sphere at the place.
    pub radial: Vector3<f64>,
    /// Standard deviations of the place.
    pub deviation: Extents,
    /// The camera, and standard deviations of its error that lasts; absent in bearing space.
    pub bias: Option<(usize, Extents)>,
    /// Half the region in which a box shows the same person once more.
    pub same_person: Extents,
    pub score: f64,
}

impl Measurement {
    /// Returns the measurement on the floor; `None` without a finite place.
    ///
    /// An error of the angle moves the place radially by `(r² + h²) / h` and across by `sqrt(r² +
    /// h²)` per radian: the derivatives of `r = h tan(angle)`. The lower end of the box is the near
    /// side of the feet, so the body's axis lies farther out.
    pub fn on_floor(
        person: &Observation,
        (number, camera): (usize, &CameraPose),
        height_m: f64,
        noise: &MeasurementNoise,
    ) -> Option<Self> {
        let finite = person
            .floor_m
            .filter(|[x, y]| x.is_finite() && y.is_finite());
        let foot = Vector2::from(finite?);
        let range = foot.norm();
        let outward = foot.try_normalize(f64::EPSILON).unwrap_or_else(Vector2::x);
        let slant_squared = range.powi(2) + height_m.powi(2);
        let distrust = distrust(person.score, noise);
        let deviation = |body_m: f64, angle_deg: f64, across_deg: f64| Extents {
            along: body_m.hypot(angle_deg.to_radians() * slant_squared / height_m),
            across: body_m.hypot(across_deg.to_radians() * slant_squared.sqrt()),
        };
        // Below the camera the box has no lower end: its axis turns with every small error.
        let below_m = noise.below_m * (1.0 - range / noise.below_range_m).max(0.0);
        let body_m = noise.body_m.hypot(below_m);
        let [x, y] = camera.turned_to_site(outward.into());
        let axis = foot + outward * noise.foot_offset_m.min(range);
        Some(Self {
            place: Place::Floor(camera.to_site(axis.into()).into()),
            radial: Vector3::new(x, y, 0.0),
            deviation: deviation(
                body_m * distrust,
                noise.angle_deg * distrust,
                noise.across_deg * distrust,
            ),
            bias: Some((
                number,
                deviation(
                    noise.bias_body_m,
                    noise.bias_angle_deg,
                    noise.bias_across_deg,
                ),
            )),
            same_person: Extents {
                along: noise.same_person_m + noise.same_person_share * range,
                across: noise.same_person_m,
            },
            score: person.score,
        })
    }

    /// Returns the measurement as a direction; `None` when the angles are not finite.
    pub fn from_bearing(person: &Observation, noise: &MeasurementNoise) -> Option<Self> {
        let (sin_azimuth, cos_azimuth) = person.azimuth_deg.to_radians().sin_cos();
        let (sin, cos) = person.off_axis_deg.to_radians().sin_cos();
        let direction = Vector3::new(sin * cos_azimuth, sin * sin_azimuth, cos);
        let radial = Vector3::new(cos * cos_azimuth, cos * sin_azimuth, -sin);
        let distrust = distrust(person.score, noise);
        direction.iter().all(|part| part.is_finite()).then(|| Self {
            place: Place::Bearing(Unit::new_normalize(direction)),
            radial,
            deviation: Extents {
                along: noise.bearing_along_deg.to_radians() * distrust,
                across: noise.bearing_across_deg.to_radians() * distrust,
            },
            bias: None,
            same_person: Extents {
                along: noise.same_person_along_deg.to_radians(),
                across: noise.same_person_across_deg.to_radians(),
            },
            score: person.score,
        })
    }

    /// Returns the radial direction in the plane of `frame`: its components along x and y.
    pub fn radial_in(&self, to_plane: impl Fn(Vector3<f64>) -> Vector3<f64>) -> Unit<Vector2<f64>> {
        let radial = to_plane(self.radial).xy();
        Unit::try_new(radial, f64::EPSILON).unwrap_or_else(Vector2::x_axis)
    }

    /// Returns true when this may be a further box of the person that another measurement shows.
    pub fn is_part_of(&self, other: &Self) -> bool {
        let away = match (&self.place, &other.place) {
            (Place::Floor(place), Place::Floor(other)) => {
                let away = place - other;
                Vector3::new(away.x, away.y, 0.0)
            }
            (Place::Bearing(place), Place::Bearing(other)) => {
                place.into_inner() - other.into_inner()
            }
            _ => return false,
        };
        let along = away.dot(&self.radial);
        let across = (away.norm_squared() - along.powi(2)).max(0.0).sqrt();
        self.same_person.holds(along, across)
    }

    /// Returns true when a place this far away may be the same person once more.
    pub fn is_same_person(&self, away: Vector2<f64>, radial: &Unit<Vector2<f64>>) -> bool {
        self.same_person.holds(away.dot(radial), away.perp(radial))
    }
}

/// The factor of the error of a person with this score: low scores are badly placed boxes.
fn distrust(score: f64, noise: &MeasurementNoise) -> f64 {
    1.0 + noise.low_score_factor * (1.0 - score.clamp(0.0, 1.0))
}

/// One person of one report.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Observation {
    /// Place on the floor in meters (x, y of the camera); absent without the camera's height.
    pub floor_m: Option<[f64; 2]>,
    /// Direction of the person's center: clockwise from the top of the frame, in degrees (0 to
    /// 360).
    pub azimuth_deg: f64,
    /// Angle between that direction and the optical axis, in degrees (0 to 180).
    pub off_axis_deg: f64,
    /// Center of the oriented box in frame pixels (x, y).
    pub center_px: [f64; 2],
    /// Width and height of the oriented box in frame pixels.
    pub size_px: [f64; 2],
    /// Middle of the oriented box's lower side in frame pixels (x, y): lines and zones in the frame
    /// count this point.
    pub foot_px: [f64; 2],
    /// Signs of the posture.
    pub signs: PostureSigns,
    /// Probability that this is a person (0 to 1).
    pub score: f64,
    /// True for a person in the margin around the camera's areas, who continues tracks but does not
    /// count.
    pub is_in_margin: bool,
}
