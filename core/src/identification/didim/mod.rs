//! DIDIM: direct and inverse dynamic identification models (paper, section 3.3).

mod alignment;
mod inertia;
mod options;
mod simulator;
mod start;

pub use inertia::mean_joint_inertia;
pub use options::{ConvergenceLimits, DidimOptions, Start};

use nalgebra::DVector;

use super::assemble::Findings;
use super::error::IdentificationError;
use super::estimate::{ConvergenceStep, Identification, ReferenceSource};
use super::experiment::Experiment;
use super::idim_ls::EquationErrorFit;
use super::method::Method;
use super::observation::observation_matrix;
use super::prefilter::{delayed_torque, row_times};
use crate::dynamics::BaseParameters;
use crate::regression::{Observations, Solution};
use crate::robot::Robot;
use crate::signal::ParallelDecimation;
use simulator::Simulator;

/// A step is halved no more often than this: a thousandth of it leads nowhere else.
const MAX_HALVINGS: u32 = 10;

/// Identifies base parameters from the torques alone, with the motion of the simulated closed loop
/// in place of the measured one.
///
/// 1. Simulate the closed loop with the current estimate θ, along the recorded reference.
/// 2. Build the regressor φ on the **simulated** positions, velocities and accelerations. With the
///    dependence of the simulated motion on θ neglected (pseudo-linear regression), φ is the
///    sensitivity of the simulated torque (equation 20).
/// 3. Filter and decimate regressor and measured torque alike; weighted least squares gives the
///    next θ. A step whose parameters cannot be simulated is halved.
/// 4. Repeat until the estimates stand still.
///
/// Measured positions enter by the initial state only, and by the weights: σ_j are those of the
/// equation error (see [`idim_ls`](super::idim_ls())) through all iterations, since residuals of a
/// motion far from the real one would weight away the joints that fit worst. After convergence
/// they are renewed from the residuals once, and the last equation is solved once more.
///
/// # Errors
/// [`IdentificationError`], each variant with its remedy.
pub fn didim(
    robot: &Robot,
    base: &BaseParameters,
    experiment: &Experiment,
    options: &DidimOptions,
) -> Result<Identification, IdentificationError> {
    options.convergence.validate()?;
    let decimation = if options.decimated {
        let filter = &options.regression.decimation_filter;
        filter.design().map_err(IdentificationError::DecimationFilter)?
    } else {
        ParallelDecimation::none()
    };
    let fit = EquationErrorFit::new(robot, base, experiment, &options.regression, decimation)?;
    let shift = alignment::torque_shift_samples(experiment, options.controller.timing())?;
    let mut iteration = Iteration {
        experiment,
        fit: &fit,
        limits: options.convergence,
        torque: delayed_torque(experiment, shift, &fit.decimation)?,
        simulator: Simulator::new(robot, &fit, experiment, options)?,
        simulations: 0,
        steps: Vec::new(),
        mover: 0,
    };
    let start = start::parameters(options.start, robot, base, &fit)?;
    let (observations, last) = iteration.run(start)?;

    let named = |error| IdentificationError::from_regression(error, &fit.selection);
    let noise_levels = observations.noise_levels(&last.residuals);
    let solution = observations.weighted(&noise_levels).map_err(named)?;
    let unweighted = observations.ordinary().map_err(named)?;
    let findings = Findings {
        method: Method::Didim,
        robot,
        experiment,
        selection: &fit.selection,
        observations: &observations,
        row_times_s: row_times(experiment.counted(), &fit.decimation, experiment.sample_rate_hz()),
        solution: &solution,
        unweighted_condition_number: unweighted.condition_number(),
        iterations: u32::try_from(iteration.steps.len() + 1).unwrap_or(u32::MAX),
        simulations: iteration.simulations,
        limits: &options.regression.limits,
    };
    let mut found = findings.assemble();
    let source = iteration.simulator.source();
    if source == ReferenceSource::MeasuredPosition {
        found.estimate.verdict.notes.push(
            "no reference was recorded: the filtered measured position stood in for it, so that \
             this result is nearly that of IDIM-LS"
                .to_owned(),
        );
    }
    found.estimate.reference = Some(source);
    found.estimate.convergence = iteration.steps;
    Ok(found)
}

/// From a start to parameters that stand still.
struct Iteration<'a> {
    experiment: &'a Experiment,
    fit: &'a EquationErrorFit,
    limits: ConvergenceLimits,
    /// Measured torque of the rows, shifted to the simulated samples.
    torque: DVector<f64>,
    simulator: Simulator<'a>,
    simulations: u32,
    steps: Vec<ConvergenceStep>,
    /// The parameter that the last step changed most, of those selected.
    mover: usize,
}

impl Iteration<'_> {
    /// The equation of the last simulation and its solution.
    fn run(
        &mut self,
        start: DVector<f64>,
    ) -> Result<(Observations, Solution), IdentificationError> {
        let mut previous = None;
        let mut parameters = start;
        loop {
            let halvings = self.simulate(previous.as_ref(), &mut parameters)?;
            let (observations, solution) = self.solve()?;
            if self.converged(&observations, &solution, &parameters, halvings)? {
                return Ok((observations, solution));
            }
            let next = solution.parameters;
            previous = Some(core::mem::replace(&mut parameters, next));
        }
    }

    /// Simulates `parameters`, halving the step from the `previous` ones as long as it fails, and
    /// says how often that was.
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
                return Err(IdentificationError::FirstSimulation { cause });
            };
            let simulations = self.simulations;
            if halvings == MAX_HALVINGS {
                return Err(IdentificationError::NoStep { simulations, halvings, cause });
            }
            self.check_simulations_left()?;
            halvings += 1;
            *parameters = (&*parameters + previous) * 0.5;
        }
    }

    /// Weighted least squares on the motion of the last simulation.
    fn solve(&self) -> Result<(Observations, Solution), IdentificationError> {
        let fit = self.fit;
        let named = |error| IdentificationError::from_regression(error, &fit.selection);
        let matrix = observation_matrix(
            &fit.model,
            &fit.selection,
            self.simulator.motion(),
            &fit.decimation,
            self.experiment.counted(),
        )?;
        let joints = self.experiment.joints();
        let observations = Observations::new(matrix, self.torque.clone(), joints).map_err(named)?;
        let solution = observations.weighted(&fit.noise_levels).map_err(named)?;
        Ok((observations, solution))
    }

    /// Notes the step and says whether it was the last one.
    fn converged(
        &mut self,
        observations: &Observations,
        solution: &Solution,
        simulated: &DVector<f64>,
        halvings: u32,
    ) -> Result<bool, IdentificationError> {
        let relative_error = solution.residuals.norm() / observations.measurements().norm();
        let last = self.steps.last().map(|step| step.relative_error);
        let relative_error_change = last.map(|last| (relative_error - last).abs());
        let deviations = solution.standard_deviations();
        let change = (&solution.parameters - simulated).component_div(&deviations);
        let mover = change.icamax();
        let parameter_change = change[mover].abs();
        self.mover = mover;
        self.steps.push(ConvergenceStep {
            simulation: self.simulations,
            relative_error,
            relative_error_change,
            parameter_change,
            halvings,
        });
        let limits = &self.limits;
        if relative_error_change.is_some_and(|change| change <= limits.relative_error_change)
            && parameter_change <= limits.parameter_change
        {
            return Ok(true);
        }
        self.check_simulations_left()?;
        Ok(false)
    }

    /// Whether another simulation may be run; if not, how far the last step was from the end.
    fn check_simulations_left(&self) -> Result<(), IdentificationError> {
        if self.simulations < self.limits.max_simulations {
            return Ok(());
        }
        let last = self.steps.last();
        Err(IdentificationError::NotConverged {
            simulations: self.simulations,
            relative_error_change: last.and_then(|step| step.relative_error_change),
            parameter_change: last.map_or(f64::INFINITY, |step| step.parameter_change),
            parameter: self.fit.selection.names().get(self.mover).cloned().unwrap_or_default(),
        })
    }
}
