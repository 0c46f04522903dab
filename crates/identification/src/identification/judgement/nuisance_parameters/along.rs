//! Columns of the nuisance parameters along the recorded motion, filtered and decimated like the
//! observation matrix.

use std::borrow::Cow;

use nalgebra::{DMatrix, DVector};

use super::columns::{ColumnsAtStates, NuisanceColumns, bend_of, curvature};
use super::list::{Column, CouplingKind, NuisanceEffect, PRESLIDING_FACTORS};
use crate::identification::observation::{
    AuxiliaryObservation, Motion, MotionGroup, States, hysteresis_along, hysteresis_from,
};
use crate::identification::problem::IdentificationError;
use crate::regression::{FurtherColumn, FurtherColumns, Observations};
use crate::signal::Group;
use didim_dynamics::numeric::{Lanes, Scalar};

/// Number of additional friction laws of each direction: the bends and the curvature.
const EXTRA_LAWS: usize = 4;

/// Largest number of stored values of state-dependent columns: 16 MB.
const MAX_STORED_VALUES: usize = 1 << 21;

/// Matrix C (r × m) of the nuisance parameters. Functions that are not smooth in the speed are
/// filtered themselves; smooth ones are computed from the filtered motion. For long records,
/// columns are computed when they are needed.
pub(in super::super) struct NuisanceObservation<'a> {
    columns: &'a NuisanceColumns<'a>,
    auxiliary: &'a AuxiliaryObservation,
    /// Filtered columns: the additional friction laws of each direction, the sign function of each
    /// joint, and the changes of the hysteresis state with other presliding distances.
    laws: DMatrix<f64>,
    /// Filtered and decimated motion.
    motion: Motion,
    /// Predicted torques of the estimate and their rates (r).
    predicted: DVector<f64>,
    torque_rates: DVector<f64>,
    /// Columns that depend on the states alone (r), by column number. `None` for other columns,
    /// empty for long records.
    state_columns: Vec<Option<DVector<f64>>>,
    /// Rows of the equation that are set to 0, also in the columns.
    zero_rows: Vec<usize>,
}

impl<'a> NuisanceObservation<'a> {
    /// `torque_rates` are those of the estimate along the motion.
    pub(in super::super) fn new(
        columns: &'a NuisanceColumns<'a>,
        motion: &Motion,
        auxiliary: &'a AuxiliaryObservation,
        observations: &Observations,
        torque_rates: DVector<f64>,
    ) -> Result<Self, IdentificationError> {
        let along = Self {
            columns,
            auxiliary,
            laws: law_columns(columns, motion)?,
            motion: decimated_motion(columns, motion)?,
            predicted: observations.predicted(columns.parameters),
            torque_rates,
            state_columns: Vec::new(),
            zero_rows: Vec::new(),
        };
        Ok(along.with_state_columns())
    }

    /// Stores the state-dependent columns, unless there are too many values.
    fn with_state_columns(mut self) -> Self {
        let (rows, joints) = self.motion.position.shape();
        let of_states: Vec<bool> = self.columns.columns.iter().map(is_of_states).collect();
        let several = of_states.iter().filter(|own| **own).count();
        if several * rows * joints > MAX_STORED_VALUES {
            return self;
        }
        let mut stored: Vec<_> =
            of_states.iter().map(|own| own.then(|| DVector::zeros(rows * joints))).collect();
        self.columns.for_each_state(&self.motion, |first, of_state| {
            for (column, to) in self.columns.columns.iter().zip(&mut stored) {
                let Some(to) = to else { continue };
                let Some(torque) = of_state.torque(column) else { continue };
                for (to, torque) in to.as_mut_slice().chunks_exact_mut(rows).zip(torque) {
                    to[first..].iter_mut().zip(torque.0).for_each(|(to, value)| *to = value);
                }
            }
        });
        self.state_columns = stored;
        self
    }

    /// Returns the columns with these rows set to 0.
    #[must_use]
    pub(in super::super) fn with_zero_rows(mut self, rows: Vec<usize>) -> Self {
        self.zero_rows = rows;
        self
    }

    /// Returns the complete matrix.
    pub(in super::super) fn dense_columns(&self) -> DMatrix<f64> {
        let (rows, joints) = self.motion.position.shape();
        let mut dense = DMatrix::zeros(rows * joints, self.count());
        for joint in 0..joints {
            for FurtherColumn { number, factor, values } in self.of_joint(joint) {
                let mut target = dense.view_mut((joint * rows, number), (rows, 1));
                target.iter_mut().zip(&*values).for_each(|(to, value)| *to = factor * value);
            }
        }
        dense
    }

    /// Returns true if a column acts on a joint.
    fn acts_on(&self, column: &Column, joint: usize) -> bool {
        if !self.columns.context.has_torque(joint) {
            return false;
        }
        match &column.effect {
            NuisanceEffect::Bend { direction, .. } | NuisanceEffect::Curvature { direction } => {
                self.columns.directions[*direction].joint_shares[joint] != 0.0
            }
            NuisanceEffect::Neighbour { row: own, .. }
            | NuisanceEffect::Gain(Some(own))
            | NuisanceEffect::Delay(own)
            | NuisanceEffect::OverRange(own)
            | NuisanceEffect::PreslidingDistance { joint: own, .. }
            | NuisanceEffect::KnownTorque { joint: own, .. } => *own == joint,
            NuisanceEffect::Gain(None)
            | NuisanceEffect::Zero(_)
            | NuisanceEffect::Scale(_)
            | NuisanceEffect::Geometry(_) => true,
            NuisanceEffect::LeftOut(index) => self.auxiliary.left_out.acts_on(joint, *index),
        }
    }

    /// Returns the stored values of a column in the rows of a joint, with their factor; `None` if
    /// the column has to be computed from the states.
    fn of_record(&self, number: usize, joint: usize) -> Option<(f64, &[f64])> {
        let rows = self.motion.position.nrows();
        let of_joint = joint * rows..(joint + 1) * rows;
        if let Some(Some(fixed)) = self.state_columns.get(number) {
            return Some((1.0, &fixed.as_slice()[of_joint]));
        }
        let column = &self.columns.columns[number];
        let law = |index: usize| &self.laws.as_slice()[index * rows..(index + 1) * rows];
        let share = |direction: usize| self.columns.directions[direction].joint_shares[joint];
        Some(match column.effect {
            NuisanceEffect::Bend { direction, bend } => {
                (share(direction), law(EXTRA_LAWS * direction + bend))
            }
            NuisanceEffect::Curvature { direction } => {
                (share(direction), law(EXTRA_LAWS * direction + EXTRA_LAWS - 1))
            }
            NuisanceEffect::Neighbour { of, by: CouplingKind::Sign, .. } => {
                (1.0, law(EXTRA_LAWS * self.columns.directions.len() + of))
            }
            NuisanceEffect::PreslidingDistance { number, .. } => {
                (1.0, law(EXTRA_LAWS * self.columns.directions.len() + self.joints() + number))
            }
            NuisanceEffect::Gain(_) => (1.0, &self.predicted.as_slice()[of_joint]),
            NuisanceEffect::Delay(_) => (1.0, &self.torque_rates.as_slice()[of_joint]),
            NuisanceEffect::LeftOut(index) => {
                (1.0, self.auxiliary.left_out.column_of(joint, index)?)
            }
            _ => return None,
        })
    }

    /// Visits the states of the record, unless the columns that depend on them are stored in
    /// `state_columns`.
    fn visit_states_unless_kept(&self, visit: impl FnMut(usize, &mut ColumnsAtStates<'_>)) {
        if self.state_columns.is_empty() {
            self.columns.for_each_state(&self.motion, visit);
        }
    }

    fn joints(&self) -> usize {
        self.motion.position.ncols()
    }

    /// Returns the columns that act on a joint, each with its number.
    fn acting_columns(&self, joint: usize) -> impl Iterator<Item = (usize, &Column)> {
        let numbered = self.columns.columns.iter().enumerate();
        numbered.filter(move |(_, column)| self.acts_on(column, joint))
    }
}

impl FurtherColumns for NuisanceObservation<'_> {
    fn count(&self) -> usize {
        self.columns.columns.len()
    }

    fn of_joint(&self, joint: usize) -> Vec<FurtherColumn<'_>> {
        let rows = self.motion.position.nrows();
        let mut columns: Vec<_> = self
            .acting_columns(joint)
            .map(|(number, column): (usize, &Column)| match self.of_record(number, joint) {
                Some((share, values)) => FurtherColumn {
                    number,
                    factor: column.deviation * share,
                    values: Cow::Borrowed(values),
                },
                None => FurtherColumn {
                    number,
                    factor: column.deviation,
                    values: Cow::Owned(vec![0.0; rows]),
                },
            })
            .collect();
        self.visit_states_unless_kept(|first, of_state| {
            for FurtherColumn { number, values, .. } in &mut columns {
                let Cow::Owned(to) = values else { continue };
                let Some(torque) = of_state.torque(&self.columns.columns[*number]) else {
                    continue;
                };
                to[first..].iter_mut().zip(torque[joint].0).for_each(|(to, value)| *to = value);
            }
        });
        for row in self.zero_rows.iter().filter(|row| *row / rows == joint) {
            columns.iter_mut().for_each(|column| column.values.to_mut()[row % rows] = 0.0);
        }
        columns
    }

    fn weighted_sum(&self, nuisance_parameters: &DVector<f64>) -> DVector<f64> {
        let (rows, joints) = self.motion.position.shape();
        let mut sum = DVector::zeros(rows * joints);
        let terms = || self.columns.columns.iter().zip(nuisance_parameters);
        for (joint, to) in sum.as_mut_slice().chunks_exact_mut(rows).enumerate() {
            for (number, (column, nuisance)) in terms().enumerate() {
                let source = self.acts_on(column, joint).then(|| self.of_record(number, joint));
                let Some((share, from)) = source.flatten() else { continue };
                let share = nuisance * column.deviation * share;
                to.iter_mut().zip(from).for_each(|(to, value)| *to += share * value);
            }
        }
        let of_states: Vec<_> = terms().filter(|(column, _)| is_of_states(column)).collect();
        self.visit_states_unless_kept(|first, of_state| {
            for (column, nuisance) in &of_states {
                let Some(torque) = of_state.torque(column) else { continue };
                let share = *nuisance * column.deviation;
                for (to, torque) in sum.as_mut_slice().chunks_exact_mut(rows).zip(torque) {
                    to[first..].iter_mut().zip(torque.0).for_each(|(to, value)| {
                        *to += share * value;
                    });
                }
            }
        });
        for row in &self.zero_rows {
            sum[*row] = 0.0;
        }
        sum
    }
}

/// Returns true if a column can be computed from the filtered state of the arm.
fn is_of_states(column: &Column) -> bool {
    match column.effect {
        NuisanceEffect::Neighbour { by, .. } => !matches!(by, CouplingKind::Sign),
        NuisanceEffect::KnownTorque { .. }
        | NuisanceEffect::Zero(_)
        | NuisanceEffect::Scale(_)
        | NuisanceEffect::OverRange(_)
        | NuisanceEffect::Geometry(_) => true,
        NuisanceEffect::Bend { .. }
        | NuisanceEffect::Curvature { .. }
        | NuisanceEffect::PreslidingDistance { .. }
        | NuisanceEffect::Gain(_)
        | NuisanceEffect::Delay(_)
        | NuisanceEffect::LeftOut(_) => false,
    }
}

/// Returns the columns that are not smooth over the motion, filtered and decimated: the laws of
/// each direction and the sign function of each joint.
fn law_columns(
    columns: &NuisanceColumns<'_>,
    motion: &Motion,
) -> Result<DMatrix<f64>, IdentificationError> {
    let joints = motion.position.ncols();
    let (context, directions) = (columns.context, &columns.directions);
    let mut group = MotionGroup::of_joints(joints);
    let ends = context.experiment.ends();
    let other_ways = PRESLIDING_FACTORS.map(|share| {
        let state = context.model.history().map(|own| own.with_scaled_distances(share));
        hysteresis_along(state, &ends, |k| motion.position_at(k))
    });
    let lagging: Vec<usize> = context.model.hysteresis().map(|(joint, _)| joint).collect();
    let mut read = |first: usize, signals: &mut [Group]| {
        let (laws, signals) = signals.split_at_mut(EXTRA_LAWS * directions.len());
        let (signs, presliding) = signals.split_at_mut(joints);
        let States { dq, hysteresis, .. } = group.read(motion, first);
        for (laws, direction) in laws.chunks_exact_mut(EXTRA_LAWS).zip(directions) {
            let mut u = Lanes::zero();
            for (speed, share) in dq.iter().zip(&direction.joint_shares) {
                if *share != 0.0 {
                    u += *speed * Lanes::constant(*share);
                }
            }
            for (bend, law) in laws.iter_mut().enumerate().take(EXTRA_LAWS - 1) {
                *law = bend_of(direction, bend, u);
            }
            laws[EXTRA_LAWS - 1] = curvature(direction, u);
        }
        for (joint, (sign, speed)) in signs.iter_mut().zip(dq).enumerate() {
            *sign = context.robot.sign_model(joint).value(*speed);
        }
        let Some(own) = hysteresis else { return };
        let others = PRESLIDING_FACTORS.len();
        for (other, shares) in other_ways.iter().enumerate() {
            let Some(shares) = hysteresis_from(shares, first) else { return };
            for (number, joint) in lagging.iter().enumerate() {
                presliding[others * number + other] = shares[*joint] - own[*joint];
            }
        }
    };
    let signals = EXTRA_LAWS * directions.len() + joints + PRESLIDING_FACTORS.len() * lagging.len();
    let rows = context.decimate_signals(signals, &mut read);
    rows.map_err(IdentificationError::RegressorFilter)
}

/// Returns the filtered and decimated motion.
fn decimated_motion(
    columns: &NuisanceColumns<'_>,
    motion: &Motion,
) -> Result<Motion, IdentificationError> {
    let joints = motion.position.ncols();
    let mut group = MotionGroup::of_joints(joints);
    let mut read = |first: usize, signals: &mut [Group]| {
        let States { q, dq, ddq, .. } = group.read(motion, first);
        signals.iter_mut().zip(q.iter().chain(dq).chain(ddq)).for_each(|(to, from)| *to = *from);
    };
    let rows = columns.context.decimate_signals(3 * joints, &mut read);
    let rows = rows.map_err(IdentificationError::RegressorFilter)?;
    let [position, velocity, acceleration] =
        core::array::from_fn(|part| rows.columns(part * joints, joints).into_owned());
    Ok(Motion::from_matrices(position, velocity, acceleration))
}
