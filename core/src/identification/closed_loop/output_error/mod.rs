//! CLIE and CLOE: closed-loop input error and closed-loop output error (paper, section 3.2).

mod damping;
mod iteration;
mod options;
mod problem;
mod rows;
mod step;
mod validate;

pub use options::{Optimiser, OutputErrorOptions, SensitivityMethod};

use nalgebra::DVector;

use super::controller_check::controller_error;
use super::iteration::{self as didim, Equation};
use super::{alignment, start};
use crate::dynamics::BaseParameters;
use crate::identification::closed_loop::simulator::Simulator;
use crate::identification::equation_error::idim_ls::EquationErrorFit;
use crate::identification::given::error::{Failure, IdentificationError};
use crate::identification::given::experiment::Experiment;
use crate::identification::judgement::assemble::{Findings, TorqueRows};
use crate::identification::judgement::checks::PositionError;
use crate::identification::judgement::estimate::{Estimate, Identification};
use crate::identification::judgement::simulation_error::SimulationErrors;
use crate::identification::observation::matrix::BaseColumns;
use crate::regression::Observations;
use crate::robot::Robot;
use iteration::Iteration;
use problem::{Output, Problem};
use rows::Rows;

/// Torque errors of more than so many times the noise of the equation error are not noise.
const MAX_NOISE_RATIO: f64 = 3.0;

/// Parameters that are more than so many standard deviations of IDIM-LS from zero must be known,
const TOLD_FROM_ZERO: f64 = 3.0;
/// half of them better than this, relative to their size,
const MAX_MEDIAN_DEVIATION: f64 = 0.1;
/// where IDIM-LS knows half of them better by more than this factor: a motion that tells it no more
/// either is no fault of the criterion.
const MAX_MEDIAN_LOSS: f64 = 3.0;

/// Identifies base parameters by closed-loop input error: the parameters whose simulated closed
/// loop has the measured torques (equations 18 and 19).
///
/// 1. Simulate the closed loop with the current estimate θ, along the recorded reference, and its
///    sensitivities ∂τ_s/∂θ with it.
/// 2. Filter and decimate the error of the torque and the sensitivities alike.
/// 3. A weighted Levenberg–Marquardt or Gauss–Newton step gives the next θ.
/// 4. Repeat until the linear step is a small part of the standard deviations; renew the weights,
///    and repeat until they stay.
///
/// Torques are aligned as in [`didim`](crate::identification::didim()), and so are initial state and reference. The
/// gains of the simulated controller are fixed: the sensitivities belong to one controller.
///
/// # Errors
/// [`IdentificationError`], each variant with its remedy.
pub fn clie(
    robot: &Robot,
    base: &BaseParameters,
    experiment: &Experiment,
    options: &OutputErrorOptions,
) -> Result<Identification, IdentificationError> {
    identify(Output::Torque, robot, base, experiment, options)
}

/// Identifies base parameters by closed-loop output error: the parameters whose simulated closed
/// loop has the measured positions (equations 16 and 17).
///
/// As [`clie`], with the error of the joint positions in place of that of the torques. Standard
/// deviations, whiteness and Durbin–Watson statistics are those of the positions' equation. The
/// errors of the estimate, and its fit, are those of the torques along the simulated motion, so that
/// methods can be compared. So are the checks of the model: as DIDIM's, on the weighted least squares
/// solution of the torques along that motion, and in its standard deviations.
///
/// # Errors
/// [`IdentificationError`], each variant with its remedy.
pub fn cloe(
    robot: &Robot,
    base: &BaseParameters,
    experiment: &Experiment,
    options: &OutputErrorOptions,
) -> Result<Identification, IdentificationError> {
    identify(Output::Position, robot, base, experiment, options)
}

fn identify(
    output: Output,
    robot: &Robot,
    base: &BaseParameters,
    experiment: &Experiment,
    options: &OutputErrorOptions,
) -> Result<Identification, IdentificationError> {
    options.validate_iteration()?;
    let decimation = options.regression.decimation(options.decimated)?;
    options.regression.validate_robust(output.method())?;
    let fit = EquationErrorFit::new(robot, base, experiment, &options.regression, decimation)?;
    let timing = options.controller.timing();
    let torque = alignment::torque_of_simulated_samples(experiment, timing, &fit.decimation)?;
    let simulator = Simulator::new(robot, &fit, experiment, options.loop_options())?
        .with_gains_for(&fit.weighted.solution.parameters)?;
    let start = start::parameters(options.start, robot, base, &fit)?;
    let equation = Equation::Simulated { torque: torque.clone() };
    let mut approach =
        didim::Iteration::new(experiment, &fit, equation, simulator, options.convergence);
    let (start, before) = approach.steps_from(start, options.didim_steps)?;
    let rows = Rows::new(experiment, &fit.decimation);
    let measured = match output {
        Output::Torque => torque.clone(),
        Output::Position => rows.of_signals(experiment.position_rad(), "position")?,
    };
    let mut problem = Problem {
        output,
        fit: &fit,
        rows,
        measured,
        method: options.sensitivities,
        simulations: approach.simulations(),
        simulator: approach.into_simulator(),
    };
    let optimum = Iteration::new(&mut problem, options.optimiser, options.convergence)
        .run(start, before.as_ref())?;

    let named = |error| IdentificationError::from_regression(error, &fit.selection);
    let unweighted = optimum.observations.ordinary().map_err(named)?;
    let motion = &optimum.point.motion;
    let BaseColumns { selected: regressor, beside } =
        BaseColumns::new(&fit.model, base, &fit.selection, motion, &fit.decimation, experiment)?;
    let ratio = noise_ratio(&fit, &(&torque - &optimum.point.torque));
    let torques = Some((&torque, &optimum.point.torque));
    let simulation_errors = SimulationErrors::new(experiment, &fit.decimation, motion, torques)?;
    let along = Observations::new(regressor, torque, robot.joints()).map_err(named)?;
    let (torque_residuals, own) = match output {
        Output::Torque => (optimum.solution.residuals.clone(), None),
        Output::Position => {
            let levels = along.noise_levels(&along.ordinary().map_err(named)?.residuals);
            let own = along.weighted(&levels).map_err(named)?;
            (along.residuals(&optimum.solution.parameters), Some(own))
        }
    };
    let controller_error = controller_error(
        experiment,
        &options.controller,
        problem.simulator.reference(),
        &fit.decimation,
        &[],
    )?;
    let findings = Findings {
        method: output.method(),
        robot,
        experiment,
        model: &fit.model,
        selection: &fit.selection,
        decimation: &fit.decimation,
        motion,
        beside: &beside,
        position_error: PositionError::NotLookedAt,
        observations: &optimum.observations,
        torque: Some(TorqueRows {
            observations: &along,
            residuals: &torque_residuals,
            own: own.as_ref(),
        }),
        solution: &optimum.solution,
        downweighted: None,
        spoiled: Vec::new(),
        unweighted: &unweighted,
        iterations: optimum.linear_steps,
        simulations: problem.simulations,
        convergence: optimum.steps,
        reference: Some(problem.simulator.source()),
        simulation_errors: Some(simulation_errors),
        controller_error_per_joint: controller_error,
        limits: &options.regression.limits,
        instrument_correlation: None,
        reasons: Vec::new(),
    };
    let mut found = findings.assemble()?;
    let mut failures = [above_noise(ratio), insensitive(output, &found.estimate, &fit)];
    // Torques that are off make the standard deviations of CLIE large; those of CLOE are of positions,
    // and where they do not say what the parameters are, torques are off.
    if output == Output::Position {
        failures.reverse();
    }
    for (failure, reason) in failures.into_iter().flatten() {
        found.estimate.verdict.fail(failure, reason);
    }
    Ok(found)
}

/// How large the torque errors are, in the noise levels of the equation error:
/// √(Σ ‖ρ_j‖²/σ_j² / (r − b)), about 1 where both models are right.
fn noise_ratio(fit: &EquationErrorFit, residuals: &DVector<f64>) -> f64 {
    let rows = residuals.len() / fit.noise_levels.len();
    let joints = residuals.as_slice().chunks(rows).zip(&fit.noise_levels);
    let sum: f64 =
        joints.map(|(rho, level)| rho.iter().map(|r| (r / level).powi(2)).sum::<f64>()).sum();
    (sum / (residuals.len() - fit.selection.names().len()) as f64).sqrt()
}

/// A minimum that leaves more than the noise is not that of the arm's parameters.
fn above_noise(ratio: f64) -> Option<(Failure, String)> {
    let noise = ratio <= MAX_NOISE_RATIO;
    (!noise).then(|| {
        let reason = format!(
            "the simulated torques are off by {ratio:.1} times the noise of IDIM-LS: a local \
             minimum, or a loop that is not the arm's; choose another start, and check reference \
             and controller"
        );
        (Failure::LocalMinimum, reason)
    })
}

/// A criterion that hardly depends on the parameters has not said what they are, although the record
/// tells (section 4.3). Of the parameters that IDIM-LS tells from zero, half are uncertain by too much of
/// their size, and half by more than a record that IDIM-LS knows them from asks for.
fn insensitive(
    output: Output,
    estimate: &Estimate,
    fit: &EquationErrorFit,
) -> Option<(Failure, String)> {
    let weighted = &fit.weighted.solution;
    let uncertainties = fit.standard_deviations();
    let known = (weighted.parameters.iter())
        .zip(uncertainties.iter())
        .zip(&estimate.parameters)
        .filter(|((value, sd), _)| value.abs() > TOLD_FROM_ZERO * **sd);
    let (deviations, losses): (Vec<f64>, Vec<f64>) = known
        .map(|((value, sd), found)| {
            (found.standard_deviation / value.abs(), found.standard_deviation / sd)
        })
        .unzip();
    let (deviation, loss) = (median(deviations)?, median(losses)?);
    let determined = deviation <= MAX_MEDIAN_DEVIATION || loss <= MAX_MEDIAN_LOSS;
    let (signal, remedy) = match output {
        Output::Position => ("positions", "identify from the torques (clie)"),
        Output::Torque => ("torques", "identify from the measured motion (idim-ls)"),
    };
    (!determined).then(|| {
        let reason = format!(
            "the simulated {signal} hardly depend on the parameters, half of which stay uncertain by \
             more than {:.0} %, and by {loss:.0} times what IDIM-LS leaves (smallest singular value \
             {:.1e}): {remedy}",
            100.0 * deviation,
            estimate.singular_values.min
        );
        (Failure::Insensitive, reason)
    })
}

/// The upper median; none of none.
fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}
