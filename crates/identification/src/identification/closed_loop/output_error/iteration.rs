//! Alternates simulations and steps until the parameters converge.

use nalgebra::DVector;

use super::descent::{Descent, DescentPoint, Linearised, MAX_TRIES, Rejection};
use crate::identification::judgement::ConvergenceStep;
use crate::identification::problem::{IdentificationError, IterationError};
use crate::regression::{Observations, Solution};

/// Largest number of weight renewals. The parameters change less with each renewal, and two or
/// three are usual.
const MAX_RENEWALS: u32 = 5;

/// Largest relative change of a noise level that requires no new weights. Such a change would move
/// the parameters by a small part of their standard deviations.
const LEVEL_TOLERANCE: f64 = 0.1;

/// Smallest noise level, as a share of the measurements. Smaller residuals are only rounding
/// errors.
const MIN_LEVEL: f64 = 1e-9;

/// Converged point, and the steps to it.
pub(super) struct Optimum {
    pub(super) linearisation: Linearised,
    pub(super) linear_steps: u32,
    pub(super) steps: Vec<ConvergenceStep>,
}

impl Descent<'_, '_> {
    /// Runs from a start to the minimum of the criterion. The start moves towards the parameters
    /// `before` as long as it cannot be linearised.
    pub(super) fn run(
        mut self,
        mut start: DVector<f64>,
        before: Option<&DVector<f64>>,
    ) -> Result<Optimum, IdentificationError> {
        let mut halvings = 0;
        let mut state = loop {
            match (self.first_linearisation(&start)?, before) {
                (Ok(at), _) => break at,
                (Err(_), Some(before)) if halvings < MAX_TRIES => start = (start + before) * 0.5,
                (Err(Rejection::Simulation(_)), _) if self.problem.simulator.slow_down()? => {
                    continue;
                }
                (Err(Rejection::Simulation(cause)), _) => {
                    return Err(IterationError::FirstSimulation { cause }.into());
                }
                (Err(Rejection::Equation(error)), _) => return Err(error),
            }
            halvings += 1;
        };
        let (mut tries, mut renewals) = (0, 0);
        loop {
            let relative_error = state.solution.residuals.norm() / self.problem.measured.norm();
            let changes = (&state.solution.parameters - &state.point.parameters)
                .component_div(&state.solution.standard_deviations());
            if self.convergence.record_step(self.trials, tries, relative_error, &changes) {
                let levels = self.renewed_levels(&state.observations, &state.solution);
                let same = levels.iter().zip(&self.noise_levels);
                let settled =
                    same.into_iter().all(|(new, old)| (new / old - 1.0).abs() <= LEVEL_TOLERANCE);
                self.noise_levels = levels;
                (state.solution, state.consistent_target) = self.solve(&state.observations)?;
                if settled || renewals == MAX_RENEWALS {
                    let (linear_steps, steps) = (self.linear_steps, self.convergence.steps);
                    return Ok(Optimum { linearisation: state, linear_steps, steps });
                }
                renewals += 1;
                tries = 0;
                continue;
            }
            (state, tries) = self.advance(&state)?;
        }
    }

    /// Returns the first point with its weights.
    fn first_linearisation(
        &mut self,
        start: &DVector<f64>,
    ) -> Result<Result<Linearised, Rejection>, IdentificationError> {
        self.trials += 1;
        let place = match self.consistent_parameters {
            None => DescentPoint::new(start.clone()),
            Some(consistent_parameters) => consistent_parameters.start_parameters(start)?.into(),
        };
        let point = match self.problem.simulate(&place.parameters)? {
            Err(failed) => return Ok(Err(Rejection::Simulation(failed))),
            Ok(point) => point,
        };
        let (point, observations) = match self.linearise(point) {
            Err(rejection) => return Ok(Err(rejection)),
            Ok(linearised) => linearised,
        };
        match self.first_levels(&observations) {
            Ok(levels) => self.noise_levels = levels,
            Err(error) => return Ok(Err(Rejection::Equation(error))),
        }
        Ok(self.solve_at(point, place.consistent_point, observations))
    }

    /// Returns the initial weights. They come from the residuals of the first linear step without
    /// weights, which do not contain the error of the start, to first order. If the start is far
    /// away, they also show how nonlinear the output of each joint is. The weights stay constant
    /// until the parameters have converged.
    fn first_levels(&self, observations: &Observations) -> Result<Vec<f64>, IdentificationError> {
        let named = |error| self.problem.regression_failure(error);
        let solution = observations.solve_ordinary().map_err(named)?;
        Ok(self.renewed_levels(observations, &solution))
    }

    fn renewed_levels(&self, observations: &Observations, solution: &Solution) -> Vec<f64> {
        let levels = observations.noise_levels(&solution.residuals).into_iter().enumerate();
        let rows = (observations.rows_per_joint() as f64).sqrt();
        levels
            .map(|(joint, level)| {
                let measured = self.problem.measured.rows_range(observations.joint_rows(joint));
                level.max(MIN_LEVEL * measured.norm() / rows)
            })
            .collect()
    }
}
