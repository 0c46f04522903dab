//! Closed loop of the experiment, simulated with an estimate. Each recording is simulated
//! separately.

use core::ops::Range;

use nalgebra::{DMatrix, DVector};

use super::inertia::{mean_joint_inertia, missing_inertia};
use crate::identification::equation_error::EquationErrorFit;
use crate::identification::judgement::ReferenceSource;
use crate::identification::observation::{Motion, find_reference};
use crate::identification::problem::{Context, IdentificationError, Method};
use didim_dynamics::control::{ControlTiming, ControllerConfig, SimulatedController};
use didim_dynamics::numeric::WIDTH;
use didim_dynamics::simulation::{
    ClosedLoop, InitialState, Lockstep, NoiseConfig, Sensitivities, SetupError, SimulationConfig,
    SimulationError, StepOutput, set_row,
};
use didim_dynamics::trajectory::SampledReference;

/// Relative tolerance within which a record's sample period counts as a whole multiple of the
/// controller's period. Rates and periods are written with few digits.
const MULTIPLE_TOLERANCE: f64 = 1e-6;

/// Largest number of controller periods per sample of the record.
const MAX_PERIODS: f64 = 200.0;

/// Factor on the bandwidth of a substitute controller that does not stabilise the arm, and the
/// largest number of such reductions.
const BANDWIDTH_REDUCTION: f64 = 0.7;
const MAX_BANDWIDTH_REDUCTIONS: u32 = 6;

/// All data of the loop except the estimate.
pub(super) struct Simulator<'a> {
    context: &'a Context<'a>,
    controller: SimulatedController,
    /// Gains that do not follow the estimate; `None` if the gains follow it.
    fixed_gains: Option<ControllerConfig>,
    recordings: Vec<Recorded>,
    source: ReferenceSource,
    config: SimulationConfig,
    /// Measured positions at the rows, over which inertias are averaged.
    postures: DMatrix<f64>,
    /// Inertia that is added to every simulated estimate; zeros if the mass matrix of the
    /// equation-error estimate is already positive definite.
    added_inertia: DVector<f64>,
    /// Number of reductions of a substitute controller's bandwidth.
    bandwidth_reductions: u32,
    /// Controller periods per sample of the record.
    periods_per_sample: usize,
    motion: Motion,
    /// Memory for the next motion.
    spare_motion: Option<Motion>,
}

/// Reference and initial state of one recording's loop.
struct Recorded {
    /// Samples of the recording in the experiment; the first is at time 0.
    samples: Range<usize>,
    reference: SampledReference,
    initial_state: InitialState,
}

/// Loops of one simulation, one per recording.
pub(super) type Loops<'s> = Vec<ClosedLoop<&'s SampledReference>>;

impl<'a> Simulator<'a> {
    /// Creates the loop of each recording. It follows the recorded reference or, without one, the
    /// filtered measured position. It starts at the filtered measured position and velocity.
    pub(super) fn new(
        context: &'a Context<'a>,
        fit: &EquationErrorFit,
        method: Method,
    ) -> Result<Self, IdentificationError> {
        let (experiment, options) = (context.experiment, &context.options.simulation);
        let controller = context.options.controller(method)?.clone();
        let rate = experiment.sample_rate_hz();
        let periods = periods_per_sample(rate, controller.timing())?;
        let (source, recorded, delay_s) = match experiment.reference_rad() {
            Some(recorded) => {
                (ReferenceSource::Recorded, recorded, experiment.reference_timing().delay_s)
            }
            None => (ReferenceSource::MeasuredPosition, &fit.motion.position, 0.0),
        };
        let recording = |samples: &Range<usize>| {
            let first = |signal: &dyn Fn(usize) -> f64| {
                (0..experiment.joints()).map(signal).collect::<Vec<f64>>()
            };
            let start = samples.start;
            Ok(Recorded {
                samples: samples.clone(),
                reference: find_reference(context, recorded, samples, delay_s)?,
                initial_state: InitialState::At {
                    position_rad: first(&|joint| fit.motion.position[(start, joint)]),
                    velocity_rad_s: first(&|joint| fit.motion.velocity(start, joint)),
                },
            })
        };
        let recordings = experiment.recordings().iter().map(|of| recording(&of.samples));
        let recordings = recordings.collect::<Result<_, IdentificationError>>()?;
        let postures = fit.motion.position.select_rows(&context.samples);
        let added = missing_inertia(context, &fit.weighting.solution.parameters, &postures);
        Ok(Self {
            context,
            controller,
            fixed_gains: None,
            recordings,
            source,
            config: SimulationConfig {
                integrator: options.integrator,
                substeps: options.substeps,
                ..SimulationConfig::default()
            },
            postures,
            added_inertia: added,
            bandwidth_reductions: 0,
            periods_per_sample: periods,
            motion: fit.motion.clone(),
            spare_motion: None,
        })
    }

    /// Returns the timing of the controller.
    pub(super) fn timing(&self) -> ControlTiming {
        self.controller.timing()
    }

    /// Returns the source of the reference.
    pub(super) fn reference_source(&self) -> ReferenceSource {
        self.source
    }

    /// Returns the simulator with fixed gains for these parameters, which all later simulations
    /// use.
    pub(super) fn with_gains_for(
        mut self,
        parameters: &DVector<f64>,
    ) -> Result<Self, IdentificationError> {
        self.fixed_gains = Some(self.controller_for(
            &self.context.selection.to_standard(&self.simulated_parameters(parameters)),
        )?);
        Ok(self)
    }

    /// Returns the parameters of the simulated arm for an estimate: the estimate with the added
    /// inertia.
    pub(super) fn simulated_parameters(&self, parameters: &DVector<f64>) -> DVector<f64> {
        parameters + &self.added_inertia
    }

    /// Simulates every later estimate without added inertia.
    pub(super) fn add_nothing(&mut self) {
        self.added_inertia.fill(0.0);
    }

    fn controller_for(&self, standard: &[f64]) -> Result<ControllerConfig, IdentificationError> {
        let inertia = mean_joint_inertia(&self.context.model, standard, &self.postures);
        let controller = self.controller.for_inertia(&inertia);
        controller.map_err(|error| IdentificationError::Setup(SetupError::Control(error)))
    }

    /// Reduces the bandwidth of a substitute controller that does not stabilise the arm. Returns
    /// false if the controller is not a substitute or cannot be reduced further.
    ///
    /// # Errors
    /// [`IdentificationError::Setup`] if the new gains are impossible.
    pub(super) fn slow_down(&mut self) -> Result<bool, IdentificationError> {
        let is_stand_in = matches!(self.controller, SimulatedController::Bandwidth { .. });
        if !is_stand_in || self.bandwidth_reductions == MAX_BANDWIDTH_REDUCTIONS {
            return Ok(false);
        }
        self.bandwidth_reductions += 1;
        let setup = |error| IdentificationError::Setup(SetupError::Control(error));
        self.controller =
            self.controller.clone().with_bandwidth(BANDWIDTH_REDUCTION).map_err(setup)?;
        if let Some(fixed) = self.fixed_gains.take() {
            self.fixed_gains = Some(fixed.with_bandwidth(BANDWIDTH_REDUCTION).map_err(setup)?);
        }
        Ok(true)
    }

    /// Returns the smallest bandwidth of a joint's substitute controller \[Hz\], if it was reduced.
    pub(super) fn slower_bandwidth_hz(&self) -> Option<f64> {
        match &self.controller {
            SimulatedController::Bandwidth { bandwidth_hz, .. }
                if self.bandwidth_reductions > 0 =>
            {
                bandwidth_hz.iter().copied().min_by(f64::total_cmp)
            }
            _ => None,
        }
    }

    /// Returns the loops with these selected parameters; the others have their fixed values.
    pub(super) fn closed_loops(
        &self,
        parameters: &DVector<f64>,
    ) -> Result<Loops<'_>, IdentificationError> {
        self.closed_loops_with(parameters, &self.config)
    }

    fn closed_loops_with(
        &self,
        parameters: &DVector<f64>,
        config: &SimulationConfig,
    ) -> Result<Loops<'_>, IdentificationError> {
        let standard = self.context.selection.to_standard(&self.simulated_parameters(parameters));
        let controller = match &self.fixed_gains {
            Some(fixed) => fixed.clone(),
            None => self.controller_for(&standard)?,
        };
        let (robot, mut config) = (self.context.robot, config.clone());
        let mut loops = Vec::with_capacity(self.recordings.len());
        for Recorded { reference, initial_state: initial, .. } in &self.recordings {
            let start = initial.clone();
            let made = ClosedLoop::new(robot, &standard, &controller, reference, &config, start);
            loops.push(made.map_err(IdentificationError::Setup)?);
            // Each recording has its own noise.
            if let Some(noise) = &mut config.noise {
                noise.seed = noise.seed.wrapping_add(1);
            }
        }
        Ok(loops)
    }

    /// Calls `each` with every sample of the experiment's grid. The loops take `periods_per_sample`
    /// steps per sample.
    pub(super) fn for_each_sample(
        &self,
        loops: &mut Loops<'_>,
        mut each: impl FnMut(usize, &StepOutput, Option<Sensitivities<'_>>),
    ) -> Result<(), SimulationError> {
        for (closed_loop, of) in loops.iter_mut().zip(&self.recordings) {
            for k in of.samples.clone() {
                if k > of.samples.start {
                    for _ in 1..self.periods_per_sample {
                        closed_loop.step()?;
                    }
                }
                closed_loop.step()?;
                each(k, closed_loop.output(), closed_loop.sensitivities());
            }
        }
        Ok(())
    }

    /// Simulates the motion of the arm with these selected parameters; the others have their fixed
    /// values. Positions and velocities are those at the samples of the record, accelerations those
    /// just after them.
    ///
    /// # Errors
    /// The outer result is an error that no other parameters would avoid; the inner one is a
    /// simulation that ended early.
    pub(super) fn run(
        &mut self,
        parameters: &DVector<f64>,
    ) -> Result<Result<(), SimulationError>, IdentificationError> {
        let mut motion = self.spare_motion.take().unwrap_or_else(|| self.motion.clone());
        let mut loops = self.closed_loops(parameters)?;
        let recorded = self.for_each_sample(&mut loops, |k, sample, _| motion.set(k, sample));
        if recorded.is_ok() {
            core::mem::swap(&mut self.motion, &mut motion);
        }
        self.spare_motion = Some(motion);
        Ok(recorded)
    }

    /// Returns the torque just after every sample, samples × joints \[N·m\], of one simulation per
    /// noise configuration.
    ///
    /// # Errors
    /// Those of [`run`](Self::run).
    pub(super) fn torques_with_noise<const L: usize>(
        &self,
        parameters: &DVector<f64>,
        noises: [NoiseConfig; L],
    ) -> Result<Result<[DMatrix<f64>; L], SimulationError>, IdentificationError> {
        let mut loops = Vec::with_capacity(L);
        for noise in noises {
            let config = SimulationConfig { noise: Some(noise), ..self.config.clone() };
            loops.push(self.closed_loops_with(parameters, &config)?);
        }
        let (samples, joints) = (self.motion.position.nrows(), self.context.robot.joints());
        let mut torques = core::array::from_fn(|_| DMatrix::zeros(samples, joints));
        let done = self.for_each_sample_of(loops, |one, k, sample| {
            set_row(&mut torques[one], k, &sample.true_torque_nm);
        });
        Ok(done.map(|()| torques))
    }

    /// Simulates all `simulations` in parallel. Calls `each` with the number of the simulation, the
    /// sample of the experiment's grid and the output.
    pub(super) fn for_each_sample_of<'s>(
        &'s self,
        simulations: Vec<Loops<'s>>,
        mut each: impl FnMut(usize, usize, &StepOutput),
    ) -> Result<(), SimulationError> {
        let mut simulations: Vec<_> = simulations.into_iter().map(Vec::into_iter).collect();
        for Recorded { samples, .. } in &self.recordings {
            for (first, simulations) in (0..).step_by(WIDTH).zip(simulations.chunks_mut(WIDTH)) {
                let starting = simulations.iter_mut().filter_map(Iterator::next);
                let mut lockstep = Lockstep::new(starting.collect());
                for k in samples.clone() {
                    let periods = if k > samples.start { self.periods_per_sample } else { 1 };
                    (0..periods).try_for_each(|_| lockstep.step())?;
                    for (l, sample) in lockstep.outputs().enumerate() {
                        each(first + l, k, sample);
                    }
                }
            }
        }
        Ok(())
    }

    /// Returns the motion of the last simulation that [`run`](Self::run) completed.
    pub(super) fn motion(&self) -> &Motion {
        &self.motion
    }
}

impl Motion {
    /// Stores the true motion of a simulated sample in row k.
    pub(super) fn set(&mut self, k: usize, sample: &StepOutput) {
        let StepOutput { true_position_rad, true_velocity_rad_s, true_acceleration_rad_s2, .. } =
            sample;
        let motion = [true_position_rad, true_velocity_rad_s, true_acceleration_rad_s2];
        self.set_sample(k, motion, sample.hysteresis);
    }
}

/// # Errors
/// [`IdentificationError::ControllerPeriod`].
pub(super) fn periods_per_sample(
    sample_rate_hz: f64,
    controller: ControlTiming,
) -> Result<usize, IdentificationError> {
    let sample_period_s = 1.0 / sample_rate_hz;
    let controller_period_s = controller.sample_period_s();
    let periods = sample_period_s / controller_period_s;
    let whole_periods = periods.round();
    // A larger ratio is a unit error and would take hours to simulate.
    if (1.0..=MAX_PERIODS).contains(&whole_periods)
        && (periods - whole_periods).abs() <= MULTIPLE_TOLERANCE * whole_periods
    {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "in range")]
        return Ok(whole_periods as usize);
    }
    Err(IdentificationError::ControllerPeriod { controller_period_s, sample_period_s })
}
