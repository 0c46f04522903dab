//! How the simulated signals change with the parameters: the variational equation of the loop.

use super::ClosedLoop;
use super::error::SetupError;
use super::hold::CommandHold;
use super::integrator::Stages;
use crate::control::CommandVariation;
use crate::dynamics::{Model, Variation, VariationWorkspace, Workspace};
use crate::trajectory::Reference;

/// Derivatives of a loop's signals at one sample with respect to b parameters: n × b, a row per
/// joint. The unit is that of the signal over that of the parameter.
#[derive(Clone, Copy, Debug)]
pub struct Sensitivities<'a> {
    /// ∂q/∂θ of the true positions at the sample, the output sensitivity of equation 17.
    pub position: &'a [f64],
    /// ∂τ/∂θ of the command that acts just after the sample, the input sensitivity of equation 19.
    pub torque: &'a [f64],
}

/// What the derivatives of the state (q, q̇, integrals) need.
///
/// Along a step, the rates of the derivatives are the derivatives of the rates. A Runge–Kutta step
/// over both is the derivative of the step itself, since differentiation and the step's sums
/// commute. Friction that jumps with the speed has no derivative at the jump and 0 elsewhere: what
/// a parameter does to the instant of a reversal is then not seen, and the smooth law is the better
/// model where it matters.
pub(super) struct PlantVariation {
    workspace: VariationWorkspace,
    width: usize,
    joints: usize,
    /// The law, where the controller acts at every instant.
    continuous: Option<CommandVariation>,
    /// ∂τ/∂θ of the command that acts.
    torque: Vec<f64>,
}

impl PlantVariation {
    pub(super) fn new(
        model: &Model,
        columns: &[usize],
        continuous: Option<CommandVariation>,
    ) -> Self {
        let (workspace, joints) = (VariationWorkspace::new(model, columns), model.joints());
        let width = columns.len();
        Self { workspace, width, joints, continuous, torque: vec![0.0; joints * width] }
    }

    pub(super) fn restart(&mut self) {
        self.torque.fill(0.0);
    }

    /// Lets a command act that a sampled controller has computed.
    pub(super) fn apply(&mut self, torque: &[f64]) {
        self.torque.copy_from_slice(torque);
    }

    /// The rates of the derivatives at this motion (q̇, q̈), whose acceleration was `solved` with
    /// these parameters. `error` is q_r − q under a continuous controller.
    pub(super) fn rate(
        &mut self,
        model: &Model,
        solved: &mut Workspace<f64>,
        parameters: &[f64],
        motion: [&[f64]; 2],
        error: &[f64],
        derivatives: &[f64],
        rates: &mut [f64],
    ) {
        let size = self.joints * self.width;
        let (position, rest) = derivatives.split_at(size);
        let (velocity, integral) = rest.split_at(size);
        let (position_rate, rest) = rates.split_at_mut(size);
        let (velocity_rate, integral_rate) = rest.split_at_mut(size);
        if let Some(law) = &self.continuous {
            let state = [position, velocity, integral];
            law.evaluate(error, state, &mut self.torque, integral_rate);
        }
        position_rate.copy_from_slice(velocity);
        let variation = Variation { position, velocity, torque: &self.torque };
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

impl<R: Reference> ClosedLoop<R> {
    /// The same loop, back at time 0, which integrates its derivatives with respect to the standard
    /// parameters in these `columns` along with its state, in the same steps: those of the
    /// simulated signals themselves, not of an ideal solution that the steps approach.
    ///
    /// # Errors
    /// [`SetupError::NoSensitivity`] names what the derivatives do not exist with, and
    /// [`SetupError::BadValue`] a column that no parameter has, or that is there twice.
    pub fn with_sensitivities(mut self, columns: &[usize]) -> Result<Self, SetupError> {
        self.config.check_differentiable(&self.controller)?;
        let parameters = self.plant.parameters.clone();
        if let Some(&column) = columns.iter().find(|&&column| column >= parameters.len()) {
            let (what, expected) = ("column of a sensitivity", "that of a standard parameter");
            return Err(SetupError::BadValue { what, value: column as f64, expected });
        }
        let mut before = columns.iter().enumerate().map(|(k, column)| (&columns[..k], column));
        if let Some((_, &column)) = before.find(|(before, column)| before.contains(column)) {
            let (what, expected) = ("column of a sensitivity", "there once");
            return Err(SetupError::BadValue { what, value: column as f64, expected });
        }
        if columns.is_empty() {
            let (what, expected) = ("number of sensitivities", "1 or more");
            return Err(SetupError::BadValue { what, value: 0.0, expected });
        }
        let (joints, width) = (self.plant.joints, columns.len());
        let states = self.plant.states();
        let command = CommandVariation::new(&self.controller, width);
        self.varied = self.sampled.as_ref().map(|(controller, _)| {
            let none = vec![0.0; joints * width];
            let hold = CommandHold::new(controller.delay_s(), controller.period_s(), none);
            (command.clone(), hold)
        });
        let continuous = self.sampled.is_none().then_some(command);
        let model = &self.plant.model;
        self.plant.variation = Some(PlantVariation::new(model, columns, continuous));
        self.computed = vec![0.0; joints * width];
        let size = states * (1 + width);
        self.stages = Stages::new(size);
        self.state.resize(size, 0.0);
        self.restart(&parameters)?;
        Ok(self)
    }

    /// The derivatives at the sample of the last [`step`](Self::step); none unless the loop was made
    /// [`with_sensitivities`](Self::with_sensitivities).
    pub fn sensitivities(&self) -> Option<Sensitivities<'_>> {
        let derivatives = &self.state[self.plant.states()..];
        self.plant.variation.as_ref().map(|variation| variation.sensitivities(derivatives))
    }

    /// The derivatives of the command that acts.
    pub(super) fn apply_variation(&mut self, acting: impl Fn(&CommandHold<Vec<f64>>) -> &Vec<f64>) {
        if let (Some((_, hold)), Some(variation)) = (&self.varied, &mut self.plant.variation) {
            variation.apply(acting(hold));
        }
    }
}
