//! Simulation and step in turn, until the parameters stand still.

use nalgebra::DVector;

use super::Optimiser;
use super::damping::Damped;
use super::problem::{Output, Point, Problem};
use crate::identification::didim::ConvergenceLimits;
use crate::identification::error::IdentificationError;
use crate::identification::estimate::ConvergenceStep;
use crate::regression::{Observations, Solution};
use crate::simulation::SimulationError;

/// Steps from one point that are tried: each is half as long or ten times as much damped.
const MAX_TRIES: u32 = 12;

/// Weights are renewed no more often than this.
const MAX_RENEWALS: u32 = 5;

/// A level that changes by no more than this share does not ask for other weights.
const SAME_LEVEL: f64 = 0.1;

/// Smallest level, as a share of the measurements: below, only rounding would be left to fit.
const SMALLEST_LEVEL: f64 = 1e-9;

/// A relative error below this is small for any arm, as in DIDIM.
const SMALL_ERROR: f64 = 1e-3;

/// First damping, its change, and what is none.
const FIRST_DAMPING: f64 = 1e-3;
const DAMPING_CHANGE: f64 = 10.0;
const NO_DAMPING: f64 = 1e-9;

/// The point where the parameters stand still, its equation and the solution.
pub(super) struct Optimum {
    pub(super) point: Point,
    pub(super) observations: Observations,
    pub(super) solution: Solution,
    pub(super) linear_steps: u32,
    pub(super) steps: Vec<ConvergenceStep>,
}

/// From a start to the minimum of Σ ‖y_j − y_sj(θ)‖²/σ_j² over the joints (equation 14, weighted).
pub(super) struct Iteration<'p, 'a> {
    problem: &'p mut Problem<'a>,
    optimiser: Optimiser,
    limits: ConvergenceLimits,
    /// σ_j.
    levels: Vec<f64>,
    damping: f64,
    /// Simulations of new parameters; those for differences are not counted.
    trials: u32,
    linear_steps: u32,
    steps: Vec<ConvergenceStep>,
}

impl<'p, 'a> Iteration<'p, 'a> {
    pub(super) fn new(
        problem: &'p mut Problem<'a>,
        optimiser: Optimiser,
        limits: ConvergenceLimits,
    ) -> Self {
        Self {
            problem,
            optimiser,
            limits,
            levels: vec![],
            damping: FIRST_DAMPING,
            trials: 0,
            linear_steps: 0,
            steps: vec![],
        }
    }

    pub(super) fn run(mut self, start: &DVector<f64>) -> Result<Optimum, IdentificationError> {
        self.trials += 1;
        let first = |cause| IdentificationError::FirstSimulation { cause };
        let mut point = self.problem.simulate(start)?.map_err(first)?;
        let mut observations = self.problem.linearise(&mut point)?.map_err(first)?;
        self.levels = self.first_levels(&observations)?;
        let (mut tries, mut renewals) = (0, 0);
        loop {
            let solution = self.solve(&observations)?;
            let moves = self.note(&point, &solution, tries);
            if moves.is_none() {
                let levels = self.renewed(&observations, &solution);
                let same = levels.iter().zip(&self.levels);
                let settled =
                    same.into_iter().all(|(new, old)| (new / old - 1.0).abs() <= SAME_LEVEL);
                self.levels = levels;
                if settled || renewals == MAX_RENEWALS {
                    let solution = self.solve(&observations)?;
                    let (linear_steps, steps) = (self.linear_steps, self.steps);
                    return Ok(Optimum { point, observations, solution, linear_steps, steps });
                }
                renewals += 1;
                tries = 0;
                continue;
            }
            (point, observations, tries) = self.advance(&point, &observations, &solution, moves)?;
        }
    }

    /// The weights to begin with. Torques have those of the equation error, which does not depend on
    /// the start. Positions have no equation, and their noise is not known before: the residuals of
    /// the first linear step, without weights, are free of what the start has wrong, to first order.
    fn first_levels(&self, observations: &Observations) -> Result<Vec<f64>, IdentificationError> {
        match self.problem.output {
            Output::Torque => Ok(self.problem.fit.noise_levels.clone()),
            Output::Position => {
                let named = |error| self.problem.named(error);
                let solution = observations.ordinary().map_err(named)?;
                Ok(self.renewed(observations, &solution))
            }
        }
    }

    fn renewed(&self, observations: &Observations, solution: &Solution) -> Vec<f64> {
        let levels = observations.noise_levels(&solution.residuals).into_iter().enumerate();
        let rows = (observations.rows_per_joint() as f64).sqrt();
        levels
            .map(|(joint, level)| {
                let measured = self.problem.measured.rows_range(observations.joint_rows(joint));
                level.max(SMALLEST_LEVEL * measured.norm() / rows)
            })
            .collect()
    }

    fn solve(&mut self, observations: &Observations) -> Result<Solution, IdentificationError> {
        self.linear_steps += 1;
        observations.weighted(&self.levels).map_err(|error| self.problem.named(error))
    }

    /// Notes the step from a simulation; the parameter that it moves too far to stand still.
    fn note(&mut self, point: &Point, solution: &Solution, tries: u32) -> Option<usize> {
        let relative_error = solution.residuals.norm() / self.problem.measured.norm();
        let again = self.steps.last().is_some_and(|last| last.simulation == self.trials);
        let last = if again { None } else { self.steps.last() };
        let relative_error_change = last.map(|last| {
            (relative_error - last.relative_error).abs() / last.relative_error.max(SMALL_ERROR)
        });
        let deviations = solution.standard_deviations();
        let change = (&solution.parameters - &point.parameters).component_div(&deviations);
        let mover = change.icamax();
        let parameter_change = change[mover].abs();
        let limits = &self.limits;
        let stands = (again
            || relative_error_change.is_some_and(|c| c <= limits.relative_error_change))
            && parameter_change <= limits.parameter_change;
        if !again {
            let (simulation, halvings) = (self.trials, tries);
            self.steps.push(ConvergenceStep {
                simulation,
                relative_error,
                relative_error_change,
                parameter_change,
                halvings,
            });
        }
        (!stands).then_some(mover)
    }

    /// The next point: the first along ever shorter steps that lowers the criterion.
    fn advance(
        &mut self,
        point: &Point,
        observations: &Observations,
        solution: &Solution,
        mover: Option<usize>,
    ) -> Result<(Point, Observations, u32), IdentificationError> {
        let step = &solution.parameters - &point.parameters;
        let damped = Damped::new(observations, &self.levels, &step);
        let before = self.criterion(&self.problem.residuals(point));
        let mut cause: Option<SimulationError> = None;
        for tries in 0..MAX_TRIES {
            self.check_trials_left(mover)?;
            let step = match self.optimiser {
                Optimiser::GaussNewton => &step * 0.5_f64.powi(tries.cast_signed()),
                Optimiser::LevenbergMarquardt if self.damping < NO_DAMPING => step.clone(),
                Optimiser::LevenbergMarquardt => damped.step(self.damping),
            };
            self.trials += 1;
            match self.problem.simulate(&(&point.parameters + step))? {
                Err(failed) => cause = Some(failed),
                Ok(mut next) => {
                    if self.criterion(&self.problem.residuals(&next)) < before {
                        match self.problem.linearise(&mut next)? {
                            Ok(observations) => {
                                self.damping /= DAMPING_CHANGE;
                                return Ok((next, observations, tries));
                            }
                            Err(failed) => cause = Some(failed),
                        }
                    }
                }
            }
            self.damping = self.damping.max(NO_DAMPING) * DAMPING_CHANGE;
        }
        let simulations = self.problem.simulations;
        Err(match cause {
            Some(cause) => IdentificationError::NoStep { simulations, halvings: MAX_TRIES, cause },
            None => IdentificationError::NoDescent {
                simulations,
                parameter: self.name(mover),
                parameter_change: self.steps.last().map_or(f64::NAN, |s| s.parameter_change),
            },
        })
    }

    /// Σ ‖ρ_j‖²/σ_j².
    fn criterion(&self, residuals: &DVector<f64>) -> f64 {
        let rows = residuals.len() / self.levels.len();
        let joints = residuals.as_slice().chunks(rows).zip(&self.levels);
        joints.map(|(rho, level)| rho.iter().map(|r| (r / level).powi(2)).sum::<f64>()).sum()
    }

    fn name(&self, parameter: Option<usize>) -> String {
        let names = self.problem.fit.selection.names();
        parameter.and_then(|k| names.get(k)).cloned().unwrap_or_default()
    }

    fn check_trials_left(&self, mover: Option<usize>) -> Result<(), IdentificationError> {
        if self.trials < self.limits.max_simulations {
            return Ok(());
        }
        let last = self.steps.last();
        Err(IdentificationError::NotConverged {
            simulations: self.problem.simulations,
            relative_error_change: last.and_then(|step| step.relative_error_change),
            parameter_change: last.map_or(f64::INFINITY, |step| step.parameter_change),
            parameter: self.name(mover),
        })
    }
}
