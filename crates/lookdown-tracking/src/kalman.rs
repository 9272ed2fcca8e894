//! A Kalman filter of a place and a velocity in two dimensions.
//!
//! Motion is the continuous white-noise acceleration model of Bar-Shalom, Li and Kirubarajan,
//! "Estimation with Applications to Tracking and Navigation" (2001), section 6.2.2, which holds for
//! time steps of any length. The covariance update is the Joseph form (section 5.2.3).

use nalgebra::{Matrix2, Matrix2x4, Matrix4, Matrix4x2, Vector2, Vector4};
use serde::{Deserialize, Serialize};

/// Mean and covariance of (x, y, velocity x, velocity y).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(from = "Stored", into = "Stored")]
pub(super) struct Kalman {
    mean: Vector4<f64>,
    covariance: Matrix4<f64>,
}

/// The difference between a measurement and its prediction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Innovation {
    /// Measured minus predicted place.
    pub residual: Vector2<f64>,
    /// Covariance of the residual.
    pub covariance: Matrix2<f64>,
}

impl Innovation {
    /// Returns the squared Mahalanobis distance; infinite for a degenerate covariance.
    pub fn squared_distance(&self) -> f64 {
        self.covariance
            .try_inverse()
            .map_or(f64::INFINITY, |inverse| {
                self.residual.dot(&(inverse * self.residual))
            })
    }

    /// Returns the logarithm of the Gaussian density of the residual.
    pub fn log_density(&self) -> f64 {
        let scale = std::f64::consts::TAU.powi(2) * self.covariance.determinant();
        -0.5 * (self.squared_distance() + scale.ln())
    }
}

impl Kalman {
    /// Returns a filter at a first measurement with zero velocity of the given standard deviation.
    pub fn new(place: Vector2<f64>, noise: &Matrix2<f64>, velocity_sd: f64) -> Self {
        let mut covariance = Matrix4::from_diagonal_element(velocity_sd.powi(2));
        covariance.fixed_view_mut::<2, 2>(0, 0).copy_from(noise);
        Self {
            mean: Vector4::new(place.x, place.y, 0.0, 0.0),
            covariance,
        }
    }

    /// Returns the estimated place.
    pub fn place(&self) -> Vector2<f64> {
        self.mean.fixed_rows::<2>(0).into()
    }

    /// Returns the estimated velocity.
    pub fn velocity(&self) -> Vector2<f64> {
        self.mean.fixed_rows::<2>(2).into()
    }

    /// Returns the covariance of the place.
    pub fn place_covariance(&self) -> Matrix2<f64> {
        self.covariance.fixed_view::<2, 2>(0, 0).into()
    }

    /// Returns the filter `dt` seconds later, for the spectral density `q` of the acceleration.
    pub fn predicted(&self, dt: f64, q: f64) -> Self {
        let mut transition = Matrix4::identity();
        transition.fixed_view_mut::<2, 2>(0, 2).fill_diagonal(dt);
        let mut noise = Matrix4::from_diagonal_element(q * dt);
        let place_noise = q * dt.powi(3) / 3.0;
        let cross_noise = q * dt.powi(2) / 2.0;
        noise
            .fixed_view_mut::<2, 2>(0, 0)
            .fill_diagonal(place_noise);
        noise
            .fixed_view_mut::<2, 2>(0, 2)
            .fill_diagonal(cross_noise);
        noise
            .fixed_view_mut::<2, 2>(2, 0)
            .fill_diagonal(cross_noise);
        Self {
            mean: transition * self.mean,
            covariance: transition * self.covariance * transition.transpose() + noise,
        }
    }

    /// Returns the innovation of a measurement taken `lag` seconds before the filter's time.
    pub fn innovation(&self, place: Vector2<f64>, noise: &Matrix2<f64>, lag: f64) -> Innovation {
        let observed = observation_matrix(lag);
        Innovation {
            residual: place - observed * self.mean,
            covariance: observed * self.covariance * observed.transpose() + noise,
        }
    }

    /// Updates the filter with a measurement taken `lag` seconds before the filter's time.
    pub fn update(&mut self, place: Vector2<f64>, noise: &Matrix2<f64>, lag: f64) {
        let innovation = self.innovation(place, noise, lag);
        let Some(inverse) = innovation.covariance.try_inverse() else {
            return;
        };
        let observed = observation_matrix(lag);
        let gain: Matrix4x2<f64> = self.covariance * observed.transpose() * inverse;
        let kept = Matrix4::identity() - gain * observed;
        self.mean += gain * innovation.residual;
        self.covariance =
            kept * self.covariance * kept.transpose() + gain * noise * gain.transpose();
    }

    /// Moves the origin of the coordinates to the estimated place.
    pub fn move_origin_to_place(&mut self) {
        self.mean.fixed_rows_mut::<2>(0).fill(0.0);
    }
}

/// The matrix that takes the place `lag` seconds ago from the state: place minus velocity times
/// lag.
fn observation_matrix(lag: f64) -> Matrix2x4<f64> {
    let mut matrix = Matrix2x4::identity();
    matrix.fixed_view_mut::<2, 2>(0, 2).fill_diagonal(-lag);
    matrix
}

/// The stored form of a filter.
#[derive(Serialize, Deserialize)]
struct Stored {
    mean: [f64; 4],
    covariance: [[f64; 4]; 4],
}

impl From<Stored> for Kalman {
    fn from(stored: Stored) -> Self {
        Self {
            mean: stored.mean.into(),
            covariance: stored.covariance.into(),
        }
    }
}

impl From<Kalman> for Stored {
    fn from(kalman: Kalman) -> Self {
        Self {
            mean: kalman.mean.into(),
            covariance: kalman.covariance.into(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn filter() -> Kalman {
        Kalman::new(Vector2::new(1.0, 2.0), &Matrix2::identity(), 1.0)
    }

    #[test]
    fn two_short_steps_are_one_long_step() {
        let twice = filter().predicted(0.3, 0.7).predicted(0.9, 0.7);
        let once = filter().predicted(1.2, 0.7);
        assert!((twice.covariance - once.covariance).norm() < 1e-12);
        assert!((twice.mean - once.mean).norm() < 1e-12);
    }

    #[test]
    fn measurements_reveal_the_velocity() {
        let mut filter = filter();
        let noise = Matrix2::identity() * 0.01;
        for step in 1..20 {
            filter = filter.predicted(0.1, 0.1);
            let at_s = f64::from(step) * 0.1;
            filter.update(Vector2::new(1.0 + 1.5 * at_s, 2.0 - at_s), &noise, 0.0);
        }
        assert!((filter.velocity() - Vector2::new(1.5, -1.0)).norm() < 0.1);
        assert!(filter.place_covariance().trace() < 0.02);
    }

    #[test]
    fn a_late_measurement_is_compared_with_the_past() {
        let mut filter = filter();
        filter.mean = Vector4::new(1.0, 2.0, 2.0, 0.0);
        let past = Vector2::new(0.0, 2.0);
        let innovation = filter.innovation(past, &Matrix2::identity(), 0.5);
        assert!(innovation.residual.norm() < 1e-12);
        assert_eq!(innovation.squared_distance(), 0.0);
    }
}
