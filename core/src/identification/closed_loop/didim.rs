//! DIDIM: direct and inverse dynamic identification models (paper, section 3.3).

use super::iteration::{Converged, Equation, Iteration};
use super::{alignment, controller_check, position_noise, start};
use crate::dynamics::BaseParameters;
use crate::identification::closed_loop::simulator::Simulator;
use crate::identification::equation_error::idim_ls::EquationErrorFit;
use crate::identification::equation_error::weighting::Weighting;
use crate::identification::given::error::IdentificationError;
use crate::identification::given::experiment::Experiment;
use crate::identification::given::method::Method;
use crate::identification::given::simulation::DidimOptions;
use crate::identification::judgement::assemble::Findings;
use crate::identification::judgement::checks::PositionError;
use crate::identification::judgement::estimate::Identification;
use crate::identification::judgement::simulation_error::SimulationErrors;
use crate::identification::observation::matrix::BaseColumns;
use crate::robot::Robot;

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
/// equation error (see [`idim_ls`](crate::identification::idim_ls())) through all iterations, since residuals of a
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
    let decimation = options.regression.decimation(options.decimated)?;
    let fit = EquationErrorFit::new(robot, base, experiment, &options.regression, decimation)?;
    let timing = options.controller.timing();
    let torque = alignment::torque_of_simulated_samples(experiment, timing, &fit.decimation)?;
    let simulator = Simulator::new(robot, &fit, experiment, options.loop_options())?;
    let equation = Equation::Simulated { torque };
    let mut iteration = Iteration::new(experiment, &fit, equation, simulator, options.convergence);
    let start = start::parameters(options.start, robot, base, &fit)?;
    let Converged { simulated, observations, solution: last } = iteration.run(start)?;

    let named = |error| IdentificationError::from_regression(error, &fit.selection);
    let noise_levels = observations.noise_levels(&last.residuals);
    let weighting = Weighting::new(&observations, &noise_levels, fit.robust).map_err(named)?;
    let solution = &weighting.solution;
    let spoiled = fit.spoiled(experiment, Some(&weighting));
    let unweighted = observations.ordinary().map_err(named)?;
    let noisy = position_noise::noisy_torques(
        robot,
        experiment,
        &options.regression.position_filter,
        &iteration,
        &solution.parameters,
        &spoiled,
    )?;
    let motion = iteration.motion();
    let BaseColumns { beside, .. } =
        BaseColumns::new(&fit.model, base, &fit.selection, motion, &fit.decimation, experiment)?;
    let simulated = observations.matrix() * simulated;
    let torques = Some((observations.measurements(), &simulated));
    let simulation_errors = SimulationErrors::new(experiment, &fit.decimation, motion, torques)?;
    let controller_error = controller_check::controller_error(
        experiment,
        &options.controller,
        iteration.reference_signal(),
        &fit.decimation,
        &spoiled,
    )?;
    let findings = Findings {
        method: Method::Didim,
        robot,
        experiment,
        model: &fit.model,
        selection: &fit.selection,
        decimation: &fit.decimation,
        motion,
        beside: &beside,
        position_error: noisy.map_or(PositionError::Unknown, PositionError::InTheLoop),
        observations: weighting.solved(&observations),
        torque: weighting.torque_rows(&observations),
        solution,
        downweighted: weighting.downweighted(),
        spoiled,
        unweighted: &unweighted,
        iterations: iteration.least_squares_steps() + 1,
        simulations: iteration.simulations(),
        convergence: iteration.steps().to_vec(),
        reference: Some(iteration.reference()),
        simulation_errors: Some(simulation_errors),
        controller_error_per_joint: controller_error,
        limits: &options.regression.limits,
        instrument_correlation: None,
        reasons: Vec::new(),
    };
    findings.assemble()
}
