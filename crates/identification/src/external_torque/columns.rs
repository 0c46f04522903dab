//! Regressors of the momentum and of the torques at a constant momentum.

use didim_dynamics::MAX_JOINTS;
use didim_dynamics::dynamics::{Model, RegressorColumns, Workspace};
use didim_dynamics::numeric::{Lanes, WIDTH};
use didim_dynamics::robot::{Hysteresis, ParameterKind, Robot};

use super::parameters::ArmParameters;

/// Step of the central difference along the motion \[s\]. The error of the difference is of the
/// order of step² times the third derivative, and its rounding of the order of 10⁻¹⁶ / step: 10⁻¹⁰
/// and 10⁻¹¹ of the inertia for an arm at 1 rad/s.
const STEP_S: f64 = 1e-5;

/// Entries of the observer's regressors that can differ from 0, column by column.
#[derive(Clone, Debug)]
pub(super) struct ObserverColumns {
    model: Model,
    /// The model without gravity, for the momentum.
    weightless: Model,
    columns: RegressorColumns,
    /// 1 for the entries of inertial parameters, otherwise 0.
    is_inertial: Vec<f64>,
    workspace: Workspace<f64>,
    lanes_workspace: Workspace<Lanes<WIDTH>>,
    lanes: Vec<Lanes<WIDTH>>,
    history: Option<Hysteresis>,
    /// Parameters of the mass matrix, and the matrix.
    standard: Vec<f64>,
    masses: Vec<f64>,
    /// Y_p, with p = Y_p φ.
    pub(super) momentum: Vec<f64>,
    /// Y_h, with h = Y_h φ, without the known torques.
    pub(super) rest: Vec<f64>,
}

impl ObserverColumns {
    /// Creates the columns of the parameters of an arm.
    pub(super) fn new(robot: &Robot, arm: &ArmParameters) -> Self {
        let mut model = Model::new(robot);
        let weightless = model.clone().with_gravity([0.0; 3]);
        if model.feels_loads() {
            model = model.with_load(arm.standard.clone());
        }
        let columns = model.regressor_entries(&arm.columns);
        let kinds = columns.entries().iter().map(|(_, column)| arm.kinds[*column]);
        let is_inertial: Vec<f64> = kinds.map(|kind| f64::from(is_inertia(kind))).collect();
        let count = is_inertial.len();
        Self {
            history: model.history(),
            model,
            weightless,
            columns,
            is_inertial,
            workspace: Workspace::new(),
            lanes_workspace: Workspace::new(),
            standard: arm.standard.clone(),
            masses: vec![0.0; robot.joints() * robot.joints()],
            lanes: vec![Lanes([0.0; WIDTH]); count],
            momentum: vec![0.0; count],
            rest: vec![0.0; count],
        }
    }

    /// Returns joint and column of the entries.
    pub(super) fn entries(&self) -> &[(usize, usize)] {
        self.columns.entries()
    }

    /// Forgets the last motion.
    pub(super) fn restart_at(&mut self, q: &[f64]) {
        self.history.iter_mut().for_each(|history| history.restart_at(q));
    }

    /// Takes over the last motion of the columns of another result.
    pub(super) fn continue_from(&mut self, earlier: &mut Self) {
        core::mem::swap(&mut self.history, &mut earlier.history);
    }

    /// Computes both regressors at a state, n entries each.
    pub(super) fn evaluate(&mut self, q: &[f64], dq: &[f64]) {
        let n = q.len();
        let shares = self.history.as_mut().map(|history| history.advance_to(q));
        self.workspace.set_hysteresis(shares);
        let still = [0.0; MAX_JOINTS];
        let Self { model, workspace, columns, rest, .. } = self;
        model.selected_regressor(workspace, columns, q, dq, &still[..n], rest);

        // Lane 0 is the state, lanes 1 and 2 are a step later and earlier along the motion.
        let offsets = [0.0, STEP_S, -STEP_S, 0.0];
        let zero = Lanes([0.0; WIDTH]);
        let (mut positions, mut speeds) = ([zero; MAX_JOINTS], [zero; MAX_JOINTS]);
        for joint in 0..n {
            positions[joint] = Lanes::from_fn(|lane| q[joint] + offsets[lane] * dq[joint]);
            speeds[joint] = Lanes([dq[joint]; WIDTH]);
        }
        self.weightless.selected_regressor(
            &mut self.lanes_workspace,
            &self.columns,
            &positions[..n],
            &[zero; MAX_JOINTS][..n],
            &speeds[..n],
            &mut self.lanes,
        );
        let entries = self.momentum.iter_mut().zip(&mut self.rest);
        for ((momentum, rest), (lanes, mask)) in
            entries.zip(self.lanes.iter().zip(&self.is_inertial))
        {
            let Lanes([now, later, earlier, _]) = lanes;
            *momentum = mask * now;
            *rest -= mask * (later - earlier) / (2.0 * STEP_S);
        }
    }

    /// Returns the mass matrix, in rows of n entries.
    pub(super) fn mass_matrix(&mut self, q: &[f64]) -> &[f64] {
        self.model.mass_matrix(&mut self.workspace, &self.standard, q, &mut self.masses);
        &self.masses
    }

    /// Returns the known torque on a joint.
    pub(super) fn known_torque(&self, joint: usize, position: f64) -> f64 {
        self.model.known_torque(joint, position).unwrap_or(0.0)
    }

    /// Returns the largest magnitude of each entry of Coulomb friction with its joint and column:
    /// that of a motion at high speed.
    pub(super) fn coulomb_entries(&mut self, arm: &ArmParameters) -> Vec<CoulombEntry> {
        let n = self.model.joints();
        // Each joint has a speed of its own, so that no sum of speeds is 0.
        let speeds: Vec<f64> = (0..n).map(|joint| 1e6 * (joint as f64 + 1.5).sqrt()).collect();
        let (still, mut rows) = ([0.0; MAX_JOINTS], vec![0.0; self.momentum.len()]);
        let Self { model, workspace, columns, .. } = self;
        let at_zero = &still[..n];
        model.selected_regressor(workspace, columns, at_zero, &speeds, at_zero, &mut rows);
        let is_coulomb =
            |kind: ParameterKind| matches!(kind, ParameterKind::Fc | ParameterKind::FcMotor);
        let entries = self.entries().iter().enumerate().zip(rows);
        entries
            .filter(|((_, (_, column)), _)| is_coulomb(arm.kinds[*column]))
            .map(|((entry, &(joint, column)), row)| CoulombEntry {
                joint,
                entry,
                magnitude: row.abs(),
                friction: arm.values[column],
            })
            .collect()
    }
}

/// Returns true for the parameters of the mass matrix.
fn is_inertia(kind: ParameterKind) -> bool {
    ParameterKind::LINK.contains(&kind) || kind == ParameterKind::Ia
}

/// An entry of Coulomb friction.
#[derive(Clone, Copy, Debug)]
pub(super) struct CoulombEntry {
    /// Joint, counted from 0.
    pub(super) joint: usize,
    /// Its place among the entries.
    pub(super) entry: usize,
    /// Largest magnitude.
    magnitude: f64,
    /// The coefficient \[N·m or N\].
    friction: f64,
}

impl CoulombEntry {
    /// Returns the variance of friction whose mean direction over the memory of the filter is
    /// `direction`. In a steady motion the direction is ±1 and friction is known. At rest and
    /// during a reversal friction is anywhere between its limits: a uniform distribution.
    pub(super) fn variance(&self, direction: f64) -> f64 {
        let undecided = (self.magnitude.powi(2) - direction.powi(2)).max(0.0);
        self.friction.powi(2) * undecided / 3.0
    }
}
