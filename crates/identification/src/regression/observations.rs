//! The overdetermined system of equation 7.

use core::ops::Range;
use didim_dynamics::robot::JointIndex;
use std::borrow::Cow;
use std::sync::OnceLock;

use nalgebra::{DMatrix, DVector};

use super::error::RegressionError;
use super::observation_matrix::ObservationMatrix;
use super::triangles::Triangles;

/// Equation `y = X θ + ε` with the rows of joint 1 first, then joint 2, … (equations 7 and 8).
///
/// [`Observations::new`] guarantees that sizes agree, all values are finite, there are more rows
/// than columns, and the measurements of no joint are all zero.
#[derive(Clone, Debug)]
pub struct Observations {
    matrix: ObservationMatrix,
    measurements: DVector<f64>,
    /// Known part of the measured values. It was subtracted from the measurements and does not
    /// depend on θ.
    known_torque: Option<DVector<f64>>,
    joints: usize,
    /// Triangular factors, which every solution starts from and which do not depend on the weights;
    /// empty before the first solution.
    triangles: OnceLock<Triangles>,
}

/// Compares the equations only, not the stored triangular factors.
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
    /// [`NotFinite`](RegressionError::NotFinite),
    /// [`NoMeasurement`](RegressionError::NoMeasurement).
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
        Self::from_dense(ObservationMatrix::from_dense(matrix, joints), measurements)
    }

    /// Creates the equation from a matrix that is stored without its zeros. Joints without an
    /// equation have measurements of 0 and no figures.
    ///
    /// # Errors
    /// Those of [`new`](Self::new).
    pub fn from_dense(
        matrix: ObservationMatrix,
        measurements: DVector<f64>,
    ) -> Result<Self, RegressionError> {
        let ((rows, columns), joints) = (matrix.shape(), matrix.joints());
        if joints == 0 || columns == 0 || measurements.len() != rows {
            let measurements = measurements.len();
            return Err(RegressionError::Shape { rows, columns, measurements, joints });
        }
        if matrix.equation_rows() <= columns {
            let rows = matrix.equation_rows();
            return Err(RegressionError::TooFewRows { rows, columns });
        }
        if let Some((joint, row)) = matrix.bad_row().or_else(|| {
            let row = measurements.iter().position(|value| !value.is_finite())?;
            Some((row / matrix.rows_per_joint(), row % matrix.rows_per_joint()))
        }) {
            return Err(RegressionError::NotFinite { joint: JointIndex::new(joint), row });
        }
        let system =
            Self { matrix, measurements, known_torque: None, joints, triangles: OnceLock::new() };
        for joint in 0..joints {
            let square = system.joint_of(&system.measurements, joint).norm_squared();
            if !square.is_finite() {
                return Err(RegressionError::OutOfRange);
            }
            if square <= 0.0 && system.matrix.has_equation(joint) {
                return Err(RegressionError::NoMeasurement { joint: JointIndex::new(joint) });
            }
        }
        Ok(system)
    }

    /// Adds the known part of the measured values, which was subtracted from them (r). Errors
    /// relative to the measured values then include it.
    ///
    /// # Panics
    /// If its size is not that of the measurements.
    #[must_use]
    pub fn with_known(mut self, known_torque: Option<DVector<f64>>) -> Self {
        assert!(
            known_torque
                .as_ref()
                .is_none_or(|known_part| known_part.len() == self.measurements.len())
        );
        self.known_torque = known_torque;
        self
    }

    /// Returns the number of joints n.
    pub fn joints(&self) -> usize {
        self.joints
    }

    /// Returns the number of rows N of each joint.
    pub fn rows_per_joint(&self) -> usize {
        self.matrix.nrows() / self.joints
    }

    /// Returns the rows of one joint in X and y.
    pub fn joint_rows(&self, joint: usize) -> Range<usize> {
        joint * self.rows_per_joint()..(joint + 1) * self.rows_per_joint()
    }

    /// Returns the observation matrix X (r × b), unweighted, without its zeros.
    pub fn matrix(&self) -> &ObservationMatrix {
        &self.matrix
    }

    /// Returns the measurements y (r).
    pub fn measurements(&self) -> &DVector<f64> {
        &self.measurements
    }

    /// Returns the measured values (r): the measurements plus the part that was subtracted from
    /// them.
    pub fn measured_values(&self) -> Cow<'_, DVector<f64>> {
        match &self.known_torque {
            None => Cow::Borrowed(&self.measurements),
            Some(known_names) => Cow::Owned(&self.measurements + known_names),
        }
    }

    /// Predicts the measured values (r): `X θ` plus the known part.
    pub fn predicted(&self, parameters: &DVector<f64>) -> DVector<f64> {
        let predicted = self.matrix.times_parameters(parameters);
        match &self.known_torque {
            None => predicted,
            Some(known_names) => predicted + known_names,
        }
    }

    /// Returns the known part of the measured values.
    pub(crate) fn known_torque(&self) -> Option<&DVector<f64>> {
        self.known_torque.as_ref()
    }

    /// Returns the triangular factors of the joints' rows, which are computed once.
    pub(super) fn joint_triangles(&self) -> &Triangles {
        self.triangles.get_or_init(|| Triangles::new(&self.matrix, &self.measurements))
    }

    /// Returns the rows of every joint separately.
    pub fn per_joint(&self, rows: &DVector<f64>) -> Vec<Vec<f64>> {
        rows.as_slice().chunks(self.rows_per_joint()).map(<[f64]>::to_vec).collect()
    }

    /// Returns `y − X θ` (r), unweighted, in the unit of the measurements.
    pub fn residuals(&self, parameters: &DVector<f64>) -> DVector<f64> {
        let mut residuals = self.measurements.clone();
        self.matrix.add_times(-1.0, parameters, residuals.as_mut_slice());
        residuals
    }

    /// Returns the noise level σ_j of every joint from residuals (equations 11 and 12):
    /// `σ_j² = ‖ρ_j‖²/(N − b/n)`, with the b parameters divided equally among the n joints.
    ///
    /// If another joint is much noisier and there are few rows, ordinary residuals make the level
    /// of a quiet joint too high, because the parameter errors due to the noisy joint affect every
    /// joint.
    ///
    /// A level is never below the rounding errors of the joint's measurements, so that an exact fit
    /// has a finite weight. It is 1 for a joint without an equation.
    pub fn noise_levels(&self, residuals: &DVector<f64>) -> Vec<f64> {
        let rows = self.rows_per_joint() as f64;
        let divisor = rows - self.parameters_per_joint();
        (0..self.joints)
            .map(|joint| {
                if !self.matrix.has_equation(joint) {
                    return 1.0;
                }
                let rounding = self.joint_of(&self.measurements, joint).norm() / rows.sqrt();
                let level = self.joint_of(residuals, joint).norm() / divisor.sqrt();
                level.max(f64::EPSILON * rounding).max(f64::MIN_POSITIVE)
            })
            .collect()
    }

    /// Returns the number of parameters divided by the number of joints with an equation.
    pub(super) fn parameters_per_joint(&self) -> f64 {
        self.matrix.ncols() as f64 / self.matrix.joints_with_equation() as f64
    }

    pub(super) fn joint_of<'a>(
        &self,
        vector: &'a DVector<f64>,
        joint: usize,
    ) -> nalgebra::DVectorView<'a, f64> {
        vector.rows_range(self.joint_rows(joint))
    }
}
