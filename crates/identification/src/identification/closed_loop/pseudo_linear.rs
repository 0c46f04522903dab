//! Pseudo-linear regression on the simulated motion: simulation and least squares in turn, until
//! the estimates converge.

use nalgebra::DVector;

use super::consistent_parameters::ConsistentParameters;
use super::convergence::Convergence;
use super::instruments::Instruments;
use super::simulation_error::position_errors;
use super::simulator::Simulator;
use crate::identification::equation_error::{EquationErrorFit, Weighting};
use crate::identification::judgement::Iteration;
use crate::identification::observation::{fitted_matrix, fitted_matrix_of, torque_equation};
use crate::identification::problem::{Context, IdentificationError, IterationError};
use crate::regression::{Observations, Solution};

/// Largest number of halvings of a step. A thousandth of the step changes nothing significantly.
const MAX_HALVINGS: u32 = 10;

/// Equation that contains the simulated motion.
pub(super) enum Equation {
    /// DIDIM: the observation matrix is that of the simulated motion. `torque` is the measured
    /// torque of the rows, shifted to the simulated samples.
    Simulated { torque: DVector<f64> },
    /// IDIM-IV: the equation is that of the measured motion; the instruments come from the
    /// simulated motion.
    Instrumented,
}

/// Last simulation, its equation and the solution.
pub(super) struct Converged {
    /// Simulated parameters (b).
    pub(super) simulated_parameters: DVector<f64>,
    pub(super) observations: Observations,
    pub(super) solution: Solution,
}

/// Iteration from a start to converged parameters.
pub(super) struct PseudoLinear<'a> {
    context: &'a Context<'a>,
    fit: &'a EquationErrorFit,
    equation: Equation,
    /// Restriction of the steps of DIDIM's equation.
    consistent_parameters: Option<&'a ConsistentParameters>,
    pub(super) simulator: Simulator<'a>,
    /// Number of simulations, including failed ones.
    pub(super) simulations: u32,
    pub(super) convergence: Convergence<'a>,
}

impl<'a> PseudoLinear<'a> {
    pub(super) fn new(
        context: &'a Context<'a>,
        fit: &'a EquationErrorFit,
        equation: Equation,
        consistent_parameters: Option<&'a ConsistentParameters>,
        simulator: Simulator<'a>,
    ) -> Self {
        let limits = context.options.simulation.convergence;
        let convergence = Convergence::new(limits, context.selection.names());
        Self {
            context,
            fit,
            equation,
            consistent_parameters,
            simulator,
            simulations: 0,
            convergence,
        }
    }

    /// Iterates until the estimates converge.
    pub(super) fn run(&mut self, start: DVector<f64>) -> Result<Converged, IdentificationError> {
        let mut previous = None;
        let mut parameters = start;
        loop {
            let halvings = self.simulate(previous.as_ref(), &mut parameters)?;
            let (observations, solution) = self.solve(&parameters)?;
            let relative_error = solution.residuals.norm() / observations.measured_values().norm();
            let changes =
                (&solution.parameters - &parameters).component_div(&solution.standard_deviations());
            if self.convergence.record_step(self.simulations, halvings, relative_error, &changes) {
                return Ok(Converged { simulated_parameters: parameters, observations, solution });
            }
            self.check_simulations_left()?;
            let next = solution.parameters;
            previous = Some(core::mem::replace(&mut parameters, next));
        }
    }

    /// Returns the estimate after this number of steps, converged or not, and the one before it.
    pub(super) fn steps_from(
        &mut self,
        start: DVector<f64>,
        steps: u32,
    ) -> Result<(DVector<f64>, Option<DVector<f64>>), IdentificationError> {
        let mut previous = None;
        let mut parameters = start;
        for _ in 0..steps {
            self.simulate(previous.as_ref(), &mut parameters)?;
            let next = self.solve(&parameters)?.1.parameters;
            previous = Some(core::mem::replace(&mut parameters, next));
        }
        Ok((parameters, previous))
    }

    /// Simulates `parameters`. Halves the step from `previous` until the simulation succeeds, and
    /// returns the number of halvings.
    fn simulate(
        &mut self,
        previous: Option<&DVector<f64>>,
        parameters: &mut DVector<f64>,
    ) -> Result<u32, IdentificationError> {
        let mut halvings = 0;
        loop {
            self.simulations += 1;
            let Err(cause) = self.simulator.run(parameters)? else { return Ok(halvings) };
            let Some(previous) = previous else {
                if self.simulator.slow_down()? {
                    continue;
                }
                return Err(IterationError::FirstSimulation { cause }.into());
            };
            let simulations = self.simulations;
            if halvings == MAX_HALVINGS {
                return Err(IterationError::NoStep { simulations, halvings, cause }.into());
            }
            self.check_simulations_left()?;
            halvings += 1;
            *parameters = (&*parameters + previous) * 0.5;
        }
    }

    /// Solves the weighted least squares on the motion of the last simulation, which used
    /// `parameters`.
    fn solve(
        &self,
        parameters: &DVector<f64>,
    ) -> Result<(Observations, Solution), IdentificationError> {
        let Self { context, fit, .. } = self;
        let named = |error| context.selection.regression_failure(error);
        let motion = self.simulator.motion();
        let matrix = if context.model.feels_loads() {
            // The loads are those of the simulated parameters.
            let model = context.with_loads(&self.simulator.simulated_parameters(parameters));
            fitted_matrix_of(context, &model, motion)?
        } else {
            fitted_matrix(context, motion)?
        };
        match &self.equation {
            Equation::Simulated { torque } => {
                let observations = torque_equation(context, matrix, torque.clone(), motion)?;
                let robust = context.options.robust;
                let weighting = Weighting::new(&observations, &fit.noise_levels, robust);
                let weighting = restrict_to_consistent(
                    weighting.map_err(named)?,
                    &observations,
                    self.consistent_parameters,
                )?;
                Ok((observations, weighting.solution))
            }
            Equation::Instrumented => {
                let (equation, levels) = (&fit.observations, &fit.noise_levels);
                let instruments =
                    Instruments::new(equation, &matrix.dense(), levels, &context.selection)?;
                let solution = instruments.solve(equation, levels).map_err(named)?;
                Ok((instruments.projected_equation, solution))
            }
        }
    }

    /// Returns the record of all steps so far, plus one step for the renewed weights.
    pub(super) fn iteration_record(&self) -> Result<Iteration, IdentificationError> {
        let steps = self.convergence.steps.clone();
        Ok(Iteration {
            linear_steps: u32::try_from(steps.len()).unwrap_or(u32::MAX) + 1,
            simulations: self.simulations,
            steps,
            reference: Some(self.simulator.reference_source()),
            slower_bandwidth_hz: self.simulator.slower_bandwidth_hz(),
            position_error_per_joint: Some(position_errors(self.context, self.simulator.motion())?),
            ..Iteration::default()
        })
    }

    fn check_simulations_left(&self) -> Result<(), IdentificationError> {
        self.convergence.check_left(self.simulations, self.simulations)
    }
}

/// Moves a weighted solution to the nearest physically consistent parameters, if the steps are
/// restricted to them.
pub(super) fn restrict_to_consistent(
    weighting: Weighting,
    equation: &Observations,
    consistent_parameters: Option<&ConsistentParameters>,
) -> Result<Weighting, IdentificationError> {
    let Some(body_list) = consistent_parameters else { return Ok(weighting) };
    let nearest = body_list.nearest_arm(&weighting.solution)?;
    Ok(weighting.with_parameters(equation, nearest.parameters))
}
