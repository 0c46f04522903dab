//! The overdetermined system of equation 7.

use core::ops::Range;
use std::borrow::Cow;
use std::sync::OnceLock;

use nalgebra::{DMatrix, DVector};

use super::error::RegressionError;
use super::observation_matrix::ObservationMatrix;
use super::triangles::Triangles;

/// `y = X θ + ε` with the rows of joint 1 first, then joint 2, … (equations 7 and 8).
///
/// Sizes fit, everything is finite, there are more rows than columns, and no joint's measurements
/// are all zero: guaranteed by [`Observations::new`].
#[derive(Clone, Debug)]
pub struct Observations {
    matrix: ObservationMatrix,
    measurements: DVector<f64>,
    /// What was measured beside the measurements, and is no matter of θ.
    known: Option<DVector<f64>>,
    joints: usize,
    /// What every solution begins with, whatever the weights; none until the first.
    triangles: OnceLock<Triangles>,
}

/// Of the same equations, whichever have been solved.
impl PartialEq for Observations {
    fn eq(&self, other: &Self) -> bool {
        self.joints == other.joints
            && self.matrix == other.matrix
            && self.measurements == other.measurements
    }
}

impl Observations {
    /// Checks and takes the observation matrix X (r × b) and the measurements y (r), r = n N.
    ///
    /// # Errors
    /// [`Shape`](RegressionError::Shape), [`TooFewRows`](RegressionError::TooFewRows),
    /// [`NotFinite`](RegressionError::NotFinite), [`NoMeasurement`](RegressionError::NoMeasurement).
    pub fn new(
        matrix: DMatrix<f64>,
        measurements: DVector<f64>,
        joints: usize,
    ) -> Result<Self, RegressionError> {
        let (rows, columns) = matrix.shape();
        if joints == 0 || columns == 0 || measurements.len() != rows || rows % joints != 0 {
            let measurements = measurements.len();
            return Err(RegressionError::Shape { rows, columns, measurements, joints });
        }
        Self::of(ObservationMatrix::of(matrix, joints), measurements)
    }

    /// The same of a matrix without its zeros.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn of(
        matrix: ObservationMatrix,
        measurements: DVector<f64>,
    ) -> Result<Self, RegressionError> {
        let ((rows, columns), joints) = (matrix.shape(), matrix.joints());
        if joints == 0 || columns == 0 || measurements.len() != rows {
            let measurements = measurements.len();
            return Err(RegressionError::Shape { rows, columns, measurements, joints });
        }
        if rows <= columns {
            return Err(RegressionError::TooFewRows { rows, columns });
        }
        let bad_measurement = || {
            let row = measurements.iter().position(|value| !value.is_finite())?;
            Some((row / matrix.rows_per_joint(), row % matrix.rows_per_joint()))
        };
        if let Some((joint, row)) = matrix.bad_row().or_else(bad_measurement) {
            return Err(RegressionError::NotFinite { joint, row });
        }
        let system = Self { matrix, measurements, known: None, joints, triangles: OnceLock::new() };
        for joint in 0..joints {
            let square = system.joint_of(&system.measurements, joint).norm_squared();
            if !square.is_finite() {
                return Err(RegressionError::OutOfRange);
            }
            if square <= 0.0 {
                return Err(RegressionError::NoMeasurement { joint });
            }
        }
        Ok(system)
    }

    /// With what was known beforehand of the measured values and taken off them (r): figures that are
    /// relative to the measured values then count it.
    ///
    /// # Panics
    /// When it is not of the measurements' size.
    #[must_use]
    pub fn with_known(mut self, known: Option<DVector<f64>>) -> Self {
        assert!(known.as_ref().is_none_or(|known| known.len() == self.measurements.len()));
        self.known = known;
        self
    }

    /// Joints n.
    pub fn joints(&self) -> usize {
        self.joints
    }

    /// Rows N of each joint.
    pub fn rows_per_joint(&self) -> usize {
        self.matrix.nrows() / self.joints
    }

    /// The rows of one joint in X and y.
    pub fn joint_rows(&self, joint: usize) -> Range<usize> {
        joint * self.rows_per_joint()..(joint + 1) * self.rows_per_joint()
    }

    /// The observation matrix X (r × b), unweighted, without its zeros.
    pub fn matrix(&self) -> &ObservationMatrix {
        &self.matrix
    }

    /// The measurements y (r).
    pub fn measurements(&self) -> &DVector<f64> {
        &self.measurements
    }

    /// What was measured (r): the measurements, and what was taken off them.
    pub fn measured(&self) -> Cow<'_, DVector<f64>> {
        match &self.known {
            None => Cow::Borrowed(&self.measurements),
            Some(known) => Cow::Owned(&self.measurements + known),
        }
    }

    /// What the parameters make of it (r), `X θ` and what is known besides.
    pub fn predicted(&self, parameters: &DVector<f64>) -> DVector<f64> {
        let predicted = self.matrix.times(parameters);
        match &self.known {
            None => predicted,
            Some(known) => predicted + known,
        }
    }

    /// What was known beforehand.
    pub(crate) fn known(&self) -> Option<&DVector<f64>> {
        self.known.as_ref()
    }

    /// The triangles of the joints' rows, computed once.
    pub(super) fn triangles(&self) -> &Triangles {
        self.triangles.get_or_init(|| Triangles::of(&self.matrix, &self.measurements))
    }

    /// The rows of every joint by themselves.
    pub fn per_joint(&self, rows: &DVector<f64>) -> Vec<Vec<f64>> {
        rows.as_slice().chunks(self.rows_per_joint()).map(<[f64]>::to_vec).collect()
    }

    /// `y − X θ` (r), unweighted, in the unit of the measurements.
    pub fn residuals(&self, parameters: &DVector<f64>) -> DVector<f64> {
        let mut residuals = self.measurements.clone();
        self.matrix.add_times(-1.0, parameters, residuals.as_mut_slice());
        residuals
    }

    /// Noise level σ_j of every joint from residuals (equations 11 and 12):
    /// `σ_j² = ‖ρ_j‖²/(N − b/n)`, the b parameters counted against the n joints in equal parts.
    ///
    /// From ordinary residuals the level of a quiet joint comes out high when another is much
    /// noisier and rows are few: the noisy one's parameter errors show in every joint.
    ///
    /// A level is never below the rounding of the joint's measurements, so that an exact fit does
    /// not ask for an infinite weight.
    pub fn noise_levels(&self, residuals: &DVector<f64>) -> Vec<f64> {
        let rows = self.rows_per_joint() as f64;
        let divisor = rows - self.matrix.ncols() as f64 / self.joints as f64;
        let level = |joint| {
            let rounding = self.joint_of(&self.measurements, joint).norm() / rows.sqrt();
            let level = self.joint_of(residuals, joint).norm() / divisor.sqrt();
            level.max(f64::EPSILON * rounding).max(f64::MIN_POSITIVE)
        };
        (0..self.joints).map(level).collect()
    }

    pub(super) fn joint_of<'a>(
        &self,
        vector: &'a DVector<f64>,
        joint: usize,
    ) -> nalgebra::DVectorView<'a, f64> {
        vector.rows_range(self.joint_rows(joint))
    }
}
