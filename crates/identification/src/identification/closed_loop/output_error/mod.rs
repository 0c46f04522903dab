//! CLIE and CLOE: closed-loop input error and closed-loop output error (paper, section 3.2).

mod damping;
mod descent;
mod iteration;
mod problem;
mod sensitivities;
mod sufficiency;

use super::alignment::torque_of_simulated_samples;
use super::consistent_parameters::ConsistentParameters;
use super::pseudo_linear::{Equation, PseudoLinear};
use super::simulation_error::{position_errors, relative_errors};
use super::simulator::Simulator;
use super::start::start_parameters;
use crate::identification::equation_error::EquationErrorFit;
use crate::identification::judgement::{
    Findings, Identification, Iteration, Output, PositionError, Reason, SingularValues, TorqueRows,
};
use crate::identification::observation::{BaseColumns, torque_equation};
use crate::identification::problem::{Context, IdentificationError, Method};
use descent::{Descent, Linearised};
use problem::Problem;

/// Identifies base parameters by closed-loop input error. The parameters are those for which the
/// torques of the simulated closed loop match the measured torques (equations 18 and 19).
///
/// 1. Simulate the closed loop and its sensitivities ∂τ_s/∂θ with the current estimate θ, along the
///    recorded reference.
/// 2. Filter and decimate the torque error and the sensitivities in the same way.
/// 3. Take a weighted Levenberg–Marquardt or Gauss–Newton step to the next θ.
/// 4. Repeat until the linear step is a small part of the standard deviations. Then renew the
///    weights, and repeat until the weights no longer change.
///
/// If `simulation.bodies` is set, the linear step goes to the nearest physically consistent
/// parameters and is halved instead of damped. The criterion that has to decrease then includes the
/// distance of the bodies from the prior knowledge about them.
///
/// Torques, initial state and reference are aligned as in DIDIM. The gains of the simulated
/// controller are fixed, because the sensitivities belong to one controller.
///
/// # Errors
/// [`IdentificationError`], each variant with its remedy.
pub(crate) fn clie(context: &Context<'_>) -> Result<Identification, IdentificationError> {
    identify(context, Method::Clie, Output::Torque)
}

/// Identifies base parameters by closed-loop output error. The parameters are those for which the
/// positions of the simulated closed loop match the measured positions (equations 16 and 17).
///
/// The method is that of CLIE with joint positions instead of torques. Standard deviations,
/// whiteness and Durbin–Watson statistics are those of the positions' equation. The errors and the
/// fit of the estimate are those of the torques along the simulated motion, so that methods can be
/// compared. The model checks also use these torques: like DIDIM's, they examine the weighted
/// least-squares solution of the torques along the simulated motion, and use its standard
/// deviations.
///
/// # Errors
/// [`IdentificationError`], each variant with its remedy.
pub(crate) fn cloe(context: &Context<'_>) -> Result<Identification, IdentificationError> {
    identify(context, Method::Cloe, Output::Position)
}

fn identify(
    context: &Context<'_>,
    method: Method,
    output: Output,
) -> Result<Identification, IdentificationError> {
    let fit = EquationErrorFit::new(context)?;
    let simulator = Simulator::new(context, &fit, method)?
        .with_gains_for(&fit.weighting.solution.parameters)?;
    let torque = torque_of_simulated_samples(context, simulator.timing())?;
    let equation = Equation::Simulated { torque: torque.clone() };
    let consistent_parameters = ConsistentParameters::new(context, &fit)?;
    let body_list = consistent_parameters.as_ref();
    let mut approach = PseudoLinear::new(context, &fit, equation, body_list, simulator);
    let (start, before) = approach.steps_from(
        start_parameters(context, &fit, body_list)?,
        context.options.simulation.didim_steps,
    )?;
    let measured = match output {
        Output::Torque => torque.clone(),
        Output::Position => context.rows_of(context.experiment.position_rad(), "position")?,
    };
    let PseudoLinear { simulations, mut simulator, .. } = approach;
    // The inertia that was added to the start parameters is part of this arm.
    let (start, before) = (
        simulator.simulated_parameters(&start),
        before.map(|before| simulator.simulated_parameters(&before)),
    );
    simulator.add_nothing();
    let mut problem = Problem { output, context, fit: &fit, measured, simulations, simulator };
    let optimum = Descent::new(&mut problem, body_list).run(start, before.as_ref())?;

    let named = |error| context.selection.regression_failure(error);
    let Linearised { point, observations, solution, .. } = &optimum.linearisation;
    let context = &context.with_final_loads(&solution.parameters);
    let unweighted = SingularValues::new(&observations.solve_ordinary().map_err(named)?);
    let BaseColumns { selected, auxiliary } = BaseColumns::new(context, &point.motion)?;
    let joints = context.robot.joints();
    let above_noise = sufficiency::above_noise_reason(context, &fit, &(&torque - &point.torque));
    let torque_error_per_joint = relative_errors(joints, &torque, &point.torque);
    let torque_equation = torque_equation(context, selected, torque, &point.motion)?;
    let (torque_residuals, own) = match output {
        Output::Torque => (solution.residuals.clone(), None),
        Output::Position => {
            let levels = torque_equation
                .noise_levels(&torque_equation.solve_ordinary().map_err(named)?.residuals);
            let levels_of_equation = torque_equation.solve_weighted(&levels).map_err(named)?;
            (torque_equation.residuals(&solution.parameters), Some(levels_of_equation))
        }
    };
    let findings = Findings {
        method,
        motion: &point.motion,
        auxiliary_columns: &auxiliary,
        position_error: PositionError::NotInspected,
        observations,
        torque: Some(TorqueRows {
            observations: &torque_equation,
            residuals: &torque_residuals,
            own: own.as_ref(),
        }),
        solution,
        unweighted,
        downweighted: None,
        outliers: Vec::new(),
        iteration: Iteration {
            linear_steps: optimum.linear_steps,
            simulations: problem.simulations,
            steps: optimum.steps.clone(),
            reference: Some(problem.simulator.reference_source()),
            slower_bandwidth_hz: problem.simulator.slower_bandwidth_hz(),
            position_error_per_joint: Some(position_errors(context, &point.motion)?),
            torque_error_per_joint: Some(torque_error_per_joint),
            instrument_correlation: None,
        },
    };
    let outcome = findings.judged(context)?;
    Ok(with_sufficiency(context, output, &fit, above_noise, outcome))
}

/// Adds reasons to the verdict if the output error exceeds the noise or the output is insensitive
/// to the parameters.
fn with_sufficiency(
    context: &Context<'_>,
    output: Output,
    fit: &EquationErrorFit,
    above_noise: Option<Reason>,
    mut outcome: Identification,
) -> Identification {
    let insensitive = sufficiency::insensitivity_reason(context, output, &outcome.estimate, fit);
    let mut reasons = [above_noise, insensitive];
    // Torque errors enlarge the standard deviations of CLIE, so the noise is reported first. The
    // standard deviations of CLOE are those of positions: if these do not determine the parameters,
    // torque errors follow, so insensitivity is reported first.
    if output == Output::Position {
        reasons.reverse();
    }
    outcome.estimate.verdict = outcome
        .estimate
        .verdict
        .with_reasons(&context.options.required_uses, reasons.into_iter().flatten());
    outcome
}
