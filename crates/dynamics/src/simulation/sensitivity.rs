//! A loop that integrates the derivatives of its signals with respect to parameters.

use super::closed_loop::ClosedLoop;
use super::error::SetupError;
use super::hold::CommandHold;
use super::integrator::RungeKuttaStages;
use super::variation::{PlantVariation, Sensitivities};
use crate::control::CommandVariation;
use crate::trajectory::Reference;

impl<R: Reference> ClosedLoop<R> {
    /// Returns the same loop, back at time 0, which also integrates its derivatives with respect to
    /// the standard parameters in these `columns`, in the same steps. They are derivatives of the
    /// simulated signals themselves, not of an ideal solution that the steps approach.
    ///
    /// # Errors
    /// [`SetupError::NoSensitivity`] names what the derivatives do not exist with, and
    /// [`SetupError::BadValue`] a column that no parameter has, or that appears twice.
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
        let states = self.plant.state_count();
        let command = CommandVariation::new(&self.controller, width);
        self.command_variation = self.sampled_control.as_ref().map(|(controller, _)| {
            let none = vec![0.0; joints * width];
            let hold = CommandHold::new(controller.delay_s(), controller.period_s(), none);
            (command.clone(), hold)
        });
        let continuous = self.sampled_control.is_none().then_some(command);
        let (model, hysteresis) = (&self.plant.model, self.plant.hysteresis.as_ref());
        let variation = PlantVariation::new(model, columns, continuous, hysteresis);
        self.plant.variation = Some(variation);
        self.command_derivatives = vec![0.0; joints * width];
        let size = states * (1 + width);
        self.stages = RungeKuttaStages::new(size);
        self.state.resize(size, 0.0);
        self.restart(&parameters)?;
        Ok(self)
    }

    /// Returns the derivatives at the sample of the last [`step`](Self::step); `None` unless the
    /// loop was made [`with_sensitivities`](Self::with_sensitivities).
    pub fn sensitivities(&self) -> Option<Sensitivities<'_>> {
        let derivatives = &self.state[self.plant.state_count()..];
        self.plant.variation.as_ref().map(|variation| variation.sensitivities(derivatives))
    }
}
