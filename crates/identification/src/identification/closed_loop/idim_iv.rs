//! IDIM-IV: the inverse dynamic identification model and instrumental variables.

use super::alignment::torque_of_simulated_samples;
use super::instruments::Instruments;
use super::pseudo_linear::{Converged, Equation, PseudoLinear};
use super::simulation_error::relative_errors;
use super::simulator::Simulator;
use super::start::start_parameters;
use crate::identification::equation_error::EquationErrorFit;
use crate::identification::judgement::{
    Findings, Identification, Iteration, PositionError, Reason, SingularValues, TorqueRows,
};
use crate::identification::observation::{fitted_matrix, torque_equation};
use crate::identification::problem::{Context, IdentificationError, Method};

/// Identifies base parameters from the inverse dynamic model of the measured motion, with the
/// regressor of the simulated motion as instruments (Janot, Vandanjon & Gautier, *A generic
/// instrumental variable approach for industrial robot identification*, IEEE Trans. Control Syst.
/// Technol. 22, 2014).
///
/// 1. Simulate the closed loop with the current estimate θ, along the recorded reference.
/// 2. Build the instruments Z: the observation matrix on the simulated motion.
/// 3. θ = (ZᵀΩ⁻¹X)⁻¹ ZᵀΩ⁻¹y with X and y of IDIM-LS. The simulated motion has
///    none of the noise of the measured one, so that the noise in X, which biases least squares
///    (equation 13 does not hold in a closed loop), does not bias θ.
/// 4. Repeat until the estimates converge. Then renew the weights from the residuals, and solve
///    again.
///
/// Z has to be correlated with X but not with the noise. It need not be exact, so a poor model of
/// the controller makes the estimate less certain but not biased.
///
/// # Errors
/// [`IdentificationError`], each variant with its remedy.
pub(crate) fn idim_iv(context: &Context<'_>) -> Result<Identification, IdentificationError> {
    let (fit, auxiliary) = EquationErrorFit::with_auxiliary(context)?;
    let simulator = Simulator::new(context, &fit, Method::IdimIv)?;
    let timing = simulator.timing();
    let mut loops = PseudoLinear::new(context, &fit, Equation::Instrumented, None, simulator);
    let Converged { simulated_parameters: simulated, solution: last, .. } =
        loops.run(start_parameters(context, &fit, None)?)?;

    let named = |error| context.selection.regression_failure(error);
    // The last equation uses the loads of the final estimate.
    let judged = context.with_final_loads(&last.parameters);
    let settled = judged.model.feels_loads().then(|| EquationErrorFit::with_auxiliary(&judged));
    let settled = settled.transpose()?;
    let (fit, auxiliary_columns) = settled
        .as_ref()
        .map_or((&fit, &auxiliary), |(fit, auxiliary_columns)| (fit, auxiliary_columns));
    let levels = fit.observations.noise_levels(&last.residuals);
    let matrix = fitted_matrix(&judged, loops.simulator.motion())?;
    let torque_error_per_joint = match torque_of_simulated_samples(context, timing) {
        Ok(measured) => {
            let (simulator, matrix) = (&loops.simulator, matrix.clone());
            let equation = torque_equation(context, matrix, measured, simulator.motion())?;
            let predicted = equation.predicted(&simulator.simulated_parameters(&simulated));
            Some(relative_errors(context.robot.joints(), &equation.measured_values(), &predicted))
        }
        // Instruments need not be exact, so a different delay is not an error here.
        Err(IdentificationError::TorqueDelay { .. }) => None,
        Err(error) => return Err(error),
    };
    let instruments =
        Instruments::new(&fit.observations, &matrix.dense(), &levels, &context.selection)?;
    let solution = instruments.solve(&fit.observations, &levels).map_err(named)?;
    let unweighted =
        SingularValues::new(&instruments.projected_equation.solve_ordinary().map_err(named)?);
    let correlation = instruments.smallest_correlation;
    // The nuisance parameters are not projected on the instruments: they belong to this equation.
    let own = fit.observations.solve_weighted(&levels).map_err(named)?;
    let findings = Findings {
        method: Method::IdimIv,
        motion: &fit.motion,
        auxiliary_columns,
        position_error: PositionError::InTheRegressor,
        observations: &instruments.projected_equation,
        torque: Some(TorqueRows {
            observations: &fit.observations,
            residuals: &solution.residuals,
            own: Some(&own),
        }),
        solution: &solution,
        unweighted,
        downweighted: None,
        outliers: Vec::new(),
        iteration: Iteration {
            torque_error_per_joint,
            instrument_correlation: Some(correlation),
            ..loops.iteration_record()?
        },
    };
    let mut outcome = findings.judged(&judged)?;
    // A correlation of NaN also counts as weak.
    let strong = correlation >= context.options.closed_loop_limits.instrument_correlation;
    let weak = (!strong).then_some(Reason::WeakInstruments { correlation });
    outcome.estimate.verdict =
        outcome.estimate.verdict.with_reasons(&context.options.required_uses, weak);
    Ok(outcome)
}
