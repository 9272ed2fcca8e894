//! A person of a report as a measurement: a place with its covariance.

use nalgebra::{Matrix2, Rotation2, Unit, Vector2, Vector3};

use super::MeasurementNoise;
use crate::{CameraPose, Observation};

/// A measured place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Place {
    /// Metres on the site's floor.
    Floor(Vector2<f64>),
    /// A direction in the camera's frame.
    Bearing(Unit<Vector3<f64>>),
}

/// A measured place and its covariance: square metres, or square radians in any tangent plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Measurement {
    pub place: Place,
    pub noise: Matrix2<f64>,
    pub score: f64,
}

impl Measurement {
    /// Returns the measurement on the floor; `None` without a finite place.
    ///
    /// An error of the angle moves the place along the ray's floor direction by `(r² + h²) / h` and
    /// across it by `sqrt(r² + h²)` per radian: the derivatives of `r = h tan(angle)`.
    pub fn on_floor(
        person: &Observation,
        camera: &CameraPose,
        height_m: f64,
        noise: &MeasurementNoise,
    ) -> Option<Self> {
        let [x, y] = person
            .floor_m
            .filter(|place| place.iter().all(|m| m.is_finite()))?;
        let range = x.hypot(y);
        let slant_squared = range.powi(2) + height_m.powi(2);
        let angle = noise.angle_deg.to_radians();
        let body = noise.body_m.powi(2);
        let radial = body + (angle * slant_squared / height_m).powi(2);
        let across = body + angle.powi(2) * slant_squared;
        let [dx, dy] = camera.turned_to_site([x, y]);
        let axes = Rotation2::new(dy.atan2(dx)).into_inner();
        let covariance = axes * Matrix2::new(radial, 0.0, 0.0, across) * axes.transpose();
        Some(Self {
            place: Place::Floor(Vector2::from(camera.to_site([x, y]))),
            noise: covariance,
            score: person.score,
        })
    }

    /// Returns the measurement as a direction; `None` when the angles are not finite.
    pub fn of_bearing(person: &Observation, noise: &MeasurementNoise) -> Option<Self> {
        let azimuth = person.azimuth_deg.to_radians();
        let off_axis = person.off_axis_deg.to_radians();
        let (sin, cos) = off_axis.sin_cos();
        let direction = Vector3::new(sin * azimuth.cos(), sin * azimuth.sin(), cos);
        direction.iter().all(|part| part.is_finite()).then(|| Self {
            place: Place::Bearing(Unit::new_normalize(direction)),
            noise: Matrix2::from_diagonal_element(noise.bearing_deg.to_radians().powi(2)),
            score: person.score,
        })
    }
}
