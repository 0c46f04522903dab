//! Torques of every nuisance parameter at any state of the arm, and the estimates of the
//! parameters.

use nalgebra::{DMatrix, DVector};

use super::list::{
    Column, CouplingKind, Direction, GEOMETRY_STEP, NuisanceEffect, Observed, PriorSizes,
};
use super::{NuisanceEstimate, NuisanceParameter, Quantity};
use crate::identification::observation::{
    InverseDynamics, Motion, MotionGroup, States, regressor_rows,
};
use crate::identification::problem::{Context, IdentificationError};
use crate::regression::{FreedSolution, JointSolution};
use crate::signal::Group;
use didim_dynamics::MAX_JOINTS;
use didim_dynamics::dynamics::Model;
use didim_dynamics::numeric::{Lanes, Scalar, WIDTH};
use didim_dynamics::robot::{JointIndex, JointKind};

/// Smallest share of a nuisance parameter's prior variance that the data have to remove before the
/// parameter is considered identifiable.
const MIN_IDENTIFIABLE: f64 = 0.1;

/// Nuisance parameters of a fitted model. Each column is scaled by its prior standard deviation.
pub(in super::super) struct NuisanceColumns<'a> {
    pub(super) context: &'a Context<'a>,
    pub(super) columns: Vec<Column>,
    pub(super) directions: Vec<Direction>,
    /// Columns of the regressor that are not selected.
    left_out: Vec<usize>,
    pub(super) parameters: &'a DVector<f64>,
    observed: Observed,
    /// False if only a substitute controller would identify the torque gains.
    are_gains_identifiable: bool,
}

impl<'a> NuisanceColumns<'a> {
    /// Creates the nuisance parameters of a context. `observed` has to belong to this context.
    pub(in super::super) fn new(
        context: &'a Context<'a>,
        parameters: &'a DVector<f64>,
        observed: Observed,
    ) -> Self {
        let selected = context.selection.columns();
        let left_out = context.base.columns().iter().filter(|own| !selected.contains(own));
        let left_out = left_out.copied().collect();
        let sizes = PriorSizes { context, parameters, observed: &observed };
        let directions = sizes.motion_directions();
        let columns = sizes.columns(&directions);
        let are_gains_identifiable = true;
        Self {
            context,
            columns,
            directions,
            left_out,
            parameters,
            observed,
            are_gains_identifiable,
        }
    }

    /// Keeps the configured torque gains, whatever the equation says of them. A simulated loop
    /// relates torques to a controller; a substitute controller is not that of the drives.
    pub(in super::super) fn with_configured_gains(self) -> Self {
        Self { are_gains_identifiable: false, ..self }
    }

    /// Replaces the prior standard deviations; returns `None` if their number differs. Results of
    /// earlier versions do not have the last ones.
    pub(in super::super) fn with_deviations(mut self, deviations: &[f64]) -> Option<Self> {
        let until = |version: usize| {
            self.columns.iter().take_while(|of| of.nuisance.list_version() <= version).count()
        };
        if let Some(count) = [0, 1].map(until).into_iter().find(|of| *of == deviations.len()) {
            self.columns.truncate(count);
        }
        for (column, deviation) in self.columns.iter_mut().zip(deviations) {
            column.deviation = *deviation;
        }
        (self.columns.len() == deviations.len()).then_some(self)
    }

    /// Returns the prior standard deviations, each in the unit of its column's coefficient.
    pub(in super::super) fn deviations(&self) -> Vec<f64> {
        self.columns.iter().map(|column| column.deviation).collect()
    }

    pub(in super::super) fn observed(&self) -> &Observed {
        &self.observed
    }

    /// Returns the root mean square of the measured torque of each joint \[N·m or N\].
    pub(in super::super) fn torque(&self) -> &[f64] {
        &self.observed.torque_nm
    }

    /// Returns the columns at the states of a motion, independent of their history. `left_out` has
    /// the columns of the base parameters that are not selected, at the same states.
    ///
    /// A delay contributes nothing here, because it belongs to the record and not to the arm.
    pub(in super::super) fn at_states(
        &self,
        states: &Motion,
        left_out: &DMatrix<f64>,
    ) -> DMatrix<f64> {
        let (count, joints) = states.position.shape();
        let mut rows = DMatrix::zeros(count * joints, self.columns.len());
        self.for_each_state(states, |first, of_state| {
            for (column, to) in
                self.columns.iter().zip(rows.as_mut_slice().chunks_mut(count * joints))
            {
                let Some(torque) = of_state.torque(column) else { continue };
                for (to, torque) in to.chunks_exact_mut(count).zip(torque) {
                    to[first..].iter_mut().zip(torque.0).for_each(|(to, value)| {
                        *to = column.deviation * value;
                    });
                }
            }
        });
        for (column, mut to) in self.columns.iter().zip(rows.column_iter_mut()) {
            if let NuisanceEffect::LeftOut(index) = column.effect {
                to.axpy(column.deviation, &left_out.column(index), 0.0);
            }
        }
        rows
    }

    /// Calls `visit` for each group of neighbouring states, with the index of the first state and
    /// the quantities that all columns share.
    pub(super) fn for_each_state(
        &self,
        states: &Motion,
        mut visit: impl FnMut(usize, &mut ColumnsAtStates<'_>),
    ) {
        let (count, joints) = states.position.shape();
        let mut group = MotionGroup::of_joints(joints);
        let mut dynamics = InverseDynamics::of_the_estimate(self.context, self.parameters);
        for first in (0..count).step_by(WIDTH) {
            let state = group.read(states, first);
            let predicted = dynamics.torque(&self.context.model, state);
            let (context, directions) = (self.context, self.directions.as_slice());
            visit(
                first,
                &mut ColumnsAtStates {
                    context,
                    directions,
                    dynamics: &mut dynamics,
                    state,
                    predicted,
                },
            );
        }
    }

    /// Returns the columns of the base parameters that are not selected, at the states of a motion.
    pub(in super::super) fn left_out_at(
        &self,
        states: &Motion,
    ) -> Result<DMatrix<f64>, IdentificationError> {
        regressor_rows(&self.context.model, &self.left_out, states)
    }

    /// Returns the estimate of each nuisance parameter, the largest torques first. `squares` are
    /// the products `CᵀC` of `rows` rows of each joint. The uncertainty of a quantity takes the
    /// autocorrelation of the residuals into account.
    pub(in super::super) fn estimates(
        &self,
        squares: &[DMatrix<f64>],
        rows: usize,
        solution: &JointSolution,
        freed: &FreedSolution,
    ) -> Vec<NuisanceEstimate> {
        let mut estimates: Vec<NuisanceEstimate> = Vec::new();
        let mut numbers: Vec<NuisanceParameter> = Vec::new();
        for column in &self.columns {
            if !numbers.contains(&column.nuisance) {
                numbers.push(column.nuisance);
            }
        }
        for nuisance in numbers {
            let columns =
                || self.columns.iter().enumerate().filter(move |(_, c)| c.nuisance == nuisance);
            let own_part: Vec<usize> = columns().map(|(k, _)| k).collect();
            let own_solution = if nuisance.is_distinct() { &freed.solution } else { solution };
            let shares = own_solution.nuisance_parameters.select_rows(&own_part);
            let rms = |squares: &DMatrix<f64>| {
                let part = squares.select_rows(&own_part).select_columns(&own_part);
                (shares.dot(&(part * &shares)).max(0.0) / rows as f64).sqrt()
            };
            let rms: Vec<f64> = squares.iter().map(rms).collect();
            let relative = |joint: usize| match self.context.has_torque(joint) {
                true => rms[joint] / self.torque()[joint],
                false => 0.0,
            };
            let Some(joint) = (0..rms.len()).max_by(|&a, &b| relative(a).total_cmp(&relative(b)))
            else {
                continue;
            };
            let quantity = columns().next().and_then(|(k, column)| {
                let (scale, unit) = self.unit(&column.effect)?;
                let size = column.deviation * scale;
                let [mean, deviation] = freed.by_data(k)?;
                let identified = 1.0 / (1.0 + (deviation / solution.colour_factor).powi(2));
                let is_proven = nuisance.is_distinct() && freed.is_contradicted(k);
                (identified > MIN_IDENTIFIABLE || is_proven).then_some(Quantity {
                    value: mean * size,
                    standard_deviation: deviation * size,
                    configured: size,
                    unit,
                })
            });
            estimates.push(NuisanceEstimate {
                nuisance,
                torque_nm: rms[joint],
                joint: JointIndex::new(joint),
                relative_torque: relative(joint),
                probability: solution.probability(&own_part),
                quantity,
            });
        }
        estimates.sort_by(|a, b| b.relative_torque.total_cmp(&a.relative_torque));
        estimates
    }

    /// Returns for each column whether it is a configured quantity with a unit.
    pub(in super::super) fn has_prior(&self) -> Vec<bool> {
        self.columns.iter().map(|column| self.unit(&column.effect).is_some()).collect()
    }

    /// Returns the unit of a column's coefficient and the number of these units in one SI unit;
    /// `None` if the coefficient is not a configured quantity.
    fn unit(&self, acts: &NuisanceEffect) -> Option<(f64, &'static str)> {
        let degrees = 1.0_f64.to_degrees();
        match acts {
            NuisanceEffect::Gain(_) => self.are_gains_identifiable.then_some((1.0, "1")),
            NuisanceEffect::KnownTorque { .. } | NuisanceEffect::Scale(_) => Some((1.0, "1")),
            NuisanceEffect::Delay(_) => Some((1.0, "s")),
            NuisanceEffect::Zero(joint) => match self.context.model.chain()[*joint].kind {
                JointKind::Revolute => Some((degrees, "deg")),
                JointKind::Prismatic => Some((1.0, "m")),
            },
            NuisanceEffect::Geometry(_) => {
                let is_same = |column: &&Column| core::ptr::eq(&column.effect, acts);
                match self.columns.iter().find(is_same)?.nuisance {
                    NuisanceParameter::Twist(_) | NuisanceParameter::Mounting(_) => {
                        Some((degrees, "deg"))
                    }
                    _ => Some((1.0, "m")),
                }
            }
            _ => None,
        }
    }
}

/// Group of neighbouring states of the arm, with the quantities that all columns share there.
pub(super) struct ColumnsAtStates<'s> {
    context: &'s Context<'s>,
    directions: &'s [Direction],
    dynamics: &'s mut InverseDynamics,
    state: States<'s>,
    /// Torques of the estimate at these states.
    predicted: [Group; MAX_JOINTS],
}

impl ColumnsAtStates<'_> {
    /// Returns the torque of each joint for a unit of a column; `None` if it does not depend on the
    /// state alone.
    pub(super) fn torque(&mut self, column: &Column) -> Option<[Group; MAX_JOINTS]> {
        let (States { q, dq, ddq, .. }, model) = (self.state, &self.context.model);
        let mut torque = [Lanes::zero(); MAX_JOINTS];
        match &column.effect {
            NuisanceEffect::Bend { direction, bend } => {
                torque = self.law_column(*direction, |of, u| bend_of(of, *bend, u));
            }
            NuisanceEffect::Curvature { direction } => {
                torque = self.law_column(*direction, curvature)
            }
            NuisanceEffect::Neighbour { row, of, by } => {
                torque[*row] = match by {
                    CouplingKind::Speed => dq[*of],
                    CouplingKind::Sign => self.context.robot.sign_model(*of).value(dq[*of]),
                    CouplingKind::Acceleration => ddq[*of],
                };
            }
            NuisanceEffect::Gain(None) => torque = self.predicted,
            NuisanceEffect::Gain(Some(joint)) => torque[*joint] = self.predicted[*joint],
            NuisanceEffect::KnownTorque { joint, over_range } => {
                let q = q[*joint];
                let mut known_torque_nm = model.known_torque(*joint, q).unwrap_or(Lanes::zero());
                if *over_range {
                    known_torque_nm *= over_limits(model, *joint, q);
                }
                torque[*joint] = -known_torque_nm;
            }
            NuisanceEffect::Zero(shifted) => {
                let mut q: Vec<Group> = q.to_vec();
                q[*shifted] += Lanes::constant(GEOMETRY_STEP);
                torque = self.step_to(model, States { q: &q, ..self.state });
            }
            NuisanceEffect::Scale(scaled) => {
                let scale = |signal: &[Group]| -> Vec<Group> {
                    let mut signal = signal.to_vec();
                    signal[*scaled] *= Lanes::constant(1.0 + GEOMETRY_STEP);
                    signal
                };
                let [q, dq, ddq] = [q, dq, ddq].map(scale);
                torque = self.step_to(model, States { q: &q, dq: &dq, ddq: &ddq, ..self.state });
            }
            NuisanceEffect::OverRange(joint) => {
                torque[*joint] = over_limits(model, *joint, q[*joint]);
            }
            NuisanceEffect::Geometry(model) => torque = self.step_to(model, self.state),
            // A presliding distance has no effect on a joint that has moved far in one direction.
            NuisanceEffect::PreslidingDistance { .. }
            | NuisanceEffect::Delay(_)
            | NuisanceEffect::LeftOut(_) => return None,
        }
        for joint in model.missing_torques() {
            torque[*joint] = Lanes::zero();
        }
        Some(torque)
    }

    /// Returns the torque on each joint that follows from a law of the speed along a direction
    /// (that of a joint or of a coupled motor), at these states.
    fn law_column(
        &self,
        direction: usize,
        law: impl Fn(&Direction, Group) -> Group,
    ) -> [Group; MAX_JOINTS] {
        let direction = &self.directions[direction];
        let mut u = Lanes::zero();
        for (share, speed) in direction.joint_shares.iter().zip(self.state.dq) {
            u += *speed * Lanes::constant(*share);
        }
        let (mut torque, value) = ([Lanes::zero(); MAX_JOINTS], law(direction, u));
        for (torque, share) in torque.iter_mut().zip(&direction.joint_shares) {
            *torque = value * Lanes::constant(*share);
        }
        torque
    }

    /// Returns the change of the torques with another geometry or state, divided by the step.
    fn step_to(&mut self, model: &Model, state: States<'_>) -> [Group; MAX_JOINTS] {
        let mut torque = self.dynamics.torque(model, state);
        for (torque, predicted) in torque.iter_mut().zip(self.predicted) {
            *torque = (*torque - predicted) * Lanes::constant(1.0 / GEOMETRY_STEP);
        }
        torque
    }
}

/// Returns the position of a joint, scaled from −1 to 1 over its limits.
fn over_limits(model: &Model, joint: usize, q: Group) -> Group {
    let limits = model.chain()[joint].limits;
    let middle = 0.5 * (limits.position_max + limits.position_min);
    let half = 0.5 * (limits.position_max - limits.position_min);
    (q - Lanes::constant(middle)) * Lanes::constant(1.0 / half)
}

/// Returns tanh(u/w) minus the model's own sign function.
#[inline(always)]
pub(super) fn bend_of(direction: &Direction, bend: usize, u: Group) -> Group {
    (u * Lanes::constant(direction.scale(bend))).tanh() - direction.sign.value(u)
}

/// Returns |u| u divided by the highest speed.
#[inline(always)]
pub(super) fn curvature(direction: &Direction, u: Group) -> Group {
    u * Lanes(u.0.map(f64::abs)) * Lanes::constant(1.0 / direction.highest_speed)
}
