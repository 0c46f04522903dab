//! Simulation and least squares in turn, until the estimates stand still.

use nalgebra::{DMatrix, DVector};

use crate::control::ControlTiming;
use crate::identification::closed_loop::instruments::Instruments;
use crate::identification::closed_loop::simulator::Simulator;
use crate::identification::equation_error::idim_ls::EquationErrorFit;
use crate::identification::equation_error::weighting::Weighting;
use crate::identification::given::error::IdentificationError;
use crate::identification::given::experiment::Experiment;
use crate::identification::given::simulation::ConvergenceLimits;
use crate::identification::judgement::estimate::{ConvergenceStep, ReferenceSource};
use crate::identification::observation::matrix::observation_matrix;
use crate::identification::observation::prefilter::Motion;
use crate::regression::{Observations, Solution};
use crate::simulation::{NoiseConfig, SimulationError};
use crate::trajectory::SampledReference;

/// A step is halved no more often than this: a thousandth of it leads nowhere else.
const MAX_HALVINGS: u32 = 10;

/// A relative error below this is small for any arm: its changes are held against this much, since
/// without noise it would shrink for ever.
const SMALL_ERROR: f64 = 1e-3;

/// Which equation the simulated motion enters, and how.
pub(crate) enum Equation {
    /// DIDIM: the observation matrix is that of the simulated motion. Measured torque of the rows,
    /// shifted to the simulated samples.
    Simulated { torque: DVector<f64> },
    /// IDIM-IV: the equation is that of the measured motion, with instruments of the simulated one.
    Instrumented,
}

/// The last simulation, its equation and the solution.
pub(crate) struct Converged {
    /// The parameters that were simulated (b).
    pub(crate) simulated: DVector<f64>,
    pub(crate) observations: Observations,
    pub(crate) solution: Solution,
}

/// From a start to parameters that stand still.
pub(crate) struct Iteration<'a> {
    experiment: &'a Experiment,
    fit: &'a EquationErrorFit,
    limits: ConvergenceLimits,
    equation: Equation,
    simulator: Simulator<'a>,
    simulations: u32,
    steps: Vec<ConvergenceStep>,
    /// The parameter that the last step changed most, of those selected.
    mover: usize,
}

impl<'a> Iteration<'a> {
    pub(crate) fn new(
        experiment: &'a Experiment,
        fit: &'a EquationErrorFit,
        equation: Equation,
        simulator: Simulator<'a>,
        limits: ConvergenceLimits,
    ) -> Self {
        Self {
            experiment,
            fit,
            limits,
            equation,
            simulator,
            simulations: 0,
            steps: vec![],
            mover: 0,
        }
    }

    /// Simulations run, those that failed included.
    pub(crate) fn simulations(&self) -> u32 {
        self.simulations
    }

    /// The loop, for who goes on from here by other means.
    pub(crate) fn into_simulator(self) -> Simulator<'a> {
        self.simulator
    }

    /// Linear least-squares steps taken.
    pub(crate) fn least_squares_steps(&self) -> u32 {
        u32::try_from(self.steps.len()).unwrap_or(u32::MAX)
    }

    /// What the simulations followed.
    pub(crate) fn reference(&self) -> ReferenceSource {
        self.simulator.source()
    }

    /// One entry per step.
    pub(crate) fn steps(&self) -> &[ConvergenceStep] {
        &self.steps
    }

    /// The reference itself.
    pub(super) fn reference_signal(&self) -> &SampledReference {
        self.simulator.reference()
    }

    /// When the simulated controller computes.
    pub(super) fn timing(&self) -> ControlTiming {
        self.simulator.timing()
    }

    /// See [`Simulator::torques_with_noise`].
    pub(super) fn torques_with_noise<const L: usize>(
        &self,
        parameters: &DVector<f64>,
        noises: [NoiseConfig; L],
    ) -> Result<Result<[DMatrix<f64>; L], SimulationError>, IdentificationError> {
        self.simulator.torques_with_noise(parameters, noises)
    }

    /// The motion of the last simulation.
    pub(crate) fn motion(&self) -> &Motion {
        self.simulator.motion()
    }

    /// Until the estimates stand still.
    pub(crate) fn run(&mut self, start: DVector<f64>) -> Result<Converged, IdentificationError> {
        let mut previous = None;
        let mut parameters = start;
        loop {
            let halvings = self.simulate(previous.as_ref(), &mut parameters)?;
            let (observations, solution) = self.solve()?;
            if self.converged(&observations, &solution, &parameters, halvings)? {
                return Ok(Converged { simulated: parameters, observations, solution });
            }
            let next = solution.parameters;
            previous = Some(core::mem::replace(&mut parameters, next));
        }
    }

    /// The estimate after so many steps, whether it stands still or not, and the one before, from
    /// where the last step came.
    pub(crate) fn steps_from(
        &mut self,
        start: DVector<f64>,
        steps: u32,
    ) -> Result<(DVector<f64>, Option<DVector<f64>>), IdentificationError> {
        let mut previous = None;
        let mut parameters = start;
        for _ in 0..steps {
            self.simulate(previous.as_ref(), &mut parameters)?;
            let next = self.solve()?.1.parameters;
            previous = Some(core::mem::replace(&mut parameters, next));
        }
        Ok((parameters, previous))
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
        let matrix = self.experiment.fitted_matrix(&fit.decimation, matrix);
        let joints = self.experiment.joints();
        match &self.equation {
            Equation::Simulated { torque } => {
                let observations =
                    Observations::new(matrix, torque.clone(), joints).map_err(named)?;
                let weighting = Weighting::new(&observations, &fit.noise_levels, fit.robust);
                Ok((observations, weighting.map_err(named)?.solution))
            }
            Equation::Instrumented => {
                let (equation, levels) = (&fit.observations, &fit.noise_levels);
                let instruments = Instruments::new(equation, &matrix, levels, &fit.selection)?;
                let solution = instruments.solve(equation, levels).map_err(named)?;
                Ok((instruments.projected, solution))
            }
        }
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
        let relative_error_change =
            last.map(|last| (relative_error - last).abs() / last.max(SMALL_ERROR));
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
