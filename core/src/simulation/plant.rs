//! The differential equation of the loop.

use crate::MAX_JOINTS;
use crate::control::{ContinuousController, Setpoint};
use crate::dynamics::{Model, Workspace};
use crate::trajectory::Reference;

use super::error::{SimulationError, StateQuantity};
use super::sensitivity::PlantVariation;
use super::{DivergenceLimits, Stribeck};

/// The reference at one instant.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct ReferencePoint {
    pub(super) position: [f64; MAX_JOINTS],
    velocity: [f64; MAX_JOINTS],
    acceleration: [f64; MAX_JOINTS],
}

impl ReferencePoint {
    pub(super) fn at<R: Reference>(reference: &R, time_s: f64) -> Self {
        let mut point = Self::default();
        let n = reference.joints();
        reference.at(
            time_s,
            &mut point.position[..n],
            &mut point.velocity[..n],
            &mut point.acceleration[..n],
        );
        point
    }

    pub(super) fn setpoint(&self, joints: usize) -> Setpoint<'_> {
        Setpoint {
            position: &self.position[..joints],
            velocity: &self.velocity[..joints],
            acceleration: &self.acceleration[..joints],
        }
    }

    /// q_r − q.
    pub(super) fn error(&self, position: &[f64]) -> [f64; MAX_JOINTS] {
        let mut error = self.position;
        for (error, q) in error.iter_mut().zip(position) {
            *error -= q;
        }
        error
    }

    pub(super) fn velocity(&self) -> &[f64; MAX_JOINTS] {
        &self.velocity
    }
}

/// The arm, and the controller where it acts at every instant.
///
/// State: y = (q, q̇) under a sampled controller, (q, q̇, integrals) under a continuous one, then
/// its derivatives with respect to parameters where they are asked for, a row per entry of y.
pub(super) struct Plant<R> {
    pub(super) model: Model,
    pub(super) workspace: Workspace<f64>,
    pub(super) parameters: Vec<f64>,
    pub(super) reference: R,
    pub(super) continuous: Option<ContinuousController>,
    /// Command that acts, where the controller is sampled \[N·m\].
    pub(super) command: [f64; MAX_JOINTS],
    /// Torque that no command contains \[N·m\].
    pub(super) disturbance: [f64; MAX_JOINTS],
    /// Friction that the model does not know, one per joint; empty when there is none.
    pub(super) stribeck: Vec<Stribeck>,
    /// What was left for the model at the last evaluation: command and disturbance less the
    /// unmodelled friction \[N·m\].
    pub(super) torque: [f64; MAX_JOINTS],
    pub(super) divergence: DivergenceLimits,
    pub(super) joints: usize,
    /// What the derivatives of the state need.
    pub(super) variation: Option<PlantVariation>,
}

impl<R: Reference> Plant<R> {
    /// Number of states, their derivatives not counted.
    pub(super) fn states(&self) -> usize {
        self.joints * if self.continuous.is_some() { 3 } else { 2 }
    }

    /// ẏ = f(t, y).
    pub(super) fn rate(
        &mut self,
        time_s: f64,
        y: &[f64],
        rate: &mut [f64],
    ) -> Result<(), SimulationError> {
        let n = self.joints;
        let (y, derivatives) = y.split_at(self.states());
        let (rate, derivative_rates) = rate.split_at_mut(self.states());
        let (q, rest) = y.split_at(n);
        let (dq, integral) = rest.split_at(n);
        self.check_finite(time_s, q, dq)?;
        let (dq_rate, rest) = rate.split_at_mut(n);
        let (ddq, integral_rate) = rest.split_at_mut(n);
        if let Some(controller) = &self.continuous {
            let point = ReferencePoint::at(&self.reference, time_s);
            let command = &mut self.command[..n];
            controller.evaluate(point.setpoint(n), q, dq, integral, command, integral_rate);
        }
        for ((torque, command), disturbance) in
            self.torque.iter_mut().zip(&self.command).zip(&self.disturbance)
        {
            *torque = command + disturbance;
        }
        for ((torque, stribeck), velocity) in self.torque.iter_mut().zip(&self.stribeck).zip(dq) {
            *torque -= stribeck.torque(*velocity);
        }
        dq_rate.copy_from_slice(dq);
        self.model
            .direct_dynamics(&mut self.workspace, &self.parameters, q, dq, &self.torque[..n], ddq)
            .map_err(|error| SimulationError::NotPositiveDefinite { joint: error.joint, time_s })?;
        if let Some(variation) = &mut self.variation {
            let mut error = [0.0; MAX_JOINTS];
            if self.continuous.is_some() {
                let point = ReferencePoint::at(&self.reference, time_s);
                error = point.error(q);
            }
            variation.rate(
                &self.model,
                &mut self.workspace,
                &self.parameters,
                [dq, &*ddq],
                &error[..n],
                derivatives,
                derivative_rates,
            );
        }
        Ok(())
    }

    /// Whether the state at the end of a step is one of a stable loop.
    pub(super) fn check_bounds(&self, time_s: f64, y: &[f64]) -> Result<(), SimulationError> {
        let (q, rest) = y.split_at(self.joints);
        let point = ReferencePoint::at(&self.reference, time_s);
        for (j, ((q, dq), q_r)) in q.iter().zip(rest).zip(&point.position).enumerate() {
            let error = q_r - q;
            let limits = &self.divergence;
            for (quantity, value, limit) in [
                (StateQuantity::PositionError, error, limits.position_error_rad),
                (StateQuantity::Velocity, *dq, limits.velocity_rad_s),
            ] {
                // NaN is beyond every limit.
                if value.is_nan() || value.abs() > limit {
                    return Err(SimulationError::Divergence {
                        joint: j + 1,
                        time_s,
                        quantity,
                        value,
                    });
                }
            }
        }
        Ok(())
    }

    /// A stage that is not finite would look like a singular mass matrix.
    fn check_finite(&self, time_s: f64, q: &[f64], dq: &[f64]) -> Result<(), SimulationError> {
        for (j, (q, dq)) in q.iter().zip(dq).enumerate() {
            for (quantity, value) in
                [(StateQuantity::PositionError, *q), (StateQuantity::Velocity, *dq)]
            {
                if !value.is_finite() {
                    let joint = j + 1;
                    return Err(SimulationError::Divergence { joint, time_s, quantity, value });
                }
            }
        }
        Ok(())
    }
}
