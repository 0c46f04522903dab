//! One step: from a point to the next, damped or halved until it is taken.

use nalgebra::DVector;

use super::damping::Damped;
use super::iteration::Iteration;
use super::problem::Point;
use super::{Optimiser, SensitivityMethod};
use crate::identification::given::error::IdentificationError;
use crate::regression::{Observations, Solution};
use crate::simulation::SimulationError;

/// Steps from one point that are tried: each is half as long or ten times as much damped.
pub(super) const MAX_TRIES: u32 = 12;

/// The change of the damping, and what is none.
const DAMPING_CHANGE: f64 = 10.0;
const NO_DAMPING: f64 = 1e-9;

/// A step that gains more than this share of what the linear equation foretells is good, less than that
/// poor.
const GOOD_GAIN: f64 = 0.75;
const POOR_GAIN: f64 = 0.25;

/// A point, its equation and the linear step from there.
pub(super) struct Linearised {
    pub(super) point: Point,
    pub(super) observations: Observations,
    pub(super) solution: Solution,
}

/// Why a point that could be simulated, or not, is none to go on from.
pub(super) enum Rejection {
    Simulation(SimulationError),
    /// Its parameters cannot be told apart there, or not be computed.
    Equation(IdentificationError),
}

impl Iteration<'_, '_> {
    /// The next point: the first along ever shorter steps that lowers the criterion and still tells
    /// the parameters apart.
    pub(super) fn advance(
        &mut self,
        from: &Linearised,
        mover: usize,
    ) -> Result<(Linearised, u32), IdentificationError> {
        let Linearised { point, observations, solution } = from;
        let step = &solution.parameters - &point.parameters;
        let damped = Damped::new(observations, &self.levels, &step);
        let before = self.criterion(&self.problem.residuals(point));
        let mut cause = None;
        for tries in 0..MAX_TRIES {
            self.check_trials_left(mover)?;
            let step = match self.optimiser {
                Optimiser::GaussNewton => &step * 0.5_f64.powi(tries.cast_signed()),
                Optimiser::LevenbergMarquardt if self.damping < NO_DAMPING => step.clone(),
                Optimiser::LevenbergMarquardt => damped.step(self.damping),
            };
            self.trials += 1;
            let parameters = &point.parameters + step;
            match self.try_point(&parameters, before, tries)? {
                Ok(next) => {
                    let predicted = self.criterion(&observations.residuals(&parameters));
                    let after = self.criterion(&self.problem.residuals(&next.point));
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
                IdentificationError::NoStep { simulations, halvings: MAX_TRIES, cause }
            }
            Some(Rejection::Equation(error)) => error,
            None => IdentificationError::NoDescent {
                simulations,
                parameter: self.name(mover),
                parameter_change: self.steps.last().map_or(f64::NAN, |s| s.parameter_change),
            },
        })
    }

    /// The point with these parameters, if it is one to go on from; why not, where that is more than a
    /// criterion that is not below `before`.
    fn try_point(
        &mut self,
        parameters: &DVector<f64>,
        before: f64,
        tries: u32,
    ) -> Result<Result<Linearised, Option<Rejection>>, IdentificationError> {
        // Most first tries are taken. After one that was not, a simulation without sensitivities
        // says sooner whether this one is.
        if tries > 0 && self.problem.method == SensitivityMethod::Exact {
            match self.problem.simulate_output(parameters)? {
                Err(failed) => return Ok(Err(Some(Rejection::Simulation(failed)))),
                Ok(point) if !self.lowers(&point, before) => return Ok(Err(None)),
                Ok(_) => {}
            }
        }
        let point = match self.problem.simulate(parameters)? {
            Err(failed) => return Ok(Err(Some(Rejection::Simulation(failed)))),
            Ok(point) if !self.lowers(&point, before) => return Ok(Err(None)),
            Ok(point) => point,
        };
        let linearised = self.linearise(point);
        Ok(linearised.and_then(|(point, equation)| self.solved(point, equation)).map_err(Some))
    }

    fn lowers(&self, point: &Point, before: f64) -> bool {
        self.criterion(&self.problem.residuals(point)) < before
    }

    /// Less damping where the linear equation has foretold the criterion, more where it has not:
    /// `gain` is what a step has gained over what it should have (Nocedal and Wright, *Numerical
    /// Optimization*, algorithm 4.1).
    fn adapt_damping(&mut self, gain: f64) {
        if gain > GOOD_GAIN {
            self.damping /= DAMPING_CHANGE;
        } else if gain < POOR_GAIN {
            self.damping = self.damping.max(NO_DAMPING) * DAMPING_CHANGE;
        }
    }
}
