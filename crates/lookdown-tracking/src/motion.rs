//! The motion of one track: a Kalman filter on the floor, or in a tangent plane of the unit sphere.
//!
//! In bearing space the filter lives in normal coordinates around the track's direction. After each
//! update the tangent plane moves along the great circle to the new direction (parallel transport),
//! which leaves velocity and covariance as they are.

use nalgebra::{Matrix2, Matrix3, Rotation3, Unit, Vector2, Vector3};
use serde::{Deserialize, Serialize};

use crate::{
    kalman::{Bias, Innovation, Kalman, Measured},
    measurement::Measurement,
    settings::{Place, PlaneSettings},
};

/// Meters on the floor for a radian around the camera, at usual heights.
const METERS_PER_RADIAN: f64 = 2.75;

/// The columns of a rotation.
type Tangent = [[f64; 3]; 3];

/// The filter of a track and its time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Motion {
    kalman: Kalman,
    /// Rotation from the tangent plane's frame (z through its origin) to the camera, column by
    /// column; absent on the floor.
    tangent: Option<Tangent>,
    /// The time of the state, seconds since the Unix epoch.
    pub at_s: f64,
}

impl Motion {
    /// Returns the motion of a new track at its first measurement.
    pub fn new(measured: &Measurement, at_s: f64, settings: &PlaneSettings) -> Self {
        let tangent = match &measured.place {
            Place::Floor(_) => None,
            Place::Bearing(direction) => Some(stored(&rotation_to(direction))),
        };
        Self {
            kalman: Kalman::new(&local(tangent, measured), settings.velocity_sd),
            tangent,
            at_s,
        }
    }

    /// Returns the state on the floor; `None` in bearing space.
    pub fn on_floor(&self) -> Option<&Kalman> {
        self.tangent.is_none().then_some(&self.kalman)
    }

    /// Returns the direction in the camera's frame; `None` on the floor.
    pub fn direction(&self) -> Option<Vector3<f64>> {
        self.tangent
            .map(|tangent| Matrix3::from(tangent) * Vector3::z())
    }

    /// Returns the place on the floor (z is 0), or the direction in the camera's frame.
    pub fn place(&self) -> Vector3<f64> {
        self.direction()
            .unwrap_or_else(|| self.kalman.place().push(0.0))
    }

    /// Returns the place on the floor expected at `at_s`, meters; `None` in bearing space.
    pub fn floor_at(&self, at_s: f64) -> Option<[f64; 2]> {
        let state = self.on_floor()?;
        Some((state.place() + state.velocity() * (at_s - self.at_s)).into())
    }

    /// Returns the difference of two places on the floor at `at_s` with its covariance; `None` in
    /// bearing space. Velocities are taken as known.
    pub fn separation(&self, other: &Self, at_s: f64) -> Option<Innovation> {
        let residual = Vector2::from(self.floor_at(at_s)?) - Vector2::from(other.floor_at(at_s)?);
        let covariance = self.kalman.place_covariance() + other.kalman.place_covariance();
        Some(Innovation {
            residual,
            covariance,
        })
    }

    /// Returns the offset to the place of another track from where the person of this track is
    /// expected after some seconds without being seen, meters. The person walks on for a second. In
    /// bearing space a radian counts as [`METERS_PER_RADIAN`].
    pub fn absence(&self, other: &Self, seconds: f64, drift: f64) -> Innovation {
        let scale = if self.tangent.is_some() {
            METERS_PER_RADIAN
        } else {
            1.0
        };
        let place = match (self.tangent, other.direction()) {
            (Some(tangent), Some(direction)) => {
                logarithm(&(rotation(tangent).inverse() * direction))
            }
            _ => other.kalman.place(),
        };
        let velocity = self.kalman.velocity();
        let walked = velocity * seconds.min(1.0);
        let drift = (drift + (scale * velocity).norm_squared()) * seconds;
        let known = self.kalman.place_covariance() + other.kalman.place_covariance();
        Innovation {
            residual: (place - self.kalman.place() - walked) * scale,
            covariance: known * scale.powi(2) + Matrix2::identity() * drift,
        }
    }

    /// Returns the innovation of a measurement, by the filter at its time.
    pub fn innovation(&self, (filter, lag): &(Kalman, f64), measured: &Measurement) -> Innovation {
        filter.innovation(&local(self.tangent, measured), *lag)
    }

    /// Returns true when a measurement may show the person of this track once more.
    pub fn is_same_person(&self, measured: &Measurement, at_s: f64) -> bool {
        let Measured { place, bias, .. } = local(self.tangent, measured);
        let bias = bias.map_or_else(Vector2::zeros, |bias| self.kalman.bias(bias.camera));
        let expected = self.kalman.place() + self.kalman.velocity() * (at_s - self.at_s) + bias;
        measured.is_same_person(place - expected, &radial(self.tangent, measured))
    }

    /// Updates the state with a measurement taken at `at_s`.
    pub fn update(&mut self, measured: &Measurement, at_s: f64, settings: &PlaneSettings) {
        let (mut filter, lag) = self.filter_at(at_s, settings);
        filter.update(&local(self.tangent, measured), lag);
        self.at_s = self.at_s.max(at_s);
        self.kalman = filter;
        if let Some(tangent) = self.tangent {
            let moved = rotation_to(&exponential(self.kalman.place()));
            self.tangent = Some(stored(&(rotation(tangent) * moved)));
            self.kalman.move_origin_to_place();
        }
    }

    /// Returns the filter at `at_s`, or at the state's time with the lag of an earlier `at_s`.
    pub fn filter_at(&self, at_s: f64, settings: &PlaneSettings) -> (Kalman, f64) {
        let dt = at_s - self.at_s;
        if dt >= 0.0 {
            (
                self.kalman.predicted(dt, settings.acceleration_density),
                0.0,
            )
        } else {
            (self.kalman.clone(), -dt)
        }
    }
}

/// A measurement in the coordinates of a filter.
fn local(tangent: Option<Tangent>, measured: &Measurement) -> Measured {
    let place = match (&measured.place, tangent) {
        (Place::Floor(place), _) => *place,
        (Place::Bearing(direction), tangent) => {
            let to_plane = tangent.map_or_else(Rotation3::identity, rotation).inverse();
            logarithm(&(to_plane * direction.into_inner()))
        }
    };
    let radial = radial(tangent, measured);
    Measured {
        place,
        noise: measured.deviation.covariance(&radial),
        bias: measured.bias.map(|(camera, deviation)| Bias {
            camera,
            covariance: deviation.covariance(&radial).into(),
        }),
    }
}

/// The radial direction of a measurement in the coordinates of a filter.
fn radial(tangent: Option<Tangent>, measured: &Measurement) -> Unit<Vector2<f64>> {
    let to_plane = tangent.map_or_else(Rotation3::identity, rotation).inverse();
    measured.radial_in(|direction| to_plane * direction)
}

/// The smallest rotation that turns z into `direction`.
fn rotation_to(direction: &Unit<Vector3<f64>>) -> Rotation3<f64> {
    Rotation3::rotation_between(&Vector3::z(), direction)
        .unwrap_or_else(|| Rotation3::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI))
}

/// The tangent vector at z whose length is the angle to `direction`.
fn logarithm(direction: &Vector3<f64>) -> Vector2<f64> {
    let across = direction.xy();
    let length = across.norm();
    if length == 0.0 {
        return Vector2::zeros();
    }
    across * (length.atan2(direction.z) / length)
}

/// The direction at the end of a tangent vector at z.
fn exponential(tangent: Vector2<f64>) -> Unit<Vector3<f64>> {
    let angle = tangent.norm();
    let share = if angle == 0.0 {
        0.0
    } else {
        angle.sin() / angle
    };
    Unit::new_normalize(Vector3::new(
        tangent.x * share,
        tangent.y * share,
        angle.cos(),
    ))
}

fn rotation(stored: Tangent) -> Rotation3<f64> {
    Rotation3::from_matrix_unchecked(stored.into())
}

/// The columns of a rotation, made orthonormal again against rounding over many updates.
fn stored(rotation: &Rotation3<f64>) -> Tangent {
    let z = rotation.matrix().column(2).normalize();
    let x = rotation.matrix().column(0) - z * z.dot(&rotation.matrix().column(0));
    let x = x.normalize();
    [x.into(), z.cross(&x).into(), z.into()]
}
