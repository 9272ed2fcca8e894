//! A Kalman filter of a place and a velocity in two dimensions.
//!
//! Motion is the continuous white-noise acceleration model of Bar-Shalom, Li and Kirubarajan,
//! "Estimation with Applications to Tracking and Navigation" (2001), section 6.2.2, which holds for
//! time steps of any length. The covariance update is the Joseph form (section 5.2.3).

use nalgebra::{DMatrix, DVector, Dyn, Matrix2, Matrix2xX, OMatrix, U2, Vector2};
use serde::{Deserialize, Serialize};

/// Time constant of a bias, seconds: how long a person leans or hides the legs the same way.
/// With 20 s a wrong pair of two people of a crowd lasts (`docs/lab/real-walks.md`).
const BIAS_S: f64 = 5.0;
/// Most cameras whose bias a filter holds; the camera that came first gives way.
const MAX_BIASES: usize = 4;
/// Dimensions of place and velocity.
const MOTION: usize = 4;

/// Mean and covariance of (x, y, velocity x, velocity y), then of the bias (x, y) of each camera.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(from = "Stored", into = "Stored")]
pub(super) struct Kalman {
    mean: DVector<f64>,
    covariance: DMatrix<f64>,
    biases: Vec<Bias>,
}

/// The error of the places of a camera that lasts: a Gauss-Markov process around 0.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Bias {
    pub camera: usize,
    /// Columns of the covariance that the bias tends to.
    pub covariance: [[f64; 2]; 2],
}

/// A measured place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Measured {
    pub place: Vector2<f64>,
    pub noise: Matrix2<f64>,
    pub bias: Option<Bias>,
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
    pub fn new(measured: &Measured, velocity_sd: f64) -> Self {
        let mut filter = Self {
            mean: DVector::zeros(MOTION),
            covariance: DMatrix::from_diagonal_element(MOTION, MOTION, velocity_sd.powi(2)),
            biases: Vec::new(),
        };
        filter
            .mean
            .fixed_rows_mut::<2>(0)
            .copy_from(&measured.place);
        let mut noise = measured.noise;
        if let Some(bias) = measured.bias {
            filter.add_bias(bias);
            noise += Matrix2::from(bias.covariance);
            for (row, column) in [(0, MOTION), (MOTION, 0)] {
                let mut cross = filter.covariance.fixed_view_mut::<2, 2>(row, column);
                cross.copy_from(&-Matrix2::from(bias.covariance));
            }
        }
        let mut place = filter.covariance.fixed_view_mut::<2, 2>(0, 0);
        place.copy_from(&noise);
        filter
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

    /// Returns the estimated bias of a camera.
    pub fn bias(&self, camera: usize) -> Vector2<f64> {
        let row = self.row_of_bias(camera);
        row.map_or_else(Vector2::zeros, |row| self.mean.fixed_rows::<2>(row).into())
    }

    /// Returns the filter `dt` seconds later, for the spectral density `q` of the acceleration.
    pub fn predicted(&self, dt: f64, q: f64) -> Self {
        let size = self.mean.len();
        let mut transition = DMatrix::identity(size, size);
        transition.fixed_view_mut::<2, 2>(0, 2).fill_diagonal(dt);
        let mut noise = DMatrix::zeros(size, size);
        for (row, column, value) in [
            (0, 0, q * dt.powi(3) / 3.0),
            (0, 2, q * dt.powi(2) / 2.0),
            (2, 0, q * dt.powi(2) / 2.0),
            (2, 2, q * dt),
        ] {
            noise
                .fixed_view_mut::<2, 2>(row, column)
                .fill_diagonal(value);
        }
        let remains = (-dt / BIAS_S).exp();
        for (bias, row) in self.biases.iter().zip((MOTION..).step_by(2)) {
            transition
                .fixed_view_mut::<2, 2>(row, row)
                .fill_diagonal(remains);
            let renewed = Matrix2::from(bias.covariance) * (1.0 - remains.powi(2));
            noise.fixed_view_mut::<2, 2>(row, row).copy_from(&renewed);
        }
        Self {
            mean: &transition * &self.mean,
            covariance: &transition * &self.covariance * transition.transpose() + noise,
            biases: self.biases.clone(),
        }
    }

    /// Returns the innovation of a measurement taken `lag` seconds before the filter's time.
    pub fn innovation(&self, measured: &Measured, lag: f64) -> Innovation {
        let row = measured.bias.map(|bias| self.row_of_bias(bias.camera));
        let observed = self.observation_matrix(lag, row.flatten());
        let new_bias = match (measured.bias, row) {
            (Some(bias), Some(None)) => bias.covariance.into(),
            _ => Matrix2::zeros(),
        };
        Innovation {
            residual: measured.place - &observed * &self.mean,
            covariance: &observed * &self.covariance * observed.transpose()
                + measured.noise
                + new_bias,
        }
    }

    /// Updates the filter with a measurement taken `lag` seconds before the filter's time.
    pub fn update(&mut self, measured: &Measured, lag: f64) {
        let row = measured.bias.map(|bias| self.add_bias(bias));
        let innovation = self.innovation(measured, lag);
        let Some(inverse) = innovation.covariance.try_inverse() else {
            return;
        };
        let observed = self.observation_matrix(lag, row);
        let gain = &self.covariance * observed.transpose() * inverse;
        let size = self.mean.len();
        let kept = DMatrix::identity(size, size) - &gain * observed;
        self.mean += &gain * innovation.residual;
        self.covariance =
            &kept * &self.covariance * kept.transpose() + &gain * measured.noise * gain.transpose();
    }

    /// Moves the origin of the coordinates to the estimated place.
    pub fn move_origin_to_place(&mut self) {
        self.mean.fixed_rows_mut::<2>(0).fill(0.0);
    }

    /// The first of the two rows of a camera's bias.
    fn row_of_bias(&self, camera: usize) -> Option<usize> {
        let at = self.biases.iter().position(|bias| bias.camera == camera)?;
        Some(MOTION + 2 * at)
    }

    /// Sets the covariance that a camera's bias tends to. Returns the row of the bias.
    fn add_bias(&mut self, bias: Bias) -> usize {
        if let Some(row) = self.row_of_bias(bias.camera) {
            self.biases[(row - MOTION) / 2] = bias;
            return row;
        }
        if self.biases.len() == MAX_BIASES {
            self.biases.remove(0);
            self.mean = self.mean.clone().remove_fixed_rows::<2>(MOTION);
            let covariance = self.covariance.clone().remove_fixed_rows::<2>(MOTION);
            self.covariance = covariance.remove_fixed_columns::<2>(MOTION);
        }
        let row = self.mean.len();
        self.biases.push(bias);
        self.mean = self.mean.clone().resize_vertically(row + 2, 0.0);
        self.covariance = self.covariance.clone().resize(row + 2, row + 2, 0.0);
        let mut own = self.covariance.fixed_view_mut::<2, 2>(row, row);
        own.copy_from(&bias.covariance.into());
        row
    }

    /// The matrix that takes the place `lag` seconds ago from the state: place minus velocity times
    /// lag, and the bias at `row`.
    fn observation_matrix(&self, lag: f64, row: Option<usize>) -> OMatrix<f64, U2, Dyn> {
        let mut matrix = Matrix2xX::identity(self.mean.len());
        matrix.fixed_view_mut::<2, 2>(0, 2).fill_diagonal(-lag);
        if let Some(row) = row {
            matrix.fixed_view_mut::<2, 2>(0, row).fill_diagonal(1.0);
        }
        matrix
    }
}

/// The stored form of a filter.
#[derive(Serialize, Deserialize)]
struct Stored {
    mean: Vec<f64>,
    /// Column by column.
    covariance: Vec<Vec<f64>>,
    #[serde(default)]
    biases: Vec<Bias>,
}

impl From<Stored> for Kalman {
    fn from(stored: Stored) -> Self {
        let size = MOTION + 2 * stored.biases.len();
        let (mut mean, mut columns) = (stored.mean, stored.covariance.concat());
        // An invalid file may lack values.
        mean.resize(size, 0.0);
        columns.resize(size * size, 0.0);
        Self {
            mean: DVector::from_vec(mean),
            covariance: DMatrix::from_vec(size, size, columns),
            biases: stored.biases,
        }
    }
}

impl From<Kalman> for Stored {
    fn from(kalman: Kalman) -> Self {
        let columns = kalman.covariance.column_iter();
        Self {
            mean: kalman.mean.as_slice().to_vec(),
            covariance: columns.map(|one| one.iter().copied().collect()).collect(),
            biases: kalman.biases,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(x: f64, y: f64, variance: f64) -> Measured {
        Measured {
            place: Vector2::new(x, y),
            noise: Matrix2::identity() * variance,
            bias: None,
        }
    }

    fn filter() -> Kalman {
        Kalman::new(&at(1.0, 2.0, 1.0), 1.0)
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
        for step in 1..20 {
            filter = filter.predicted(0.1, 0.1);
            let at_s = f64::from(step) * 0.1;
            filter.update(&at(1.0 + 1.5 * at_s, 2.0 - at_s, 0.01), 0.0);
        }
        assert!((filter.velocity() - Vector2::new(1.5, -1.0)).norm() < 0.1);
        assert!(filter.place_covariance().trace() < 0.02);
    }

    #[test]
    fn a_late_measurement_is_compared_with_the_past() {
        let mut filter = filter();
        filter.mean[2] = 2.0;
        let innovation = filter.innovation(&at(0.0, 2.0, 1.0), 0.5);
        assert!(innovation.residual.norm() < 1e-12);
        assert_eq!(innovation.squared_distance(), 0.0);
    }
}
