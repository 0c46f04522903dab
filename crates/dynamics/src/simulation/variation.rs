//! Derivatives of the simulated signals with respect to the parameters: the variational equation of
//! the plant.

use crate::MAX_JOINTS;
use crate::control::CommandVariation;
use crate::dynamics::{Model, Variation, VariationWorkspace, Workspace};
use crate::robot::Hysteresis;

/// Derivatives of a loop's signals at one sample with respect to b parameters: n × b, a row per
/// joint. The unit is that of the signal over that of the parameter.
#[derive(Clone, Copy, Debug)]
pub struct Sensitivities<'a> {
    /// ∂q/∂θ of the true positions at the sample, the output sensitivity of equation 17.
    pub position: &'a [f64],
    /// ∂τ/∂θ of the command that acts just after the sample, the input sensitivity of equation 19.
    pub torque: &'a [f64],
}

/// Inputs of the derivatives of the state (q, q̇, integrals).
///
/// Along a step, the rates of the derivatives are the derivatives of the rates. A Runge–Kutta step
/// over both is the derivative of the step itself, since differentiation and the step's sums
/// commute. Friction that jumps with the speed has no derivative at the jump and 0 away from it.
/// The effect of a parameter on the instant of a reversal is then not seen. The smooth law is the
/// better model where it matters.
pub(super) struct PlantVariation {
    workspace: VariationWorkspace,
    width: usize,
    joints: usize,
    /// The law of a continuous controller.
    continuous_law: Option<CommandVariation>,
    /// ∂τ/∂θ of the command that acts.
    torque: Vec<f64>,
    /// Part of the hysteresis z that does not follow from the position: ∂z/∂θ = this + slope ∂q/∂θ
    /// while it changes. Empty without hysteresis.
    hysteresis_offsets: Vec<f64>,
    /// Derivative of the hysteresis with respect to the position of every joint \[1/rad or 1/m\].
    hysteresis_slopes: Vec<f64>,
    /// ∂τ/∂θ less the derivative of the friction with hysteresis.
    torque_derivatives: Vec<f64>,
}

impl PlantVariation {
    pub(super) fn new(
        model: &Model,
        columns: &[usize],
        continuous: Option<CommandVariation>,
        hysteresis: Option<&Hysteresis>,
    ) -> Self {
        let (workspace, joints) = (VariationWorkspace::new(model, columns), model.joints());
        let width = columns.len();
        let slopes = hysteresis.map(|own| (0..joints).map(|joint| own.slope(joint)).collect());
        let rotations = if slopes.is_some() { joints * width } else { 0 };
        Self {
            workspace,
            width,
            joints,
            continuous_law: continuous,
            torque: vec![0.0; joints * width],
            hysteresis_offsets: vec![0.0; rotations],
            hysteresis_slopes: slopes.unwrap_or_default(),
            torque_derivatives: vec![0.0; rotations],
        }
    }

    pub(super) fn restart(&mut self) {
        self.torque.fill(0.0);
        self.hysteresis_offsets.fill(0.0);
    }

    /// Sets the hysteresis state after sliding: sliding friction does not depend on the parameters,
    /// and changes from this state on.
    pub(super) fn settle(&mut self, shares: [f64; MAX_JOINTS], derivatives: &[f64]) {
        let rows = self
            .hysteresis_offsets
            .chunks_exact_mut(self.width)
            .zip(derivatives.chunks(self.width));
        for ((rotations, position), (share, slope)) in
            rows.zip(shares.iter().zip(&self.hysteresis_slopes))
        {
            if share.abs() >= 1.0 {
                rotations.iter_mut().zip(position).for_each(|(to, by)| *to = -slope * by);
            }
        }
    }

    /// Subtracts the derivative of friction with hysteresis from those of the torque, for joints
    /// within their presliding distance.
    fn take_off_hysteresis(
        &mut self,
        model: &Model,
        shares: &[f64; MAX_JOINTS],
        parameters: &[f64],
        position: &[f64],
    ) {
        self.torque_derivatives.copy_from_slice(&self.torque);
        for (joint, column) in model.hysteresis().filter(|(joint, _)| shares[*joint].abs() < 1.0) {
            let (slope, row) =
                (self.hysteresis_slopes[joint], joint * self.width..(joint + 1) * self.width);
            let rotations = self.hysteresis_offsets[row.clone()].iter().zip(&position[row.clone()]);
            for (remaining, (rotated_recording, position)) in
                self.torque_derivatives[row].iter_mut().zip(rotations)
            {
                *remaining -= parameters[column] * (rotated_recording + slope * position);
            }
        }
    }

    /// Applies a command of a sampled controller.
    pub(super) fn apply(&mut self, torque: &[f64]) {
        self.torque.copy_from_slice(torque);
    }

    /// Computes the rates of the derivatives at this motion (q, q̇, q̈), whose acceleration was
    /// `solved` with these parameters. `error` is q_r − q under a continuous controller.
    pub(super) fn rate(
        &mut self,
        model: &Model,
        solved: &mut Workspace<f64>,
        parameters: &[f64],
        motion: [&[f64]; 3],
        error: &[f64],
        derivatives: &[f64],
        rates: &mut [f64],
    ) {
        let size = self.joints * self.width;
        let (position, rest) = derivatives.split_at(size);
        let (velocity, integral) = rest.split_at(size);
        let (position_rate, rest) = rates.split_at_mut(size);
        let (velocity_rate, integral_rate) = rest.split_at_mut(size);
        if let Some(law) = &self.continuous_law {
            let state = [position, velocity, integral];
            law.evaluate(error, state, &mut self.torque, integral_rate);
        }
        position_rate.copy_from_slice(velocity);
        let shares = solved.hysteresis();
        if let Some(shares) = &shares {
            self.take_off_hysteresis(model, shares, parameters, position);
        }
        let torque = if shares.is_some() { &self.torque_derivatives } else { &self.torque };
        let variation = Variation { position, velocity, torque };
        let workspace = &mut self.workspace;
        model.acceleration_variation(
            workspace,
            solved,
            parameters,
            motion,
            variation,
            velocity_rate,
        );
    }

    pub(super) fn sensitivities<'a>(&'a self, derivatives: &'a [f64]) -> Sensitivities<'a> {
        let size = self.joints * self.width;
        Sensitivities { position: &derivatives[..size], torque: &self.torque }
    }
}
