//! DIDIM: direct and inverse dynamic identification models (paper, section 3.3).

use super::alignment::torque_of_simulated_samples;
use super::consistent_parameters::ConsistentParameters;
use super::position_noise::noisy_torques;
use super::pseudo_linear::{Converged, Equation, PseudoLinear, restrict_to_consistent};
use super::simulation_error::relative_errors;
use super::simulator::Simulator;
use super::start::start_parameters;
use crate::identification::equation_error::{EquationErrorFit, Weighting};
use crate::identification::judgement::{
    Findings, Identification, Iteration, PositionError, SingularValues,
};
use crate::identification::observation::BaseColumns;
use crate::identification::problem::{Context, IdentificationError, Method};

/// Identifies base parameters from the torques alone, with the motion of the simulated closed loop
/// in place of the measured one.
///
/// 1. Simulate the closed loop with the current estimate θ, along the recorded reference.
/// 2. Build the regressor φ on the **simulated** positions, velocities and accelerations. With the
///    dependence of the simulated motion on θ neglected (pseudo-linear regression), φ is the
///    sensitivity of the simulated torque (equation 20).
/// 3. Filter and decimate regressor and measured torque alike; weighted least squares gives the
///    next θ. A step whose parameters cannot be simulated is halved.
/// 4. Repeat until the estimates converge.
///
/// Measured positions determine only the initial state and the weights. The noise levels σ_j are
/// those of the equation error (see IDIM-LS) in all iterations, because the residuals along a
/// motion far from the real one would give too little weight to the joints with the largest error.
/// After convergence the weights are renewed once from the residuals, and the last equation is
/// solved again. If `simulation.bodies` is set, each solution is moved to the nearest physically
/// consistent one.
///
/// # Errors
/// [`IdentificationError`], each variant with its remedy.
pub(crate) fn didim(context: &Context<'_>) -> Result<Identification, IdentificationError> {
    let fit = EquationErrorFit::new(context)?;
    let simulator = Simulator::new(context, &fit, Method::Didim)?;
    let torque = torque_of_simulated_samples(context, simulator.timing())?;
    let consistent_parameters = ConsistentParameters::new(context, &fit)?;
    let body_list = consistent_parameters.as_ref();
    let equation = Equation::Simulated { torque };
    let mut loops = PseudoLinear::new(context, &fit, equation, body_list, simulator);
    let Converged { simulated_parameters: simulated, observations, solution: last } =
        loops.run(start_parameters(context, &fit, body_list)?)?;

    let named = |error| context.selection.regression_failure(error);
    let noise_levels = observations.noise_levels(&last.residuals);
    let weighting =
        Weighting::new(&observations, &noise_levels, context.options.robust).map_err(named)?;
    let weighting = restrict_to_consistent(weighting, &observations, body_list)?;
    let solution = &weighting.solution;
    let judged = context.with_final_loads(&solution.parameters);
    let outliers = fit.outlier_samples(context, Some(&weighting));
    let unweighted = SingularValues::new(&observations.solve_ordinary().map_err(named)?);
    let simulator = &loops.simulator;
    let noisy = noisy_torques(context, simulator, &solution.parameters, &outliers)?;
    let motion = simulator.motion();
    let BaseColumns { auxiliary, .. } = BaseColumns::new(&judged, motion)?;
    let torque_error_per_joint = relative_errors(
        context.robot.joints(),
        &observations.measured_values(),
        &observations.predicted(&simulator.simulated_parameters(&simulated)),
    );
    let findings = Findings {
        method: Method::Didim,
        motion,
        auxiliary_columns: &auxiliary,
        position_error: noisy.map_or(PositionError::Unknown, PositionError::InTheLoop),
        observations: weighting.solved_equation(&observations),
        torque: weighting.torque_rows(&observations),
        solution,
        unweighted,
        downweighted: weighting.downweighted_rows(),
        iteration: Iteration {
            torque_error_per_joint: Some(torque_error_per_joint),
            ..loops.iteration_record()?
        },
        outliers,
    };
    findings.judged(&judged)
}
