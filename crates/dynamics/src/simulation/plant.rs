//! The differential equation of the loop.

use crate::MAX_JOINTS;
use crate::control::ContinuousController;
use crate::dynamics::{Model, Workspace};
use crate::robot::{Hysteresis, JointIndex, SignModel, Transmission};
use crate::trajectory::Reference;

use super::error::{SimulationError, StateQuantity};
use super::hysteresis::SlipElements;
use super::reference_point::ReferencePoint;
use super::variation::PlantVariation;
use super::{Cogging, DivergenceLimits, FlexibleMode, Stribeck};

/// The arm, and the controller if it is continuous.
///
/// State: y = (q, q̇) under a sampled controller, (q, q̇, integrals) under a continuous one, then
/// (q_f, q̇_f) if joints are flexible. If derivatives with respect to parameters are requested,
/// they follow, one row per entry of y.
pub(super) struct Plant<R> {
    pub(super) model: Model,
    pub(super) workspace: Workspace<f64>,
    pub(super) parameters: Vec<f64>,
    pub(super) reference: R,
    pub(super) continuous: Option<ContinuousController>,
    /// Command that acts, if the controller is sampled \[N·m\].
    pub(super) command: [f64; MAX_JOINTS],
    /// Disturbance torque, which no command contains \[N·m\].
    pub(super) disturbance: [f64; MAX_JOINTS],
    /// Unmodelled Stribeck friction, one per joint; empty without any.
    pub(super) unmodelled_stribeck: Vec<Stribeck>,
    /// Growth of Coulomb friction with a joint's load, and its sign; empty without any.
    pub(super) load_friction: Vec<(f64, SignModel)>,
    /// Unmodelled friction with hysteresis at reversals.
    pub(super) unmodelled_hysteresis: SlipElements,
    /// Hysteresis of the model's friction; `None` without any.
    pub(super) hysteresis: Option<Hysteresis>,
    /// Torque ripple, one per motor; empty without any.
    pub(super) cogging: Vec<Cogging>,
    pub(super) transmission: Transmission,
    /// Flexible parts, one per joint; empty when all are rigid.
    pub(super) flexible: Vec<FlexibleMode>,
    /// J_f of the flexible parts \[kg·m²\].
    pub(super) flexible_inertia: Vec<f64>,
    /// Torque of the model at the last evaluation: command and disturbance less unmodelled torques
    /// \[N·m\].
    pub(super) torque: [f64; MAX_JOINTS],
    pub(super) divergence: DivergenceLimits,
    pub(super) joints: usize,
    /// Inputs of the derivatives of the state.
    pub(super) variation: Option<PlantVariation>,
}

impl<R: Reference> Plant<R> {
    /// Number of states, their derivatives not counted.
    pub(super) fn state_count(&self) -> usize {
        2 * self.joints + self.integral_count() + 2 * self.flexible.len()
    }

    /// Number of integrals among them.
    pub(super) fn integral_count(&self) -> usize {
        if self.continuous.is_some() { self.joints } else { 0 }
    }

    /// Computes ẏ = f(t, y).
    pub(super) fn rate(
        &mut self,
        time_s: f64,
        y: &[f64],
        rate: &mut [f64],
    ) -> Result<(), SimulationError> {
        if self.continuous.is_none() {
            return self.rate_with_reference(&ReferencePoint::ZERO, time_s, y, rate);
        }
        let reference = ReferencePoint::from_reference(&self.reference, time_s);
        self.rate_with_reference(&reference, time_s, y, rate)
    }

    /// Returns the reference that the controller sees between two samples; zeros if it is sampled.
    pub(super) fn continuous_reference(&self, time_s: f64) -> ReferencePoint {
        match self.continuous {
            Some(_) => ReferencePoint::from_reference(&self.reference, time_s),
            None => ReferencePoint::ZERO,
        }
    }

    /// Computes ẏ as [`rate`](Self::rate) does, with the given reference at this time.
    pub(super) fn rate_with_reference(
        &mut self,
        reference: &ReferencePoint,
        time_s: f64,
        y: &[f64],
        rate: &mut [f64],
    ) -> Result<(), SimulationError> {
        let n = self.joints;
        let (y, derivatives) = y.split_at(self.state_count());
        let (rate, derivative_rates) = rate.split_at_mut(self.state_count());
        self.drive_rates(reference, time_s, y, rate)?;
        let (q, dq, ddq) = (&y[..n], &y[n..2 * n], &mut rate[n..2 * n]);
        self.model
            .direct_dynamics_without(
                &mut self.workspace,
                &self.parameters,
                &self.flexible_inertia,
                q,
                dq,
                &self.torque[..n],
                ddq,
            )
            .map_err(|error| SimulationError::NotPositiveDefinite { joint: error.joint, time_s })?;
        if let Some(variation) = &mut self.variation {
            let error = reference.error(q);
            variation.rate(
                &self.model,
                &mut self.workspace,
                &self.parameters,
                [q, dq, &*ddq],
                &error[..n],
                derivatives,
                derivative_rates,
            );
        }
        Ok(())
    }

    /// Computes the torque that remains for the model, and all rates except q̈, which follows from
    /// that torque.
    pub(super) fn drive_rates(
        &mut self,
        reference: &ReferencePoint,
        time_s: f64,
        y: &[f64],
        rate: &mut [f64],
    ) -> Result<(), SimulationError> {
        let n = self.joints;
        let (q, rest) = y.split_at(n);
        let (dq, rest) = rest.split_at(n);
        let (integral, flexible) = rest.split_at(self.integral_count());
        self.check_finite(time_s, q, dq)?;
        let (dq_rate, rest) = rate.split_at_mut(n);
        let (_, rest) = rest.split_at_mut(n);
        let (integral_rate, flexible_rate) = rest.split_at_mut(self.integral_count());
        if let Some(controller) = &self.continuous {
            let command = &mut self.command[..n];
            controller.evaluate(reference.setpoint(n), q, dq, integral, command, integral_rate);
        }
        for ((torque, command), disturbance) in
            self.torque[..n].iter_mut().zip(&self.command[..n]).zip(&self.disturbance[..n])
        {
            *torque = command + disturbance;
        }
        for ((torque, stribeck), velocity) in
            self.torque.iter_mut().zip(&self.unmodelled_stribeck).zip(dq)
        {
            *torque -= stribeck.torque(*velocity);
        }
        self.unmodelled_hysteresis.take_off(q, &mut self.torque);
        if let Some(own) = &self.hysteresis {
            self.workspace.set_hysteresis(Some(own.shares(q)));
        }
        self.add_cogging(q);
        self.add_flexible(q, dq, flexible, flexible_rate);
        // The load friction comes last, because it depends on all other torques.
        self.add_load_friction(q, dq);
        dq_rate.copy_from_slice(dq);
        Ok(())
    }

    /// Updates the hysteresis of friction to the state of a sample.
    pub(super) fn settle(&mut self, state: &[f64]) {
        let (q, derivatives) = (&state[..self.joints], &state[self.state_count()..]);
        self.unmodelled_hysteresis.state.settle(q);
        let shares = self.hysteresis.as_mut().map(|own| own.advance_to(q));
        if let (Some(shares), Some(variation)) = (shares, &mut self.variation) {
            variation.settle(shares, derivatives);
        }
    }

    /// Adds the motors' ripple, which acts on the joints like any motor torque.
    fn add_cogging(&mut self, q: &[f64]) {
        if self.cogging.is_empty() {
            return;
        }
        let n = self.joints;
        let [mut motor, mut joint] = [[0.0; MAX_JOINTS]; 2];
        self.transmission.motor_position(q, &mut motor[..n]);
        for (motor, cogging) in motor.iter_mut().zip(&self.cogging) {
            *motor = cogging.torque(*motor);
        }
        self.transmission.joint_torque(&motor[..n], &mut joint[..n]);
        for (torque, ripple) in self.torque.iter_mut().zip(joint) {
            *torque += ripple;
        }
    }

    /// Adds Coulomb friction by the load. The torque less this friction and the model's friction is
    /// the load L itself: L + μ|L| s = R, with R the torque without it, so that |L| = |R|/(1 + μ s
    /// sign R).
    fn add_load_friction(&mut self, q: &[f64], dq: &[f64]) {
        if self.load_friction.is_empty() {
            return;
        }
        let mut friction = [0.0; MAX_JOINTS];
        let friction_torques = &mut friction[..self.joints];
        self.model.friction(&mut self.workspace, &self.parameters, q, dq, friction_torques);
        let joints = self.load_friction.iter().zip(dq).zip(friction);
        for (torque, (((share, sign), velocity), friction)) in self.torque.iter_mut().zip(joints) {
            let (torque_left, by_load) = (*torque - friction, share * sign.value(*velocity));
            *torque -= by_load * torque_left.abs() / (1.0 + by_load * torque_left.signum());
        }
    }

    /// Computes the rates of the flexible parts' state (q_f, q̇_f), and adds their torque on the
    /// joints.
    fn add_flexible(&mut self, q: &[f64], dq: &[f64], state: &[f64], rate: &mut [f64]) {
        let modes = self.flexible.len();
        let (q_f, dq_f) = state.split_at(modes);
        let (q_f_rate, dq_f_rate) = rate.split_at_mut(modes);
        q_f_rate.copy_from_slice(dq_f);
        for (j, mode) in self.flexible.iter().enumerate() {
            dq_f_rate[j] = mode.acceleration(q[j], dq[j], q_f[j], dq_f[j]);
            self.torque[j] -= mode.inertia_kg_m2 * dq_f_rate[j];
        }
    }

    /// Checks that the state at the end of a step is one of a stable loop.
    pub(super) fn check_bounds(
        &self,
        time_s: f64,
        reference: &ReferencePoint,
        y: &[f64],
    ) -> Result<(), SimulationError> {
        let (q, rest) = y.split_at(self.joints);
        for (j, ((q, dq), q_r)) in q.iter().zip(rest).zip(&reference.position).enumerate() {
            let error = q_r - q;
            let limits = &self.divergence;
            for (quantity, value, limit) in [
                (StateQuantity::PositionError, error, limits.position_error_rad),
                (StateQuantity::Velocity, *dq, limits.velocity_rad_s),
            ] {
                // NaN exceeds every limit.
                if value.is_nan() || value.abs() > limit {
                    return Err(SimulationError::Divergence {
                        joint: JointIndex::new(j),
                        time_s,
                        quantity,
                        value,
                    });
                }
            }
        }
        Ok(())
    }

    /// Checked here, because a stage that is not finite would look like a singular mass matrix.
    fn check_finite(&self, time_s: f64, q: &[f64], dq: &[f64]) -> Result<(), SimulationError> {
        for (j, (q, dq)) in q.iter().zip(dq).enumerate() {
            for (quantity, value) in
                [(StateQuantity::PositionError, *q), (StateQuantity::Velocity, *dq)]
            {
                if !value.is_finite() {
                    let joint = JointIndex::new(j);
                    return Err(SimulationError::Divergence { joint, time_s, quantity, value });
                }
            }
        }
        Ok(())
    }
}
