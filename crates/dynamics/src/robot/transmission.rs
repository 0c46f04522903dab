//! Gear ratios and couplings between motors and joints.

use super::MotorIndex;
use nalgebra::DMatrix;
use thiserror::Error;

use crate::MAX_JOINTS;
use crate::sample::FEW_JOINTS;

type Matrix = [[f64; MAX_JOINTS]; MAX_JOINTS];

/// Smallest ratio of singular values, rows scaled to their largest entry, of a usable matrix.
const MIN_SINGULAR_VALUE_RATIO: f64 = 1e-9;

/// Why a matrix cannot be a transmission.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum TransmissionError {
    /// The matrix is not n × n.
    #[error("it has {found} rows for {expected} joints; give one row per motor")]
    RowCount {
        /// Rows in the file.
        found: usize,
        /// Joints of the arm.
        expected: usize,
    },
    /// A row does not have n entries.
    #[error("row {motor} has {found} entries for {expected} joints; give one per joint")]
    RowLength {
        /// Motor.
        motor: MotorIndex,
        /// Entries in the row.
        found: usize,
        /// Joints of the arm.
        expected: usize,
    },
    /// An entry is infinite or not a number.
    #[error("row {motor} has an entry that is not finite; give the gear ratio")]
    NotFinite {
        /// Motor.
        motor: MotorIndex,
    },
    /// A motor does not drive the joint of its own number.
    #[error("entry ({motor},{motor}) is 0; number the motors after the joints that they drive")]
    ZeroRatio {
        /// Motor.
        motor: MotorIndex,
    },
    /// Motor positions do not determine joint positions.
    #[error("it is singular; check the couplings, the rows must be linearly independent")]
    Singular,
}

/// The matrix R between motors and joints: q_motor = R q_joint and τ_joint = Rᵀ τ_motor.
///
/// Velocities and accelerations transform as positions do. Couplings are off-diagonal entries.
#[derive(Clone, Debug, PartialEq)]
pub struct Transmission {
    joints: usize,
    ratio: MatrixPair,
    inverse: MatrixPair,
}

/// A matrix and its transpose.
#[derive(Clone, Debug, PartialEq)]
struct MatrixPair {
    matrix: Matrix,
    transposed: Matrix,
}

impl Transmission {
    /// Creates the transmission of `joints` joints from the rows of R.
    pub fn new(joints: usize, rows: &[Vec<f64>]) -> Result<Self, TransmissionError> {
        if rows.len() != joints {
            return Err(TransmissionError::RowCount { found: rows.len(), expected: joints });
        }
        let mut ratio = [[0.0; MAX_JOINTS]; MAX_JOINTS];
        for (i, row) in rows.iter().enumerate() {
            let motor = MotorIndex::new(i);
            if row.len() != joints {
                let length = row.len();
                return Err(TransmissionError::RowLength {
                    motor,
                    found: length,
                    expected: joints,
                });
            }
            if row.iter().any(|entry| !entry.is_finite()) {
                return Err(TransmissionError::NotFinite { motor });
            }
            if row[i] == 0.0 {
                return Err(TransmissionError::ZeroRatio { motor });
            }
            ratio[i][..joints].copy_from_slice(row);
        }
        let inverse = invert(joints, &ratio).ok_or(TransmissionError::Singular)?;
        Ok(Self {
            joints,
            ratio: MatrixPair::from_matrix(ratio),
            inverse: MatrixPair::from_matrix(inverse),
        })
    }

    /// Returns the same transmission with another entry of R: the motion of `motor` per unit of
    /// `joint`, both counted from 0.
    ///
    /// # Errors
    /// [`TransmissionError`].
    pub fn with_entry(
        &self,
        motor: usize,
        joint: usize,
        entry: f64,
    ) -> Result<Self, TransmissionError> {
        let mut rows = self.rows();
        rows[motor][joint] = entry;
        Self::new(self.joints, &rows)
    }

    /// Returns the rows of R.
    pub fn rows(&self) -> Vec<Vec<f64>> {
        (0..self.joints).map(|motor| self.row(motor).to_vec()).collect()
    }

    /// Computes joint positions, velocities or accelerations from those of the motors: R⁻¹ q_motor.
    ///
    /// # Panics
    /// When a slice does not have one entry per joint; so do the other three.
    pub fn joint_position(&self, motor: &[f64], joint: &mut [f64]) {
        self.multiply(&self.inverse.transposed, motor, joint);
    }

    /// Computes motor positions, velocities or accelerations from those of the joints: R q_joint.
    pub fn motor_position(&self, joint: &[f64], motor: &mut [f64]) {
        self.multiply(&self.ratio.transposed, joint, motor);
    }

    /// Computes joint torques from motor torques: Rᵀ τ_motor.
    pub fn joint_torque(&self, motor: &[f64], joint: &mut [f64]) {
        self.multiply(&self.ratio.matrix, motor, joint);
    }

    /// Computes motor torques from joint torques: R⁻ᵀ τ_joint.
    pub fn motor_torque(&self, joint: &[f64], motor: &mut [f64]) {
        self.multiply(&self.inverse.matrix, joint, motor);
    }

    /// Returns row `motor` of R, counted from 0: the motion of that motor per unit of each joint.
    pub fn row(&self, motor: usize) -> &[f64] {
        &self.ratio.matrix[motor][..self.joints]
    }

    /// Returns true if the motor (counted from 0) drives more than its own joint.
    pub fn is_coupled(&self, motor: usize) -> bool {
        self.row(motor).iter().enumerate().any(|(i, ratio)| i != motor && *ratio != 0.0)
    }

    /// Returns s, row `motor` of R divided by its diagonal entry. s · q is the motor's motion on
    /// the side of its joint; without couplings it is q of that joint.
    pub fn direction(&self, motor: usize) -> [f64; MAX_JOINTS] {
        let ratio = &self.ratio.matrix[motor];
        ratio.map(|entry| entry / ratio[motor])
    }

    /// Computes the product as Σ_j (row j of `transposed`) · entry j, which forms all entries in
    /// parallel.
    fn multiply(&self, transposed: &Matrix, from: &[f64], to: &mut [f64]) {
        self.check_lengths(from, to);
        if self.joints <= FEW_JOINTS {
            multiply_up_to::<FEW_JOINTS>(transposed, from, to);
        } else {
            multiply_up_to::<MAX_JOINTS>(transposed, from, to);
        }
    }

    fn check_lengths(&self, from: &[f64], to: &[f64]) {
        assert!(from.len() == self.joints && to.len() == self.joints, "one entry per joint");
    }
}

impl MatrixPair {
    fn from_matrix(matrix: Matrix) -> Self {
        let transposed = core::array::from_fn(|i| core::array::from_fn(|j| matrix[j][i]));
        Self { matrix, transposed }
    }
}

/// Computes the product for at most `N` joints.
fn multiply_up_to<const N: usize>(transposed: &Matrix, from: &[f64], to: &mut [f64]) {
    let mut product = [0.0; N];
    for (row, x) in transposed.iter().zip(from) {
        for (sum, m) in product.iter_mut().zip(row) {
            *sum += m * x;
        }
    }
    for (to, product) in to.iter_mut().zip(product) {
        *to = product;
    }
}

fn invert(joints: usize, ratio: &Matrix) -> Option<Matrix> {
    let matrix = DMatrix::from_fn(joints, joints, |i, j| ratio[i][j]);
    let mut scaled = matrix.clone();
    for mut row in scaled.row_iter_mut() {
        let largest = row.amax();
        row /= largest;
    }
    let singular = scaled.singular_values();
    if singular.min() < MIN_SINGULAR_VALUE_RATIO * singular.max() {
        return None;
    }
    let inverse = matrix.try_inverse()?;
    let mut array = [[0.0; MAX_JOINTS]; MAX_JOINTS];
    for (i, row) in inverse.row_iter().enumerate() {
        for (to, from) in array[i].iter_mut().zip(row.iter()) {
            *to = *from;
        }
    }
    Some(array)
}
