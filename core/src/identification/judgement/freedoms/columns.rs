//! The torques of every freedom: along the motion that was recorded, and at any state.

use nalgebra::{DMatrix, DVector};

use super::list::{Acts, Column, Direction, Motive, Observed, STEP, Sizes};
use super::{Freedom, FreedomEstimate, Quantity};
use crate::MAX_JOINTS;
use crate::identification::given::{Context, IdentificationError};
use crate::identification::observation::{
    BesideObservation, InverseDynamics, Motion, MotionGroup, regressor_rows,
};
use crate::numeric::{Lanes, Scalar, WIDTH, vectorised};
use crate::regression::{JointSolution, Observations};
use crate::robot::JointKind;
use crate::signal::{Group, group_of};

/// Friction laws of each direction beside the model's: the bends and the curvature.
const LAWS: usize = 4;

/// Signals of each joint: its sign function, and q, q̇ and q̈.
const OF_A_JOINT: usize = 4;

/// Where the data take less than this share of a freedom's variance away, they say nothing of it.
const LEAST_TOLD: f64 = 0.1;

/// The freedoms of a fitted model, each column in its standard deviations beforehand.
pub(in super::super) struct Columns<'a> {
    context: &'a Context<'a>,
    columns: Vec<Column>,
    directions: Vec<Direction>,
    /// The regressor's columns that are not selected.
    left_out: Vec<usize>,
    parameters: &'a DVector<f64>,
    observed: Observed,
}

impl<'a> Columns<'a> {
    /// What was observed has to fit the context.
    pub(in super::super) fn new(
        context: &'a Context<'a>,
        parameters: &'a DVector<f64>,
        observed: Observed,
    ) -> Self {
        let selected = context.selection.columns();
        let left_out = context.base.columns().iter().filter(|own| !selected.contains(own));
        let left_out = left_out.copied().collect();
        let sizes = Sizes { context, parameters, observed: &observed };
        let directions = sizes.directions();
        let columns = sizes.columns(&directions);
        Self { context, columns, directions, left_out, parameters, observed }
    }

    /// With other standard deviations beforehand, where there are as many.
    pub(in super::super) fn with_deviations(mut self, deviations: &[f64]) -> Option<Self> {
        for (column, deviation) in self.columns.iter_mut().zip(deviations) {
            column.deviation = *deviation;
        }
        (self.columns.len() == deviations.len()).then_some(self)
    }

    /// Standard deviations beforehand, each in the unit of its column's coefficient.
    pub(in super::super) fn deviations(&self) -> Vec<f64> {
        self.columns.iter().map(|column| column.deviation).collect()
    }

    pub(in super::super) fn observed(&self) -> &Observed {
        &self.observed
    }

    /// Root mean square of the measured torque of each joint \[N·m or N\].
    pub(in super::super) fn torque(&self) -> &[f64] {
        &self.observed.torque_nm
    }

    /// Along the recorded motion, filtered and decimated as the observation matrix, the rows of each joint
    /// together (r × m). What bends with the speed goes through the filter itself; what is smooth is
    /// that of the filtered motion.
    pub(in super::super) fn along(
        &self,
        motion: &Motion,
        beside: &BesideObservation,
        observations: &Observations,
    ) -> Result<DMatrix<f64>, IdentificationError> {
        let signals = self.signals(motion)?;
        let joints = self.context.robot.joints();
        let first = LAWS * self.directions.len();
        let signal =
            |joint: usize, which: usize| signals.column(first + OF_A_JOINT * joint + which);
        let [position, velocity, acceleration] = [1, 2, 3].map(|which| {
            DMatrix::from_fn(signals.nrows(), joints, |row, joint| signal(joint, which)[row])
        });
        let decimated = Motion { position, velocity, acceleration };
        let mut rows = self.at(&decimated, &beside.left_out);
        let predicted = observations.predicted(self.parameters);
        let rates = beside.torque_rates(self.parameters);
        for (column, mut to) in self.columns.iter().zip(rows.column_iter_mut()) {
            let deviation = column.deviation;
            let mut set = |joint: usize, values: &mut dyn Iterator<Item = f64>| {
                let range = observations.joint_rows(joint);
                for (to, value) in to.rows_range_mut(range).iter_mut().zip(values) {
                    *to = deviation * value;
                }
            };
            let law = |direction: usize, law: usize| signals.column(LAWS * direction + law);
            match column.acts {
                Acts::Bend { direction, .. } | Acts::Curvature { direction } => {
                    let number = match column.acts {
                        Acts::Bend { bend, .. } => bend,
                        _ => LAWS - 1,
                    };
                    for (joint, share) in self.directions[direction].shares.iter().enumerate() {
                        set(joint, &mut law(direction, number).iter().map(|value| share * value));
                    }
                }
                Acts::Neighbour { row, of, by: Motive::Sign } => {
                    set(row, &mut signal(of, 0).iter().copied());
                }
                Acts::Gain(wanted) => {
                    for joint in (0..joints).filter(|j| wanted.is_none_or(|wanted| wanted == *j)) {
                        let own = predicted.rows_range(observations.joint_rows(joint));
                        set(joint, &mut own.iter().copied());
                    }
                }
                Acts::Delay(joint) => {
                    let own = rates.rows_range(observations.joint_rows(joint));
                    set(joint, &mut own.iter().copied());
                }
                _ => {}
            }
        }
        Ok(rows)
    }

    /// At the states of a motion, whatever came before them; `left_out` has the columns of the parameters that
    /// are left out there.
    ///
    /// A delay acts on nothing there: it is in the record, not in the arm.
    pub(in super::super) fn at(&self, states: &Motion, left_out: &DMatrix<f64>) -> DMatrix<f64> {
        let (count, joints) = states.position.shape();
        let mut rows = DMatrix::zeros(count * joints, self.columns.len());
        let mut group = MotionGroup::of_joints(joints);
        let mut dynamics = InverseDynamics::of_the_estimate(self.context, self.parameters);
        for first in (0..count).step_by(WIDTH) {
            let [q, dq, ddq] = group.read(states, first);
            let predicted = dynamics.torque(&self.context.model, [q, dq, ddq]);
            for (column, to) in
                self.columns.iter().zip(rows.as_mut_slice().chunks_mut(count * joints))
            {
                let mut set = |joint: usize, torque: Group| {
                    let to = &mut to[joint * count + first..(joint + 1) * count];
                    for (to, value) in to.iter_mut().zip(torque.0) {
                        *to = column.deviation * value;
                    }
                };
                let mut along = |direction: usize, law: &dyn Fn(&Direction, Group) -> Group| {
                    let direction = &self.directions[direction];
                    let mut u = Lanes::zero();
                    for (share, speed) in direction.shares.iter().zip(dq) {
                        u += *speed * Lanes::constant(*share);
                    }
                    let torque = law(direction, u);
                    for (joint, share) in direction.shares.iter().enumerate() {
                        set(joint, torque * Lanes::constant(*share));
                    }
                };
                let step_to = |torque: [Group; MAX_JOINTS], set: &mut dyn FnMut(usize, Group)| {
                    for (joint, torque) in torque.into_iter().enumerate().take(joints) {
                        set(joint, (torque - predicted[joint]) * Lanes::constant(1.0 / STEP));
                    }
                };
                match &column.acts {
                    Acts::Bend { direction, bend } => {
                        along(*direction, &|direction, u| bend_of(direction, *bend, u))
                    }
                    Acts::Curvature { direction } => along(*direction, &curvature),
                    Acts::Neighbour { row, of, by } => set(
                        *row,
                        match by {
                            Motive::Speed => dq[*of],
                            Motive::Sign => self.context.robot.sign_model(*of).value(dq[*of]),
                            Motive::Acceleration => ddq[*of],
                        },
                    ),
                    Acts::Gain(wanted) => {
                        let gained = |j: &usize| wanted.is_none_or(|wanted| wanted == *j);
                        (0..joints).filter(gained).for_each(|joint| set(joint, predicted[joint]));
                    }
                    Acts::Known { joint, over_range } => {
                        let (model, q) = (&self.context.model, q[*joint]);
                        let mut known = model.known_torque(*joint, q).unwrap_or(Lanes::zero());
                        if *over_range {
                            let limits = model.chain()[*joint].limits;
                            let middle = 0.5 * (limits.position_max + limits.position_min);
                            let half = 0.5 * (limits.position_max - limits.position_min);
                            known *= (q - Lanes::constant(middle)) * Lanes::constant(1.0 / half);
                        }
                        set(*joint, -known);
                    }
                    Acts::Zero(moved) => {
                        let mut q: Vec<Group> = q.to_vec();
                        q[*moved] += Lanes::constant(STEP);
                        step_to(dynamics.torque(&self.context.model, [&q, dq, ddq]), &mut set);
                    }
                    Acts::Geometry(model) => {
                        step_to(dynamics.torque(model, [q, dq, ddq]), &mut set);
                    }
                    Acts::Delay(_) | Acts::LeftOut(_) => {}
                }
            }
        }
        for (column, mut to) in self.columns.iter().zip(rows.column_iter_mut()) {
            if let Acts::LeftOut(index) = column.acts {
                to.axpy(column.deviation, &left_out.column(index), 0.0);
            }
        }
        rows
    }

    /// The columns of the parameters that are left out, at the states of a motion.
    pub(in super::super) fn left_out_at(
        &self,
        states: &Motion,
    ) -> Result<DMatrix<f64>, IdentificationError> {
        regressor_rows(&self.context.model, &self.left_out, states)
    }

    /// What is not smooth over the motion, and the motion itself, behind the parallel filter.
    fn signals(&self, motion: &Motion) -> Result<DMatrix<f64>, IdentificationError> {
        let joints = motion.velocity.ncols();
        let count = LAWS * self.directions.len() + OF_A_JOINT * joints;
        let motions = [&motion.position, &motion.velocity, &motion.acceleration];
        let mut read = |first: usize, signals: &mut [Group]| {
            vectorised(
                #[inline(always)]
                || {
                    let (laws, of_joints) = signals.split_at_mut(LAWS * self.directions.len());
                    let speed = |joint: usize| group_of(column(&motion.velocity, joint), first);
                    for (laws, direction) in laws.chunks_exact_mut(LAWS).zip(&self.directions) {
                        let mut u = Lanes::zero();
                        for (joint, share) in direction.shares.iter().enumerate() {
                            if *share != 0.0 {
                                u += speed(joint) * Lanes::constant(*share);
                            }
                        }
                        for (bend, law) in laws.iter_mut().enumerate().take(LAWS - 1) {
                            *law = bend_of(direction, bend, u);
                        }
                        laws[LAWS - 1] = curvature(direction, u);
                    }
                    for (joint, signals) in of_joints.chunks_exact_mut(OF_A_JOINT).enumerate() {
                        signals[0] = self.context.robot.sign_model(joint).value(speed(joint));
                        for (signal, motion) in signals[1..].iter_mut().zip(motions) {
                            *signal = group_of(column(motion, joint), first);
                        }
                    }
                },
            );
        };
        let rows = self.context.decimate(count, &mut read);
        rows.map_err(IdentificationError::RegressorFilter)
    }

    /// What a joint solution says of each freedom, the largest torques first. `along` has the columns
    /// along the motion; what the data say of a quantity is as uncertain as the colour of what is left makes it.
    pub(in super::super) fn estimates(
        &self,
        along: &DMatrix<f64>,
        observations: &Observations,
        solution: &JointSolution,
    ) -> Vec<FreedomEstimate> {
        let own = solution.change.len();
        let mut found: Vec<FreedomEstimate> = Vec::new();
        let mut numbers: Vec<Freedom> = Vec::new();
        for column in &self.columns {
            if !numbers.contains(&column.freedom) {
                numbers.push(column.freedom);
            }
        }
        for freedom in numbers {
            let columns =
                || self.columns.iter().enumerate().filter(move |(_, c)| c.freedom == freedom);
            let mut torque = DVector::zeros(along.nrows());
            for (k, _) in columns() {
                torque.axpy(solution.freedoms[k], &along.column(k), 1.0);
            }
            let rms = observations.rms_per_joint(&torque);
            let relative = |joint: usize| rms[joint] / self.torque()[joint];
            let Some(joint) = (0..rms.len()).max_by(|&a, &b| relative(a).total_cmp(&relative(b)))
            else {
                continue;
            };
            let quantity = columns().next().and_then(|(k, column)| {
                let (scale, unit) = self.unit(&column.acts)?;
                let size = column.deviation * scale;
                // What the data alone say: the prior taken out of mean and variance after them.
                let variance = solution.covariance[(own + k, own + k)];
                let told = 1.0 - variance;
                (told > LEAST_TOLD).then(|| Quantity {
                    value: solution.freedoms[k] / told * size,
                    standard_deviation: solution.colour * (variance / told).max(0.0).sqrt() * size,
                    stated: size,
                    unit,
                })
            });
            found.push(FreedomEstimate {
                freedom,
                torque_nm: rms[joint],
                joint: joint + 1,
                relative_torque: relative(joint),
                quantity,
            });
        }
        found.sort_by(|a, b| b.relative_torque.total_cmp(&a.relative_torque));
        found
    }

    /// The unit of a column's coefficient, where it is a quantity, and how many there are to one of SI.
    fn unit(&self, acts: &Acts) -> Option<(f64, &'static str)> {
        let degrees = 1.0_f64.to_degrees();
        match acts {
            Acts::Gain(_) | Acts::Known { .. } => Some((1.0, "1")),
            Acts::Delay(_) => Some((1.0, "s")),
            Acts::Zero(joint) => match self.context.model.chain()[*joint].kind {
                JointKind::Revolute => Some((degrees, "deg")),
                JointKind::Prismatic => Some((1.0, "m")),
            },
            Acts::Geometry(_) => {
                let of = |column: &&Column| core::ptr::eq(&column.acts, acts);
                match self.columns.iter().find(of)?.freedom {
                    Freedom::Twist(_) => Some((degrees, "deg")),
                    _ => Some((1.0, "m")),
                }
            }
            _ => None,
        }
    }
}

/// tanh(u/w) less the model's own sign function.
#[inline(always)]
fn bend_of(direction: &Direction, bend: usize, u: Group) -> Group {
    (u * Lanes::constant(direction.scale(bend))).tanh() - direction.sign.value(u)
}

/// |u| u over the highest speed.
#[inline(always)]
fn curvature(direction: &Direction, u: Group) -> Group {
    u * Lanes(u.0.map(f64::abs)) * Lanes::constant(1.0 / direction.highest)
}

fn column(matrix: &DMatrix<f64>, index: usize) -> &[f64] {
    &matrix.as_slice()[index * matrix.nrows()..(index + 1) * matrix.nrows()]
}
