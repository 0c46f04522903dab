//! Simulation and step in turn, until the parameters stand still.

use nalgebra::DVector;

use super::Optimiser;
use super::problem::{Point, Problem};
use super::step::{Linearised, MAX_TRIES, Rejection};
use crate::identification::given::error::IdentificationError;
use crate::identification::given::simulation::ConvergenceLimits;
use crate::identification::judgement::estimate::ConvergenceStep;
use crate::regression::{Observations, Solution};

/// Weights are renewed no more often than this.
const MAX_RENEWALS: u32 = 5;

/// A level that changes by no more than this share does not ask for other weights.
const SAME_LEVEL: f64 = 0.1;

/// Smallest level, as a share of the measurements: below, only rounding would be left to fit.
const SMALLEST_LEVEL: f64 = 1e-9;

/// A relative error below this is small for any arm, as in DIDIM.
const SMALL_ERROR: f64 = 1e-3;

/// First damping.
const FIRST_DAMPING: f64 = 1e-3;

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
    pub(super) problem: &'p mut Problem<'a>,
    pub(super) optimiser: Optimiser,
    limits: ConvergenceLimits,
    /// σ_j.
    pub(super) levels: Vec<f64>,
    pub(super) damping: f64,
    /// Simulations of new parameters, those before the first sensitivities included; those for
    /// differences are not counted.
    pub(super) trials: u32,
    linear_steps: u32,
    pub(super) steps: Vec<ConvergenceStep>,
}

impl<'p, 'a> Iteration<'p, 'a> {
    pub(super) fn new(
        problem: &'p mut Problem<'a>,
        optimiser: Optimiser,
        limits: ConvergenceLimits,
    ) -> Self {
        Self {
            trials: problem.simulations,
            problem,
            optimiser,
            limits,
            levels: vec![],
            damping: FIRST_DAMPING,
            linear_steps: 0,
            steps: vec![],
        }
    }

    /// From a start, which is drawn nearer to the parameters `before` as long as it cannot be linearised.
    pub(super) fn run(
        mut self,
        mut start: DVector<f64>,
        before: Option<&DVector<f64>>,
    ) -> Result<Optimum, IdentificationError> {
        let mut halvings = 0;
        let mut at = loop {
            match (self.first(&start)?, before) {
                (Ok(at), _) => break at,
                (Err(_), Some(before)) if halvings < MAX_TRIES => start = (start + before) * 0.5,
                (Err(Rejection::Simulation(cause)), _) => {
                    return Err(IdentificationError::FirstSimulation { cause });
                }
                (Err(Rejection::Equation(error)), _) => return Err(error),
            }
            halvings += 1;
        };
        let (mut tries, mut renewals) = (0, 0);
        loop {
            let Some(mover) = self.note(&at.point, &at.solution, tries) else {
                let levels = self.renewed(&at.observations, &at.solution);
                let same = levels.iter().zip(&self.levels);
                let settled =
                    same.into_iter().all(|(new, old)| (new / old - 1.0).abs() <= SAME_LEVEL);
                self.levels = levels;
                at.solution = self.solve(&at.observations)?;
                if settled || renewals == MAX_RENEWALS {
                    let Linearised { point, observations, solution } = at;
                    let (linear_steps, steps) = (self.linear_steps, self.steps);
                    return Ok(Optimum { point, observations, solution, linear_steps, steps });
                }
                renewals += 1;
                tries = 0;
                continue;
            };
            (at, tries) = self.advance(&at, mover)?;
        }
    }

    /// The first point and its weights.
    fn first(
        &mut self,
        start: &DVector<f64>,
    ) -> Result<Result<Linearised, Rejection>, IdentificationError> {
        self.trials += 1;
        let point = match self.problem.simulate(start)? {
            Err(failed) => return Ok(Err(Rejection::Simulation(failed))),
            Ok(point) => point,
        };
        let (point, observations) = match self.linearise(point) {
            Err(rejection) => return Ok(Err(rejection)),
            Ok(linearised) => linearised,
        };
        match self.first_levels(&observations) {
            Ok(levels) => self.levels = levels,
            Err(error) => return Ok(Err(Rejection::Equation(error))),
        }
        Ok(self.solved(point, observations))
    }

    /// Where the loop is next to instability, its sensitivities grow beyond what can be solved: then
    /// there is no going on from the point.
    pub(super) fn linearise(
        &mut self,
        mut point: Point,
    ) -> Result<(Point, Observations), Rejection> {
        match self.problem.linearise(&mut point) {
            Ok(Ok(observations)) => Ok((point, observations)),
            Ok(Err(failed)) => Err(Rejection::Simulation(failed)),
            Err(error) => Err(Rejection::Equation(error)),
        }
    }

    pub(super) fn solved(
        &mut self,
        point: Point,
        observations: Observations,
    ) -> Result<Linearised, Rejection> {
        let solution = self.solve(&observations).map_err(Rejection::Equation)?;
        Ok(Linearised { point, observations, solution })
    }

    /// The weights to begin with: the residuals of the first linear step, without weights, are free of
    /// what the start has wrong, to first order. From a start far away they say how badly each joint
    /// can be linearised, and weigh it accordingly; they stay until the parameters stand still.
    fn first_levels(&self, observations: &Observations) -> Result<Vec<f64>, IdentificationError> {
        let named = |error| self.problem.named(error);
        let solution = observations.ordinary().map_err(named)?;
        Ok(self.renewed(observations, &solution))
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

    /// Σ ‖ρ_j‖²/σ_j².
    pub(super) fn criterion(&self, residuals: &DVector<f64>) -> f64 {
        let rows = residuals.len() / self.levels.len();
        let joints = residuals.as_slice().chunks(rows).zip(&self.levels);
        joints.map(|(rho, level)| rho.iter().map(|r| (r / level).powi(2)).sum::<f64>()).sum()
    }

    pub(super) fn name(&self, parameter: usize) -> String {
        let names = self.problem.fit.selection.names();
        names.get(parameter).cloned().unwrap_or_default()
    }

    pub(super) fn check_trials_left(&self, mover: usize) -> Result<(), IdentificationError> {
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
