//! Simulated rows and their sensitivities as functions of the parameters.

use nalgebra::{DMatrix, DVector};

use super::sensitivities::SensitivitySignals;
use crate::identification::closed_loop::simulator::Simulator;
use crate::identification::equation_error::EquationErrorFit;
use crate::identification::judgement::Output;
use crate::identification::observation::Motion;
use crate::identification::problem::{
    Context, IdentificationError, IterationError, SensitivityMethod,
};
use crate::regression::{Observations, RegressionError};
use didim_dynamics::numeric::WIDTH;
use didim_dynamics::simulation::{SimulationError, set_row};

/// Relative step of a parameter for finite differences. The relative error of the derivative is
/// about 1e-11 divided by the step due to rounding, and about the step itself due to curvature.
const DIFFERENCE_STEP: f64 = 1e-6;

/// Number of simulations for differences that run in parallel.
const PARALLEL_SIMULATIONS: usize = WIDTH;

/// One simulation and its results.
pub(super) struct Point {
    pub(super) parameters: DVector<f64>,
    pub(super) motion: Motion,
    /// Rows of both simulated outputs.
    pub(super) torque: DVector<f64>,
    position: DVector<f64>,
    /// Ψ of the minimised output; `None` until it has been computed.
    jacobian: Option<DMatrix<f64>>,
}

impl Point {
    fn simulated_signal(&self, output: Output) -> &DVector<f64> {
        match output {
            Output::Torque => &self.torque,
            Output::Position => &self.position,
        }
    }
}

/// Measurements, and the simulated loop that has to reproduce them.
pub(super) struct Problem<'a> {
    pub(super) output: Output,
    pub(super) context: &'a Context<'a>,
    pub(super) fit: &'a EquationErrorFit,
    /// Measured rows of the output.
    pub(super) measured: DVector<f64>,
    pub(super) simulator: Simulator<'a>,
    /// Number of closed-loop simulations, including failed ones and those for differences.
    pub(super) simulations: u32,
}

impl Problem<'_> {
    /// Simulates once, with exact sensitivities if requested.
    ///
    /// # Errors
    /// The outer result is an error that no other parameters would avoid; the inner one is a
    /// simulation that ended early.
    pub(super) fn simulate(
        &mut self,
        parameters: &DVector<f64>,
    ) -> Result<Result<Point, SimulationError>, IdentificationError> {
        self.run(parameters, self.is_exact())
    }

    /// Returns true if simulations include exact sensitivities.
    pub(super) fn is_exact(&self) -> bool {
        self.context.options.simulation.sensitivities == SensitivityMethod::Exact
    }

    /// Simulates once without sensitivities, which takes a fraction of the time.
    pub(super) fn simulate_output(
        &mut self,
        parameters: &DVector<f64>,
    ) -> Result<Result<Point, SimulationError>, IdentificationError> {
        self.run(parameters, false)
    }

    fn run(
        &mut self,
        parameters: &DVector<f64>,
        exact: bool,
    ) -> Result<Result<Point, SimulationError>, IdentificationError> {
        self.simulations += 1;
        let columns = self.context.selection.columns();
        let mut loops = self.simulator.closed_loops(parameters)?;
        let mut motion = self.simulator.motion().clone();
        let (samples, joints) = motion.position.shape();
        let mut torque = DMatrix::zeros(samples, joints);
        let mut signals = exact.then(|| SensitivitySignals::new(samples, joints, columns.len()));
        if exact {
            let varied = loops.into_iter().map(|one| one.with_sensitivities(columns));
            loops = varied.collect::<Result<_, _>>().map_err(IdentificationError::Setup)?;
        }
        let output = self.output;
        let done = self.simulator.for_each_sample(&mut loops, |k, sample, sensitivities| {
            motion.set(k, sample);
            set_row(&mut torque, k, &sample.true_torque_nm);
            if let (Some(signals), Some(found)) = (&mut signals, sensitivities) {
                signals.set(
                    k,
                    match output {
                        Output::Torque => found.torque,
                        Output::Position => found.position,
                    },
                );
            }
        });
        if let Err(error) = done {
            return Ok(Err(error));
        }
        let jacobian = signals.map(|signals| signals.rows(self.context)).transpose()?;
        Ok(Ok(Point {
            parameters: parameters.clone(),
            torque: self.context.rows_of(&torque, signal_name(Output::Torque))?,
            position: self.context.rows_of(&motion.position, signal_name(Output::Position))?,
            motion,
            jacobian,
        }))
    }

    /// Returns the linear equation around a point, `y − y_s + Ψ θ_s = Ψ θ + ε` (equations 17 and 19
    /// with Δθ = θ − θ_s).
    ///
    /// # Errors
    /// The inner result is the error of a simulation for a difference that ended early.
    pub(super) fn linearise(
        &mut self,
        point: &mut Point,
    ) -> Result<Result<Observations, SimulationError>, IdentificationError> {
        let jacobian = match point.jacobian.take() {
            Some(jacobian) => jacobian,
            None => match self.difference_sensitivities(point)? {
                Ok(jacobian) => jacobian,
                Err(error) => return Ok(Err(error)),
            },
        };
        point.jacobian = Some(jacobian.clone());
        let equation = self.residuals(point) + &jacobian * &point.parameters;
        let named = |error| self.regression_failure(error);
        let joints = self.context.robot.joints();
        Observations::new(jacobian, equation, joints).map(Ok).map_err(named)
    }

    /// Returns `(y_s(θ + h) − y_s(θ)) / h`, one column per parameter.
    fn difference_sensitivities(
        &mut self,
        point: &Point,
    ) -> Result<Result<DMatrix<f64>, SimulationError>, IdentificationError> {
        let base = point.simulated_signal(self.output).clone();
        let deviations = self.fit.weighting.solution.standard_deviations();
        let mut jacobian = DMatrix::zeros(base.len(), point.parameters.len());
        let (samples, joints) = point.motion.position.shape();
        let output = self.output;
        let columns: Vec<usize> = (0..point.parameters.len()).collect();
        // The chunk size limits the memory of the simulated signals.
        for columns in columns.chunks(PARALLEL_SIMULATIONS) {
            let mut steps = [0.0; PARALLEL_SIMULATIONS];
            let mut loops = Vec::with_capacity(PARALLEL_SIMULATIONS);
            for (h, &k) in steps.iter_mut().zip(columns) {
                let mut perturbed = point.parameters.clone();
                // The step of a parameter with value 0 is relative to its standard deviation.
                perturbed[k] += DIFFERENCE_STEP * point.parameters[k].abs().max(deviations[k]);
                *h = perturbed[k] - point.parameters[k];
                loops.push(self.simulator.closed_loops(&perturbed)?);
            }
            self.simulations += u32::try_from(columns.len()).unwrap_or(u32::MAX);
            let mut signals: [_; PARALLEL_SIMULATIONS] =
                core::array::from_fn(|_| DMatrix::<f64>::zeros(samples, joints));
            let done = self.simulator.for_each_sample_of(loops, |one, k, sample| {
                let values = match output {
                    Output::Torque => &sample.true_torque_nm,
                    Output::Position => &sample.true_position_rad,
                };
                set_row(&mut signals[one], k, values);
            });
            if let Err(error) = done {
                return Ok(Err(error));
            }
            for ((signals, h), &k) in signals.iter().zip(steps).zip(columns) {
                let other = self.context.rows_of(signals, signal_name(output))?;
                jacobian.set_column(k, &((other - &base) / h));
            }
        }
        Ok(Ok(jacobian))
    }

    /// Returns `y − y_s`.
    pub(super) fn residuals(&self, point: &Point) -> DVector<f64> {
        &self.measured - point.simulated_signal(self.output)
    }

    /// Converts a regression failure. Dependent columns mean that the criterion is insensitive to
    /// these parameters.
    pub(super) fn regression_failure(&self, error: RegressionError) -> IdentificationError {
        let signal = match self.output {
            Output::Torque => "torque",
            Output::Position => "position",
        };
        match self.context.selection.regression_failure(error) {
            IdentificationError::NotExcited { parameters }
            | IdentificationError::RankDeficient { parameters } => {
                IterationError::Insensitive { signal, parameters }.into()
            }
            other => other,
        }
    }
}

/// Returns the name of a simulated signal for error messages.
fn signal_name(output: Output) -> &'static str {
    match output {
        Output::Torque => "simulated torque",
        Output::Position => "simulated position",
    }
}
