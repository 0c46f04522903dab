//! Residuals of alternative readings at some rows, at a small fraction of the cost of a fit.

use std::borrow::Cow;

use nalgebra::{DMatrix, DVector, DVectorView};

use super::alternative::{Alternative, Lag, Signal};
use super::gravity_columns::GravityColumns;
use super::lean::{Lean, better_gravity};
use super::normal_equations::{DEPENDENT, NormalEquations};
use super::refit::Refit;
use crate::identification::observation::{Motion, known_at, matrix_at};
use crate::identification::problem::{
    Context, change_motor_positions, to_joint_torques, to_motor_torques,
};
use core::ops::Range;
use didim_dynamics::dynamics::Model;
use didim_dynamics::robot::Robot;

/// Number of rows of each joint that are used.
const ROWS: usize = 100;

/// Difference of the gains inside which a number has its confidence interval of 95 %: half of the
/// quantile of χ² with one degree of freedom, divided among the rows \[nat per row\].
pub(super) const RESOLUTION: f64 = 1.92 / ROWS as f64;

/// The same for a direction, which has two degrees of freedom.
pub(super) const RESOLUTION_OF_DIRECTION: f64 = 3.0 / ROWS as f64;

/// Gauss-Newton steps to a direction of gravity. Angles of 45° are right to 0.1° after three.
const LEAN_STEPS: usize = 4;

/// Share of the golden ratio. Rows at its multiples never coincide with a period of the motion.
const GOLDEN: f64 = 0.618_033_988_749_894_9;

/// Some rows of a fit.
pub(super) struct Screen<'s, 'a> {
    context: &'s Context<'a>,
    picked_rows: Vec<usize>,
    /// The motion at the picked rows (rows × joints).
    motion: Motion,
    /// Torques at the picked rows (rows × joints).
    torque: DMatrix<f64>,
    /// Torques of all rows (rows × motors).
    motor_torque: DMatrix<f64>,
    /// Rows that follow each other without a gap.
    segments: Vec<Range<usize>>,
    configured: Rows,
    /// Weight of each joint: 1 divided by its squared configured torque, 0 without torque.
    weights: Vec<f64>,
    /// Last corrected positions, with their regressor. Several alternatives share them.
    last_corrected: Option<(Alternative, Rows)>,
}

/// Regressor at the picked rows.
struct Rows {
    equations: NormalEquations,
    known_torque: Option<DVector<f64>>,
}

impl<'s, 'a> Screen<'s, 'a> {
    /// Picks rows of a fit. `None` if it has none, or if they are not finite.
    pub(super) fn new(refit: &'s Refit<'a>) -> Option<Self> {
        let Refit { context, motion, torque, .. } = refit;
        let (samples, joints) = (&context.samples, context.robot.joints());
        let rows = samples.len();
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a place")]
        let place = |k: usize| ((GOLDEN * k as f64).fract() * rows as f64) as usize;
        let picked_rows: Vec<usize> = (0..if rows > 0 { ROWS } else { 0 }).map(place).collect();
        let at = |value: &dyn Fn(usize, usize) -> f64| {
            DMatrix::from_fn(picked_rows.len(), joints, |k, j| value(samples[picked_rows[k]], j))
        };
        let motion = Motion::from_matrices(
            at(&|sample, joint| motion.position[(sample, joint)]),
            at(&|sample, joint| motion.velocity(sample, joint)),
            at(&|sample, joint| motion.acceleration(sample, joint)),
        );
        let columns = context.selection.columns();
        let configured = Rows::new(context, &context.model, columns, &motion)?;
        let factor = context.decimation.factor();
        let all_torques = DMatrix::from_column_slice(rows, joints, torque.as_slice());
        let torque = all_torques.select_rows(&picked_rows);
        let motor_torque = to_motor_torques(all_torques, context.robot.transmission());
        let segments = segments(samples, factor);
        let powers = configured.powers(&torque);
        let weights = powers.iter().map(|power| if *power > 0.0 { 1.0 / power } else { 0.0 });
        let weights = weights.collect();
        Some(Self {
            context,
            picked_rows,
            motion,
            torque,
            motor_torque,
            segments,
            configured,
            weights,
            last_corrected: None,
        })
    }

    /// Returns the range of each motor at the picked rows \[rad or m\].
    pub(super) fn ranges(&self) -> Vec<f64> {
        let mut positions = self.motion.position.clone();
        let mut ranges = Vec::new();
        change_motor_positions(&mut positions, self.context.robot.transmission(), |motors| {
            ranges = motors.column_iter().map(|of| of.max() - of.min()).collect();
        });
        ranges
    }

    /// Returns the squared residual of each joint, relative to its squared torque, with the
    /// configured reading. `None` without a finite solution.
    pub(super) fn configured(&mut self) -> Option<Vec<f64>> {
        self.configured.relative_squares(&self.torque, &self.weights)
    }

    /// Returns the same with another reading. `None` also if the arm cannot reach its positions.
    pub(super) fn with(&mut self, alternative: &Alternative) -> Option<Vec<f64>> {
        let torque = self.corrected_torque(alternative);
        let weights = alternative.weights(&self.weights);
        let own_columns = self.context.selection.columns();
        if let Some(gravity_m_s2) = alternative.gravity_m_s2() {
            let model = self.context.model.clone().with_gravity(gravity_m_s2);
            let mut rows = Rows::new(self.context, &model, &self.all_columns(), &self.motion)?;
            return rows.relative_squares(&torque, &weights);
        }
        if let Some(robot) = alternative.arm(self.context.robot) {
            let motion = self.corrected_motion(alternative);
            if !self.is_reachable(&motion.position) {
                return None;
            }
            let columns = columns_of(&robot, self.context.robot, own_columns);
            let mut rows = Rows::new(self.context, &Model::new(&robot), &columns, &motion)?;
            return rows.relative_squares(&torque, &weights);
        }
        let Some(of_positions) = alternative.of_positions() else {
            return self.configured.relative_squares(&torque, &weights);
        };
        if self.last_corrected.as_ref().is_none_or(|(last, _)| *last != of_positions) {
            let motion = self.corrected_motion(&of_positions);
            if !self.is_reachable(&motion.position) {
                return None;
            }
            let rows = Rows::new(self.context, &self.context.model, own_columns, &motion)?;
            self.last_corrected = Some((of_positions, rows));
        }
        self.last_corrected.as_mut()?.1.relative_squares(&torque, &weights)
    }

    /// Returns the motion through the filter of the rows, at all rows: position, velocity and
    /// acceleration (rows × joints each).
    pub(super) fn filtered_motion(&self, motion: &Motion) -> Option<[DMatrix<f64>; 3]> {
        let (rows, joints) = (self.motor_torque.nrows(), self.motor_torque.ncols());
        let mut filtered = motion.matrices();
        for of in &mut filtered {
            let values = self.context.rows_of(of, "motion").ok()?;
            *of = DMatrix::from_column_slice(rows, joints, values.as_slice());
        }
        Some(filtered)
    }

    /// Returns the same as [`Self::with`] for a low-pass of all signals. Undone, it amplifies what
    /// the filter of the rows removes, so that the motion is the filtered one.
    pub(super) fn without_low_pass(
        &self,
        alternative: &Alternative,
        filtered_motion: &[DMatrix<f64>; 3],
    ) -> Option<Vec<f64>> {
        let Alternative::Late { lag, time_s, .. } = alternative else { return None };
        let rows = time_s.value * self.context.rows_hz();
        let [q, dq, ddq] = filtered_motion.each_ref().map(|of| {
            let columns = of.column_iter().map(|column| self.shifted(&column, *lag, rows, false));
            let picked = columns.flat_map(|all| self.picked_rows.iter().map(move |row| all[*row]));
            DMatrix::from_iterator(self.picked_rows.len(), of.ncols(), picked)
        });
        let motion = Motion::from_matrices(q, dq, ddq);
        let columns = self.context.selection.columns();
        let mut rows = Rows::new(self.context, &self.context.model, columns, &motion)?;
        rows.relative_squares(&self.corrected_torque(alternative), &self.weights)
    }

    /// Returns the selected columns, and those that another gravity makes identifiable.
    fn all_columns(&self) -> Vec<usize> {
        let find = |name: &String| self.context.robot.parameters().find(name);
        let hidden = self.context.base.without_effect().iter().filter_map(find);
        self.context.selection.columns().iter().copied().chain(hidden).collect()
    }

    /// Returns the gravity that fits best near another direction, or near the configured one, with
    /// the squared residuals as by [`Self::with`]. `None` if it is the configured one.
    pub(super) fn lean(&self, other_m_s2: Option<[f64; 3]>) -> Option<(Lean, Vec<f64>)> {
        let configured = self.context.model.gravity_m_s2();
        // Near the configured direction, what another one makes identifiable has next to no effect,
        // and would explain anything.
        let columns = match other_m_s2 {
            Some(_) => self.all_columns(),
            None => self.context.selection.columns().to_vec(),
        };
        let arm = (self.context.robot, &self.context.model);
        let columns = GravityColumns::at(arm, &columns, &self.motion)?;
        let torque = self.configured.explained(&self.torque);
        let torque = DVector::from_column_slice(torque.as_slice());
        let mut gravity_m_s2 = other_m_s2.unwrap_or(configured);
        for _ in 0..LEAN_STEPS {
            gravity_m_s2 = better_gravity(&columns, gravity_m_s2, &torque, &self.weights)?;
        }
        let mut equations = NormalEquations::new(&columns.matrix(gravity_m_s2), DEPENDENT);
        let solution = equations.solve(torque.as_slice(), &self.weights)?;
        let squares = finite(equations.relative_squares(&solution))?;
        Some((Lean::between(configured, gravity_m_s2)?, squares))
    }

    /// Returns true unless the positions of a joint span more than its limits allow, and more than
    /// the configured reading does. A zero may be wrong, so that the limits themselves say nothing.
    fn is_reachable(&self, position: &DMatrix<f64>) -> bool {
        let span = |of: DVectorView<'_, f64>| of.max() - of.min();
        let mut limits = self.context.robot.limits().enumerate();
        limits.all(|(joint, limits)| {
            let own = span(position.column(joint));
            own <= limits.position_max - limits.position_min
                || own <= span(self.motion.position.column(joint))
        })
    }

    fn corrected_motion(&self, alternative: &Alternative) -> Motion {
        let transmission = self.context.robot.transmission();
        let mut corrected = self.motion.matrices();
        for of in &mut corrected {
            change_motor_positions(of, transmission, |motors| {
                alternative.correct_positions(motors, transmission);
            });
        }
        let [q, dq, ddq] = corrected;
        Motion::from_matrices(q, dq, ddq)
    }

    /// Returns the corrected torques at the picked rows. Late positions are compared with torques
    /// that are equally late.
    fn corrected_torque(&self, alternative: &Alternative) -> DMatrix<f64> {
        let transmission = self.context.robot.transmission();
        let mut motors = self.motor_torque.select_rows(&self.picked_rows);
        alternative.correct_torques(&mut motors, transmission);
        if let Alternative::Late { signal, lag, time_s, .. } = alternative {
            let is_position = *signal == Signal::Position;
            let rows = time_s.value * self.context.rows_hz();
            for motor in alternative.late_motors(*signal, motors.ncols()) {
                let late = self.shifted(&self.motor_torque.column(motor), *lag, rows, is_position);
                for (to, row) in motors.column_mut(motor).iter_mut().zip(&self.picked_rows) {
                    *to = late[*row];
                }
            }
        }
        to_joint_torques(&mut motors, transmission);
        motors
    }

    /// Returns a signal of all rows without a lag of some rows, or with it.
    fn shifted(
        &self,
        signal: &DVectorView<'_, f64>,
        lag: Lag,
        rows: f64,
        is_added: bool,
    ) -> Vec<f64> {
        let of_segment =
            |of: &Range<usize>| shifted(&signal.rows_range(of.clone()), lag, rows, is_added);
        self.segments.iter().flat_map(of_segment).collect()
    }
}

/// Returns the columns of another arm: those of the same names, and new ones.
fn columns_of(robot: &Robot, configured: &Robot, columns: &[usize]) -> Vec<usize> {
    let (table, names) = (robot.parameters(), configured.parameters().names());
    let same = columns.iter().filter_map(|column| table.find(&names[*column]));
    let new = (0..table.names().len()).filter(|column| !names.contains(&table.names()[*column]));
    same.chain(new).collect()
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
        let matrix = matrix_at(model, columns, states).ok()?;
        let known_torque = known_at(context, states).ok()?;
        Some(Self { equations: NormalEquations::new(&matrix, DEPENDENT), known_torque })
    }

    /// Returns the squared torque of each joint that the model has to explain.
    fn powers(&self, torque: &DMatrix<f64>) -> Vec<f64> {
        self.explained(torque).column_iter().map(|own| own.norm_squared()).collect()
    }

    /// Returns the torques without the known ones.
    fn explained<'t>(&self, torque: &'t DMatrix<f64>) -> Cow<'t, DMatrix<f64>> {
        let (rows, joints) = torque.shape();
        match &self.known_torque {
            Some(known_torque) => Cow::Owned(
                torque - DMatrix::from_column_slice(rows, joints, known_torque.as_slice()),
            ),
            None => Cow::Borrowed(torque),
        }
    }

    /// Returns the squared residual of each joint, relative to its squared torque, after a least
    /// squares fit with these weights of the joints. 0 for a joint without torque.
    fn relative_squares(&mut self, torque: &DMatrix<f64>, weights: &[f64]) -> Option<Vec<f64>> {
        let torque = self.explained(torque);
        let solution = self.equations.solve(torque.as_slice(), weights)?;
        finite(self.equations.relative_squares(&solution))
    }
}

/// Returns values that are all finite.
fn finite(values: Vec<f64>) -> Option<Vec<f64>> {
    values.iter().all(|value| value.is_finite()).then_some(values)
}
