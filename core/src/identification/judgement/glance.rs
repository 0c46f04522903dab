//! What a model leaves of signals, at a fraction of the cost of a fit: it tells from each other what fits far better and what does not.

use nalgebra::{Cholesky, DMatrix, DVector};

use super::refitted::of_signals;
use crate::dynamics::Model;
use crate::identification::given::{
    Context, Experiment, IdentificationError, exchange_positions, exchange_torques,
};
use crate::identification::observation::{Motion, filtered_torque, known_at, regressor_rows};
use crate::regression::symmetric_product;
use crate::robot::Transmission;

/// Samples of each joint that are looked at.
const SAMPLES: usize = 100;

/// What is left of the torques: squares, over all joints.
pub(super) struct Left {
    /// Of what is left of each joint's torque, relative to it.
    pub(super) relative: f64,
    /// Of what is left \[N²·m² or N²\].
    pub(super) absolute: f64,
}

/// What is added to the squares of columns of length 1: of those that depend on each other none is preferred.
const DEPENDENT: f64 = 1e-9;

/// Of the longest column, what one has at least that is more than rounding.
const SHORTEST: f64 = 1e-9;

/// Some samples of an experiment (samples × joints each): the torque behind the parallel filter, the states without it.
pub(super) struct Glance {
    /// q, q̇ and q̈.
    motion: [DMatrix<f64>; 3],
    torque: DMatrix<f64>,
}

impl Glance {
    /// At signals of the arm of a context.
    pub(super) fn at(
        context: &Context<'_>,
        experiment: &Experiment,
    ) -> Result<Self, IdentificationError> {
        let (context, motion) = of_signals(context, experiment)?;
        let (samples, joints) = (&context.samples, context.robot.joints());
        let all = filtered_torque(&context)?;
        let every = samples.len().div_ceil(SAMPLES).max(1);
        let count = samples.len().div_ceil(every);
        let of = |value: &dyn Fn(usize, usize) -> f64| DMatrix::from_fn(count, joints, value);
        let at = |k: usize| samples[every * k];
        let motion = [
            of(&|k, joint| motion.position[(at(k), joint)]),
            of(&|k, joint| motion.velocity(at(k), joint)),
            of(&|k, joint| motion.acceleration(at(k), joint)),
        ];
        Ok(Self { motion, torque: of(&|k, joint| all[joint * samples.len() + every * k]) })
    }

    /// The same with the signals of two motors exchanged, counted from 0: all joints' pass the same filters.
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

    /// What a model leaves whose parameters of these columns leave the least squares of the relative errors of all joints, whether
    /// or not the motion shows all of them. None where it has no finite solution.
    pub(super) fn left(
        &self,
        context: &Context<'_>,
        model: &Model,
        columns: &[usize],
    ) -> Option<Left> {
        let (rows, joints) = self.torque.shape();
        let [position, velocity, acceleration] = self.motion.clone();
        let states = Motion::of(position, velocity, acceleration);
        let mut regressor = regressor_rows(model, columns, &states).ok()?;
        let mut torque = DVector::from_column_slice(self.torque.as_slice());
        if let Some(known) = known_at(context, &states).ok()? {
            torque -= known;
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
        let absolute = levels.iter().enumerate().map(|(joint, own)| squares(joint) * own * own);
        let found = Left { relative: (0..joints).map(squares).sum(), absolute: absolute.sum() };
        found.absolute.is_finite().then_some(found)
    }
}
