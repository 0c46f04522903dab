//! What a model leaves of signals, at a fraction of the cost of a fit: it tells from each other
//! what fits far better and what does not.

use nalgebra::{Cholesky, DMatrix, DVector};

use crate::identification::observation::{Motion, known_at, regressor_rows};
use crate::identification::problem::{Context, exchange_positions, exchange_torques};
use crate::regression::symmetric_product;
use didim_dynamics::MAX_JOINTS;
use didim_dynamics::robot::{JointKind, Transmission};

/// Samples of each joint that are looked at.
const SAMPLES: usize = 100;

/// The golden ratio's share, by which places follow each other that no period of a motion meets
/// again and again.
const GOLDEN: f64 = 0.618_033_988_749_894_9;

/// What is left of the torques: squares, over all joints.
pub(super) struct Residual {
    /// Of what is left of each joint's torque, relative to it.
    pub(super) of_joints: f64,
    /// Of what is left of all torques, and of all forces, relative to them.
    pub(super) of_all: f64,
}

/// What is added to the squares of columns of length 1: of those that depend on each other none is
/// preferred.
const DEPENDENT: f64 = 1e-9;

/// Of the longest column, what one has at least that is more than rounding.
const SHORTEST: f64 = 1e-9;

/// Some samples of an experiment (samples × joints each): the torque behind the parallel filter,
/// the states without it.
pub(super) struct ScreeningFit {
    /// q, q̇ and q̈.
    motion: [DMatrix<f64>; 3],
    torque: DMatrix<f64>,
}

impl ScreeningFit {
    /// Along a motion; `measured` are the torques of the rows that are fitted (r).
    pub(super) fn along(context: &Context<'_>, motion: &Motion, measured: &DVector<f64>) -> Self {
        let (samples, joints) = (&context.samples, context.robot.joints());
        let rows = samples.len();
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a place")]
        let row = |k: usize| ((GOLDEN * k as f64).fract() * rows as f64) as usize;
        let count = if rows > 0 { SAMPLES } else { 0 };
        let of = |value: &dyn Fn(usize, usize) -> f64| DMatrix::from_fn(count, joints, value);
        let motion = [
            of(&|k, joint| motion.position[(samples[row(k)], joint)]),
            of(&|k, joint| motion.velocity(samples[row(k)], joint)),
            of(&|k, joint| motion.acceleration(samples[row(k)], joint)),
        ];
        Self { motion, torque: of(&|k, joint| measured[joint * rows + row(k)]) }
    }

    /// How far each motor goes between any of the samples \[rad or m\].
    pub(super) fn ranges(&self, transmission: &Transmission) -> Vec<f64> {
        let [position, ..] = &self.motion;
        let (joints, mut ranges) = (position.ncols(), [[f64::MAX, f64::MIN]; MAX_JOINTS]);
        let [mut of_joints, mut of_motors] = [[0.0; MAX_JOINTS]; 2];
        for row in position.row_iter() {
            of_joints.iter_mut().zip(row.iter()).for_each(|(to, from)| *to = *from);
            transmission.motor_position(&of_joints[..joints], &mut of_motors[..joints]);
            for ([low, high], value) in ranges.iter_mut().zip(of_motors) {
                (*low, *high) = (low.min(value), high.max(value));
            }
        }
        ranges[..joints].iter().map(|[low, high]| high - low).collect()
    }

    /// The same with the signals of two motors exchanged, counted from 0: all joints' pass the same
    /// filters.
    #[must_use]
    pub(super) fn with_exchanged_motors(
        &self,
        transmission: &Transmission,
        motors: [usize; 2],
    ) -> Self {
        let (mut motion, mut torque) = (self.motion.clone(), self.torque.clone());
        motion.iter_mut().for_each(|of| exchange_positions(of, transmission, motors));
        exchange_torques(&mut torque, transmission, motors);
        Self { motion, torque }
    }

    /// What the model of a context leaves whose parameters of these columns leave the least squares
    /// of the relative errors of all joints, whether or not the motion shows all of them. None
    /// where it has no finite solution.
    pub(super) fn remaining(&self, context: &Context<'_>, columns: &[usize]) -> Option<Residual> {
        let (rows, joints) = self.torque.shape();
        let [position, velocity, acceleration] = self.motion.clone();
        let states = Motion::from_matrices(position, velocity, acceleration);
        let mut regressor = regressor_rows(&context.model, columns, &states).ok()?;
        let mut torque = DVector::from_column_slice(self.torque.as_slice());
        if let Some(known_torque) = known_at(context, &states).ok()? {
            torque -= known_torque;
        }
        let levels: Vec<f64> =
            (0..joints).map(|joint| torque.rows(joint * rows, rows).norm()).collect();
        // A joint without torque leaves none.
        let by = |row: usize| if levels[row / rows] > 0.0 { 1.0 / levels[row / rows] } else { 0.0 };
        torque.iter_mut().enumerate().for_each(|(row, own)| *own *= by(row));
        for mut column in regressor.column_iter_mut() {
            column.iter_mut().enumerate().for_each(|(row, own)| *own *= by(row));
        }
        let longest = regressor.column_iter().map(|column| column.norm()).fold(0.0, f64::max);
        for mut column in regressor.column_iter_mut() {
            // What is shorter is rounding.
            column.try_normalize_mut(SHORTEST * longest);
        }
        let mut normal = symmetric_product(&regressor, &regressor);
        (0..columns.len()).for_each(|k| normal[(k, k)] += DEPENDENT);
        let solution = Cholesky::new(normal)?.solve(&regressor.tr_mul(&torque));
        let left = torque - regressor * solution;
        let squares = |joint: usize| left.rows(joint * rows, rows).norm_squared();
        // N·m and N are not added.
        let of_kind = |kind: JointKind| {
            let own = |joint: &usize| context.robot.chain()[*joint].kind == kind;
            let sums = (0..joints).filter(own).fold([0.0; 2], |[left, torque], joint| {
                let square = levels[joint] * levels[joint];
                [left + squares(joint) * square, torque + square]
            });
            if sums[1] > 0.0 { sums[0] / sums[1] } else { 0.0 }
        };
        let of_all = of_kind(JointKind::Revolute) + of_kind(JointKind::Prismatic);
        let found = Residual { of_joints: (0..joints).map(squares).sum(), of_all };
        found.of_all.is_finite().then_some(found)
    }
}
