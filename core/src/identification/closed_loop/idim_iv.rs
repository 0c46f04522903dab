//! IDIM-IV: the inverse dynamic identification model and instrumental variables.

use super::iteration::{Converged, Equation, Iteration};
use super::{alignment, start};
use crate::dynamics::BaseParameters;
use crate::identification::closed_loop::instruments::Instruments;
use crate::identification::closed_loop::simulator::Simulator;
use crate::identification::equation_error::idim_ls::EquationErrorFit;
use crate::identification::given::error::IdentificationError;
use crate::identification::given::experiment::Experiment;
use crate::identification::given::method::Method;
use crate::identification::given::simulation::DidimOptions;
use crate::identification::judgement::assemble::{Findings, TorqueRows};
use crate::identification::judgement::checks::PositionError;
use crate::identification::judgement::estimate::Identification;
use crate::identification::judgement::simulation_error::SimulationErrors;
use crate::identification::observation::matrix::observation_matrix;
use crate::robot::Robot;

/// Instruments that are correlated with their columns by less do not carry an estimate.
const LEAST_CORRELATION: f64 = 0.5;

/// Identifies base parameters from the inverse dynamic model of the measured motion, with the
/// regressor of the simulated motion as instruments (Janot, Vandanjon & Gautier, *A generic
/// instrumental variable approach for industrial robot identification*, IEEE Trans. Control Syst.
/// Technol. 22, 2014).
///
/// 1. Simulate the closed loop with the current estimate θ, along the recorded reference.
/// 2. Build the instruments Z: the observation matrix on the simulated motion.
/// 3. θ = (ZᵀΩ⁻¹X)⁻¹ ZᵀΩ⁻¹y with X and y of [`idim_ls`](crate::identification::idim_ls()). The simulated motion has
///    none of the noise of the measured one, so that the noise in X, which biases least squares
///    (equation 13 does not hold in a closed loop), does not bias θ.
/// 4. Repeat until the estimates stand still; renew the weights from the residuals, and solve once
///    more.
///
/// Z has to be correlated with X and not with the noise: it need not be exact, so that a poor
/// controller makes the estimate less certain, not wrong.
///
/// # Errors
/// [`IdentificationError`], each variant with its remedy.
pub fn idim_iv(
    robot: &Robot,
    base: &BaseParameters,
    experiment: &Experiment,
    options: &DidimOptions,
) -> Result<Identification, IdentificationError> {
    options.convergence.validate()?;
    let decimation = options.regression.decimation(options.decimated)?;
    options.regression.validate_robust(Method::IdimIv)?;
    let (fit, beside) =
        EquationErrorFit::with_beside(robot, base, experiment, &options.regression, decimation)?;
    let simulator = Simulator::new(robot, &fit, experiment, options.loop_options())?;
    let start = start::parameters(options.start, robot, base, &fit)?;
    let equation = Equation::Instrumented;
    let mut iteration = Iteration::new(experiment, &fit, equation, simulator, options.convergence);
    let Converged { simulated, solution: last, .. } = iteration.run(start)?;

    let named = |error| IdentificationError::from_regression(error, &fit.selection);
    let levels = fit.observations.noise_levels(&last.residuals);
    let (counted, motion) = (experiment.counted(), iteration.motion());
    let instruments =
        observation_matrix(&fit.model, &fit.selection, motion, &fit.decimation, counted)?;
    let instruments = experiment.fitted_matrix(&fit.decimation, instruments);
    let timing = options.controller.timing();
    let torque = match alignment::torque_of_simulated_samples(experiment, timing, &fit.decimation) {
        Ok(measured) => Some((measured, &instruments * simulated)),
        // Instruments need not be exact, so that this is no reason to refuse.
        Err(IdentificationError::TorqueDelay { .. }) => None,
        Err(error) => return Err(error),
    };
    let torque = torque.as_ref().map(|(measured, simulated)| (measured, simulated));
    let simulation_errors = SimulationErrors::new(experiment, &fit.decimation, motion, torque)?;
    let instruments = Instruments::new(&fit.observations, &instruments, &levels, &fit.selection)?;
    let solution = instruments.solve(&fit.observations, &levels).map_err(named)?;
    let unweighted = instruments.projected.ordinary().map_err(named)?;
    let correlation = instruments.smallest_correlation;
    let findings = Findings {
        method: Method::IdimIv,
        robot,
        experiment,
        model: &fit.model,
        selection: &fit.selection,
        decimation: &fit.decimation,
        motion: &fit.motion,
        beside: &beside,
        position_error: PositionError::InTheRegressor(options.regression.position_filter),
        observations: &instruments.projected,
        torque: Some(TorqueRows {
            observations: &fit.observations,
            residuals: &solution.residuals,
            own: None,
        }),
        solution: &solution,
        downweighted: None,
        spoiled: Vec::new(),
        unweighted: &unweighted,
        iterations: iteration.least_squares_steps() + 1,
        simulations: iteration.simulations(),
        convergence: iteration.steps().to_vec(),
        reference: Some(iteration.reference()),
        simulation_errors: Some(simulation_errors),
        controller_error_per_joint: None,
        limits: &options.regression.limits,
        instrument_correlation: Some(correlation),
        reasons: weak(correlation).into_iter().collect(),
    };
    findings.assemble()
}

/// Instruments that say too little of the measured motion.
fn weak(correlation: f64) -> Option<String> {
    let strong = correlation >= LEAST_CORRELATION;
    (!strong).then(|| {
        format!(
            "a combination of parameters has instruments with a correlation of {correlation:.2} \
             only: the simulated motion is not the measured one; check reference and controller"
        )
    })
}
