//! Residuals of alternative readings at some rows, at a small fraction of the cost of a fit.

use nalgebra::{Cholesky, DMatrix, DVector, DVectorView};

use super::alternative::{Alternative, Lag, Signal};
use super::refit::Refit;
use crate::identification::observation::{Motion, known_at, regressor_rows};
use crate::identification::problem::{Context, change_motor_positions, change_motor_torques};
use crate::regression::symmetric_product;
use core::ops::Range;
use didim_dynamics::dynamics::Model;

/// Number of rows of each joint that are used.
const ROWS: usize = 100;

/// Share of the golden ratio. Rows at its multiples never coincide with a period of the motion.
const GOLDEN: f64 = 0.618_033_988_749_894_9;

/// Added to the squared columns, which have length 1, so that columns may depend on each other.
const DEPENDENT: f64 = 1e-9;

/// Shortest column that is more than rounding, as a share of the longest one.
const SHORTEST: f64 = 1e-9;

/// Some rows of a fit.
pub(super) struct Screen<'s, 'a> {
    context: &'s Context<'a>,
    /// Columns of the regressor, also those that only another gravity makes identifiable.
    columns: Vec<usize>,
    picked_rows: Vec<usize>,
    /// q, q̇, q̈ and the rate of q̈ at the picked rows (rows × joints).
    states: [DMatrix<f64>; 4],
    /// Torques of all rows (rows × joints).
    torque: DMatrix<f64>,
    /// Rows that follow each other without a gap.
    segments: Vec<Range<usize>>,
    configured: Rows,
    /// Last corrected positions, with their regressor. Several alternatives share them.
    last_corrected: Option<(Alternative, Rows)>,
}

/// Regressor at the picked rows.
struct Rows {
    regressor: DMatrix<f64>,
    known_torque: Option<DVector<f64>>,
    /// YᵀY of each joint.
    squares: Vec<DMatrix<f64>>,
}

impl<'s, 'a> Screen<'s, 'a> {
    /// Picks rows of a fit. `None` if it has none, or if they are not finite.
    pub(super) fn new(refit: &'s Refit<'a>) -> Option<Self> {
        let Refit { context, motion, torque, .. } = refit;
        let (samples, joints) = (&context.samples, context.robot.joints());
        let (rows, ends) = (samples.len(), context.experiment.ends());
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a place")]
        let place = |k: usize| ((GOLDEN * k as f64).fract() * rows as f64) as usize;
        let picked_rows: Vec<usize> = (0..if rows > 0 { ROWS } else { 0 }).map(place).collect();
        let at = |value: &dyn Fn(usize, usize) -> f64| {
            DMatrix::from_fn(picked_rows.len(), joints, |k, j| value(samples[picked_rows[k]], j))
        };
        let rate_hz = context.experiment.sample_rate_hz();
        let jerk = |sample, joint| jerk(motion, rate_hz, &ends, [sample, joint]);
        let states = [
            at(&|sample, joint| motion.position[(sample, joint)]),
            at(&|sample, joint| motion.velocity(sample, joint)),
            at(&|sample, joint| motion.acceleration(sample, joint)),
            at(&jerk),
        ];
        let find = |name: &String| context.robot.parameters().find(name);
        let hidden = context.base.without_effect().iter().filter_map(find);
        let columns: Vec<usize> =
            context.selection.columns().iter().copied().chain(hidden).collect();
        let [position, velocity, acceleration, _] = states.clone();
        let motion = Motion::from_matrices(position, velocity, acceleration);
        let configured = Rows::new(context, &context.model, &columns, &motion)?;
        let factor = context.decimation.factor();
        let torque = DMatrix::from_column_slice(rows, joints, torque.as_slice());
        let segments = segments(samples, factor);
        Some(Self {
            context,
            columns,
            picked_rows,
            states,
            torque,
            segments,
            configured,
            last_corrected: None,
        })
    }

    /// Returns the range of each motor at the picked rows \[rad or m\].
    pub(super) fn ranges(&self) -> Vec<f64> {
        let mut positions = self.states[0].clone();
        let mut ranges = Vec::new();
        change_motor_positions(&mut positions, self.context.robot.transmission(), |motors| {
            ranges = motors.column_iter().map(|of| of.max() - of.min()).collect();
        });
        ranges
    }

    /// Returns the squared residual of each joint, relative to its squared torque, with the
    /// configured reading. `None` without a finite solution.
    pub(super) fn configured(&self) -> Option<Vec<f64>> {
        self.configured.relative_squares(&self.picked(&self.torque))
    }

    /// Returns the same with another reading.
    pub(super) fn with(&mut self, alternative: &Alternative) -> Option<Vec<f64>> {
        let torque = self.picked(&self.corrected_torque(alternative));
        if let Alternative::Gravity { gravity_m_s2 } = alternative {
            let model = self.context.model.clone().with_gravity(*gravity_m_s2);
            let [position, velocity, acceleration, _] = self.states.clone();
            let motion = Motion::from_matrices(position, velocity, acceleration);
            let rows = Rows::new(self.context, &model, &self.columns, &motion)?;
            return rows.relative_squares(&torque);
        }
        let Some(of_positions) = alternative.of_positions() else {
            return self.configured.relative_squares(&torque);
        };
        if self.last_corrected.as_ref().is_none_or(|(last, _)| *last != of_positions) {
            let motion = self.corrected_states(&of_positions);
            let rows = Rows::new(self.context, &self.context.model, &self.columns, &motion)?;
            self.last_corrected = Some((of_positions, rows));
        }
        self.last_corrected.as_ref()?.1.relative_squares(&torque)
    }

    fn picked(&self, torque: &DMatrix<f64>) -> DMatrix<f64> {
        torque.select_rows(&self.picked_rows)
    }

    fn corrected_states(&self, alternative: &Alternative) -> Motion {
        let [position, velocity, acceleration, jerk] = &self.states;
        if let Alternative::Late { time_s, .. } = alternative {
            return Motion::from_matrices(
                position + velocity * *time_s,
                velocity + acceleration * *time_s,
                acceleration + jerk * *time_s,
            );
        }
        let transmission = self.context.robot.transmission();
        let mut corrected = [position, velocity, acceleration].map(DMatrix::clone);
        for of in &mut corrected {
            change_motor_positions(of, transmission, |motors| {
                alternative.correct_positions(motors);
            });
        }
        let [q, dq, ddq] = corrected;
        Motion::from_matrices(q, dq, ddq)
    }

    /// Returns the corrected torques of all rows. Late positions are compared with torques that are
    /// equally late.
    fn corrected_torque(&self, alternative: &Alternative) -> DMatrix<f64> {
        let mut torque = self.torque.clone();
        change_motor_torques(&mut torque, self.context.robot.transmission(), |motors| {
            alternative.correct_torques(motors);
            let Alternative::Late { signal, lag, time_s, .. } = alternative else { return };
            let is_position = *signal == Signal::Position;
            let signal = if is_position { Signal::Position } else { Signal::Torque };
            let rows = time_s * self.context.rows_hz();
            for motor in alternative.late_motors(signal, motors.ncols()) {
                let column = DVector::from(motors.column(motor));
                for segment in &self.segments {
                    let logged = column.rows_range(segment.clone());
                    let mut to = motors.view_mut((segment.start, motor), (segment.len(), 1));
                    to.copy_from_slice(&shifted(&logged, *lag, rows, is_position));
                }
            }
        });
        torque
    }
}

/// Returns the rate of q̈ at a sample of a joint. `ends` are those of the recordings.
fn jerk(motion: &Motion, rate_hz: f64, ends: &[usize], [sample, joint]: [usize; 2]) -> f64 {
    let from = if ends.contains(&(sample + 1)) { sample - 1 } else { sample };
    (motion.acceleration(from + 1, joint) - motion.acceleration(from, joint)) * rate_hz
}

/// Returns a signal without a lag of some rows, or with it.
fn shifted(logged: &DVectorView<'_, f64>, lag: Lag, rows: f64, is_added: bool) -> Vec<f64> {
    let share = 1.0 - (-1.0 / rows).exp();
    let count = logged.len();
    let mut behind = logged[0];
    let value = |row: usize| match (lag, is_added) {
        (Lag::LowPass, true) => {
            behind += share * (logged[row] - behind);
            behind
        }
        (Lag::LowPass, false) => {
            let before = logged[row.saturating_sub(1)];
            logged[row] + (logged[row] - before) * (1.0 / share - 1.0)
        }
        (Lag::Delay, _) => {
            let place = row as f64 + if is_added { -rows } else { rows };
            let place = place.clamp(0.0, (count - 1) as f64);
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped")]
            let first = (place as usize).min(count.saturating_sub(2));
            let share = place - first as f64;
            logged[first] * (1.0 - share) + logged[(first + 1).min(count - 1)] * share
        }
    };
    (0..count).map(value).collect()
}

/// Returns the rows that follow each other without a gap. Neighbours are `factor` samples apart.
fn segments(samples: &[usize], factor: usize) -> Vec<Range<usize>> {
    let mut segments: Vec<Range<usize>> = Vec::new();
    for (row, sample) in samples.iter().enumerate() {
        let follows = row > 0 && sample.wrapping_sub(samples[row - 1]) == factor;
        match segments.last_mut().filter(|_| follows) {
            Some(segment) => segment.end = row + 1,
            None => segments.push(row..row + 1),
        }
    }
    segments
}

impl Rows {
    fn new(
        context: &Context<'_>,
        model: &Model,
        columns: &[usize],
        states: &Motion,
    ) -> Option<Self> {
        let regressor = regressor_rows(model, columns, states).ok()?;
        let known_torque = known_at(context, states).ok()?;
        let (rows, joints) = states.position.shape();
        let of_joint = |joint: usize| regressor.rows(joint * rows, rows).into_owned();
        let squares = (0..joints).map(of_joint).map(|own| symmetric_product(&own, &own)).collect();
        Some(Self { regressor, known_torque, squares })
    }

    /// Returns the squared residual of each joint, relative to its squared torque, after a least
    /// squares fit of the relative errors of all joints. 0 for a joint without torque.
    fn relative_squares(&self, torque: &DMatrix<f64>) -> Option<Vec<f64>> {
        let (rows, joints) = torque.shape();
        let width = self.regressor.ncols();
        let mut torque = torque.clone();
        if let Some(known_torque) = &self.known_torque {
            torque -= DMatrix::from_column_slice(rows, joints, known_torque.as_slice());
        }
        let powers: Vec<f64> = torque.column_iter().map(|own| own.norm_squared()).collect();
        let (mut normal, mut right) = (DMatrix::zeros(width, width), DVector::zeros(width));
        let products: Vec<DVector<f64>> = (0..joints)
            .map(|joint| self.regressor.rows(joint * rows, rows).tr_mul(&torque.column(joint)))
            .collect();
        for (joint, power) in powers.iter().enumerate().filter(|(_, power)| **power > 0.0) {
            normal += &self.squares[joint] / *power;
            right.axpy(1.0 / power, &products[joint], 1.0);
        }
        let lengths = normal.diagonal().map(f64::sqrt);
        let shortest = SHORTEST * lengths.max();
        let scale = lengths.map(|length| if length > shortest { 1.0 / length } else { 0.0 });
        for (k, mut column) in normal.column_iter_mut().enumerate() {
            column.component_mul_assign(&scale);
            column *= scale[k];
            column[k] += DEPENDENT;
        }
        right.component_mul_assign(&scale);
        let solution = Cholesky::new(normal)?.solve(&right).component_mul(&scale);
        let square = |joint: usize| {
            let own = &self.squares[joint] * &solution;
            let residual =
                powers[joint] - 2.0 * products[joint].dot(&solution) + own.dot(&solution);
            if powers[joint] > 0.0 { residual.max(0.0) / powers[joint] } else { 0.0 }
        };
        let squares: Vec<f64> = (0..joints).map(square).collect();
        squares.iter().all(|value| value.is_finite()).then_some(squares)
    }
}
