//! One step of the descent from a point to the next; the step is damped or halved until it is
//! accepted.

use nalgebra::DVector;

use super::damping::DampedProblem;
use super::problem::{Point, Problem};
use crate::feasibility::ConsistentPoint;
use crate::identification::closed_loop::consistent_parameters::ConsistentParameters;
use crate::identification::closed_loop::convergence::Convergence;
use crate::identification::problem::{IdentificationError, IterationError, Optimiser};
use crate::regression::{Observations, Solution};
use didim_dynamics::simulation::SimulationError;

/// Largest number of tried steps from one point. Each further step is half as long, or has ten
/// times the damping.
pub(super) const MAX_TRIES: u32 = 12;

/// Damping at the start, for columns of length 1: nearly the linear step (Marquardt 1963 uses
/// 0.01).
const FIRST_DAMPING: f64 = 1e-3;

/// Factor by which the damping changes: Marquardt's ν.
const DAMPING_CHANGE: f64 = 10.0;

/// Damping below this value is treated as zero; it is far below the rounding error of the normal
/// matrix.
const NO_DAMPING: f64 = 1e-9;

/// A step is good above this gain ratio (actual over predicted improvement), and poor below its
/// complement: the usual quarters (Nocedal and Wright, *Numerical Optimization*, algorithm 4.1).
const GOOD_GAIN: f64 = 0.75;
const POOR_GAIN: f64 = 0.25;

/// A point, its equation and the linear step from there.
pub(super) struct Linearised {
    pub(super) point: Point,
    pub(super) observations: Observations,
    pub(super) solution: Solution,
    /// Consistent parameters of the point and of the solution, if the steps are restricted to
    /// physically consistent parameters.
    pub(super) consistent_point: Option<ConsistentPoint>,
    pub(super) consistent_target: Option<ConsistentPoint>,
}

/// Target of a step.
pub(super) struct DescentPoint {
    pub(super) parameters: DVector<f64>,
    pub(super) consistent_point: Option<ConsistentPoint>,
}

impl DescentPoint {
    /// Creates a point whose parameters need not belong to physically possible bodies.
    pub(super) fn new(parameters: DVector<f64>) -> Self {
        Self { parameters, consistent_point: None }
    }

    /// Returns the penalty of the distance from physically consistent parameters.
    fn penalty(&self) -> f64 {
        penalty(self.consistent_point.as_ref())
    }
}

impl From<ConsistentPoint> for DescentPoint {
    fn from(possible: ConsistentPoint) -> Self {
        Self { parameters: possible.parameters.clone(), consistent_point: Some(possible) }
    }
}

fn penalty(possible: Option<&ConsistentPoint>) -> f64 {
    possible.map_or(0.0, |possible| possible.penalty)
}

/// Reason for which the descent cannot continue from a point.
pub(super) enum Rejection {
    Simulation(SimulationError),
    /// The parameters cannot be distinguished or computed at this point.
    Equation(IdentificationError),
}

/// Descent of the criterion Σ ‖y_j − y_sj(θ)‖²/σ_j² over the joints (equation 14, weighted).
pub(super) struct Descent<'p, 'a> {
    pub(super) problem: &'p mut Problem<'a>,
    /// Restriction of the steps.
    pub(super) consistent_parameters: Option<&'p ConsistentParameters>,
    /// Noise level σ_j of each joint.
    pub(super) noise_levels: Vec<f64>,
    damping: f64,
    /// Number of simulations of new parameters, including those before the first sensitivities and
    /// without those for differences.
    pub(super) trials: u32,
    pub(super) linear_steps: u32,
    pub(super) convergence: Convergence<'a>,
}

impl<'p, 'a> Descent<'p, 'a> {
    pub(super) fn new(
        problem: &'p mut Problem<'a>,
        consistent_parameters: Option<&'p ConsistentParameters>,
    ) -> Self {
        let context = problem.context;
        let limits = context.options.simulation.convergence;
        Self {
            trials: problem.simulations,
            problem,
            consistent_parameters,
            noise_levels: vec![],
            damping: FIRST_DAMPING,
            linear_steps: 0,
            convergence: Convergence::new(limits, context.selection.names()),
        }
    }

    /// Computes the equation at a point. Close to instability, the sensitivities may be too large
    /// to solve it. The descent cannot continue from such a point.
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

    pub(super) fn solve_at(
        &mut self,
        point: Point,
        possible: Option<ConsistentPoint>,
        observations: Observations,
    ) -> Result<Linearised, Rejection> {
        let (solution, target) = self.solve(&observations).map_err(Rejection::Equation)?;
        Ok(Linearised {
            point,
            observations,
            solution,
            consistent_point: possible,
            consistent_target: target,
        })
    }

    pub(super) fn solve(
        &mut self,
        observations: &Observations,
    ) -> Result<(Solution, Option<ConsistentPoint>), IdentificationError> {
        self.linear_steps += 1;
        let solved = observations.solve_weighted(&self.noise_levels);
        let mut solution = solved.map_err(|error| self.problem.regression_failure(error))?;
        let Some(consistent_parameters) = self.consistent_parameters else {
            return Ok((solution, None));
        };
        let target = consistent_parameters.nearest_arm(&solution)?;
        solution.residuals = observations.residuals(&target.parameters);
        solution.parameters.copy_from(&target.parameters);
        Ok((solution, Some(target)))
    }

    /// Returns Σ ‖ρ_j‖²/σ_j².
    fn criterion(&self, residuals: &DVector<f64>) -> f64 {
        let rows = residuals.len() / self.noise_levels.len();
        let joints = residuals.as_slice().chunks(rows).zip(&self.noise_levels);
        joints.map(|(rho, level)| rho.iter().map(|r| (r / level).powi(2)).sum::<f64>()).sum()
    }

    /// Returns the next point: the first, along ever shorter steps, that lowers the criterion and
    /// where the parameters are still distinguishable.
    pub(super) fn advance(
        &mut self,
        from: &Linearised,
    ) -> Result<(Linearised, u32), IdentificationError> {
        let Linearised { point, observations, solution, consistent_point: possible, .. } = from;
        let step = &solution.parameters - &point.parameters;
        let damped = DampedProblem::new(observations, &self.noise_levels, &step);
        let before = self.criterion(&self.problem.residuals(point)) + penalty(possible.as_ref());
        let optimiser = self.problem.context.options.simulation.optimiser;
        let mut cause = None;
        for tries in 0..MAX_TRIES {
            self.convergence.check_left(self.trials, self.problem.simulations)?;
            let part = 0.5_f64.powi(tries.cast_signed());
            let place = match optimiser {
                _ if self.consistent_parameters.is_some() => {
                    let Some(place) = self.interpolate(from, part) else { continue };
                    place
                }
                Optimiser::GaussNewton => DescentPoint::new(&point.parameters + &step * part),
                Optimiser::LevenbergMarquardt if self.damping < NO_DAMPING => {
                    DescentPoint::new(&point.parameters + &step)
                }
                Optimiser::LevenbergMarquardt => {
                    DescentPoint::new(&point.parameters + damped.step(self.damping))
                }
            };
            self.trials += 1;
            let (parameters, added) = (place.parameters.clone(), place.penalty());
            match self.try_point(place, before, tries)? {
                Ok(next) => {
                    let predicted = self.criterion(&observations.residuals(&parameters)) + added;
                    let after = self.criterion(&self.problem.residuals(&next.point)) + added;
                    self.adapt_damping((before - after) / (before - predicted));
                    return Ok((next, tries));
                }
                Err(rejected) => cause = rejected.or(cause),
            }
            self.damping = self.damping.max(NO_DAMPING) * DAMPING_CHANGE;
        }
        let simulations = self.problem.simulations;
        Err(match cause {
            Some(Rejection::Simulation(cause)) => {
                IterationError::NoStep { simulations, halvings: MAX_TRIES, cause }.into()
            }
            Some(Rejection::Equation(error)) => error,
            None => IterationError::NoDescent {
                simulations,
                parameter: self.convergence.most_changed_name(),
                parameter_change: self.convergence.parameter_change().unwrap_or(f64::NAN),
            }
            .into(),
        })
    }

    /// Returns a part of the step to physically consistent parameters, if the steps are restricted
    /// to them.
    fn interpolate(&self, from: &Linearised, part: f64) -> Option<DescentPoint> {
        let (possible, target) =
            (from.consistent_point.as_ref()?, from.consistent_target.as_ref()?);
        Some(self.consistent_parameters?.interpolate(possible, target, part)?.into())
    }

    /// Returns the point with these parameters if it lowers the criterion and its equation can be
    /// solved. Otherwise returns the rejection, or `None` if the criterion is just not below
    /// `before`.
    fn try_point(
        &mut self,
        place: DescentPoint,
        before: f64,
        tries: u32,
    ) -> Result<Result<Linearised, Option<Rejection>>, IdentificationError> {
        let parameters = &place.parameters;
        let before = before - place.penalty();
        // Most first tries are accepted. After a rejected try, a simulation without sensitivities
        // is the faster check of the next try.
        if tries > 0 && self.problem.is_exact() {
            match self.problem.simulate_output(parameters)? {
                Err(failed) => return Ok(Err(Some(Rejection::Simulation(failed)))),
                Ok(point) if !self.lowers_criterion(&point, before) => return Ok(Err(None)),
                Ok(_) => {}
            }
        }
        let point = match self.problem.simulate(parameters)? {
            Err(failed) => return Ok(Err(Some(Rejection::Simulation(failed)))),
            Ok(point) if !self.lowers_criterion(&point, before) => return Ok(Err(None)),
            Ok(point) => point,
        };
        let linearised = self.linearise(point);
        let solved = linearised
            .and_then(|(point, equation)| self.solve_at(point, place.consistent_point, equation));
        Ok(solved.map_err(Some))
    }

    fn lowers_criterion(&self, point: &Point, before: f64) -> bool {
        self.criterion(&self.problem.residuals(point)) < before
    }

    /// Reduces the damping if the linear equation predicted the criterion well, increases it if
    /// not. `gain` is the ratio of the actual to the predicted improvement of a step.
    fn adapt_damping(&mut self, gain: f64) {
        if gain > GOOD_GAIN {
            self.damping /= DAMPING_CHANGE;
        } else if gain < POOR_GAIN {
            self.damping = self.damping.max(NO_DAMPING) * DAMPING_CHANGE;
        }
    }
}
