//! The closed loop of the experiment, simulated with an estimate.

use nalgebra::{DMatrix, DVector};

use super::{DidimOptions, mean_joint_inertia};
use crate::MAX_JOINTS;
use crate::control::{ControlTiming, SimulatedController};
use crate::identification::error::IdentificationError;
use crate::identification::estimate::ReferenceSource;
use crate::identification::experiment::Experiment;
use crate::identification::idim_ls::EquationErrorFit;
use crate::identification::prefilter::Motion;
use crate::robot::Robot;
use crate::simulation::{
    ClosedLoop, InitialState, NoiseConfig, SetupError, SimulationConfig, SimulationError,
    StepOutput,
};
use crate::trajectory::SampledReference;

/// A record's sample period this close to a whole multiple of the controller's, relative to it, is
/// one: rates and periods are written with few digits.
const WHOLE_MULTIPLE: f64 = 1e-6;

/// A controller computes no more often per sample of the record.
const MOST_PERIODS: f64 = 200.0;

/// Simulates the loop with one estimate after the other.
pub(super) struct Simulator<'a> {
    setting: Setting<'a>,
    source: ReferenceSource,
    /// Controller periods per sample of the record.
    periods: usize,
    motion: Motion,
}

/// Everything about the loop but the estimate.
struct Setting<'a> {
    robot: &'a Robot,
    fit: &'a EquationErrorFit,
    controller: &'a SimulatedController,
    reference: SampledReference,
    config: SimulationConfig,
    initial: InitialState,
    /// Measured positions of the rows, over which inertias are averaged.
    postures: DMatrix<f64>,
}

impl<'a> Simulator<'a> {
    /// The loop that the experiment was recorded in: its reference where there is one, otherwise
    /// the filtered measured position, beginning at the filtered measured position and velocity.
    pub(super) fn new(
        robot: &'a Robot,
        fit: &'a EquationErrorFit,
        experiment: &Experiment,
        options: &'a DidimOptions,
    ) -> Result<Self, IdentificationError> {
        let rate = experiment.sample_rate_hz();
        let periods = periods_per_sample(rate, options.controller.timing())?;
        let (source, recorded, delay_s) = match experiment.reference_rad() {
            Some(recorded) => {
                (ReferenceSource::Recorded, recorded, experiment.reference_timing().delay_s)
            }
            None => (ReferenceSource::MeasuredPosition, &fit.motion.position, 0.0),
        };
        let reference = SampledReference::new(rate, recorded)
            .map_err(IdentificationError::Reference)?
            .with_interpolation(options.reference)
            .with_delay_s(delay_s);
        let first = |signal: &DMatrix<f64>| signal.row(0).iter().copied().collect();
        let kept: Vec<usize> = fit.decimation.kept(experiment.counted()).collect();
        let setting = Setting {
            robot,
            fit,
            controller: &options.controller,
            reference,
            config: SimulationConfig {
                integrator: options.integrator,
                substeps: options.substeps,
                ..SimulationConfig::default()
            },
            initial: InitialState::At {
                position_rad: first(&fit.motion.position),
                velocity_rad_s: first(&fit.motion.velocity),
            },
            postures: fit.motion.position.select_rows(&kept),
        };
        Ok(Self { setting, source, periods, motion: fit.motion.clone() })
    }

    /// What the loop follows.
    pub(super) fn reference(&self) -> &SampledReference {
        &self.setting.reference
    }

    /// When the controller computes.
    pub(super) fn timing(&self) -> ControlTiming {
        self.setting.controller.timing()
    }

    /// Where the reference comes from.
    pub(super) fn source(&self) -> ReferenceSource {
        self.source
    }

    /// The motion of the arm with these selected parameters, every other parameter 0: at the
    /// samples of the record, accelerations just after them.
    ///
    /// # Errors
    /// Outside, what no other parameters would mend; inside, what ended the simulation.
    pub(super) fn run(
        &mut self,
        parameters: &DVector<f64>,
    ) -> Result<Result<(), SimulationError>, IdentificationError> {
        let mut closed_loop = self.setting.closed_loop(parameters, None)?;
        Ok(record(&mut closed_loop, self.periods, &mut self.motion))
    }

    /// The torque that acts just after every sample, samples × joints \[N·m\], in a simulation with
    /// this noise.
    ///
    /// # Errors
    /// As [`run`](Self::run).
    pub(super) fn torque_with_noise(
        &self,
        parameters: &DVector<f64>,
        noise: NoiseConfig,
    ) -> Result<Result<DMatrix<f64>, SimulationError>, IdentificationError> {
        let mut closed_loop = self.setting.closed_loop(parameters, Some(noise))?;
        let mut torque = DMatrix::zeros(self.motion.position.nrows(), self.motion.position.ncols());
        let recorded = each_sample(&mut closed_loop, self.periods, torque.nrows(), |k, sample| {
            set(&mut torque, k, &sample.true_torque_nm);
        });
        Ok(recorded.map(|()| torque))
    }

    /// The motion of the last simulation that [`run`](Self::run) completed.
    pub(super) fn motion(&self) -> &Motion {
        &self.motion
    }
}

impl Setting<'_> {
    /// The loop with these selected parameters, every other parameter 0.
    fn closed_loop(
        &self,
        parameters: &DVector<f64>,
        noise: Option<NoiseConfig>,
    ) -> Result<ClosedLoop<&SampledReference>, IdentificationError> {
        let model = &self.fit.model;
        let mut standard = vec![0.0; model.parameter_names().len()];
        for (&column, &value) in self.fit.selection.columns().iter().zip(parameters.iter()) {
            standard[column] = value;
        }
        let setup = IdentificationError::Setup;
        let inertia = mean_joint_inertia(model, &standard, &self.postures);
        let controller = self.controller.for_inertia(&inertia);
        let controller = controller.map_err(|error| setup(SetupError::Control(error)))?;
        ClosedLoop::new(
            self.robot,
            &standard,
            &controller,
            &self.reference,
            &SimulationConfig { noise, ..self.config.clone() },
            self.initial.clone(),
        )
        .map_err(setup)
    }
}

/// Fills `motion` with one sample of the loop in so many `periods`.
fn record(
    closed_loop: &mut ClosedLoop<&SampledReference>,
    periods: usize,
    motion: &mut Motion,
) -> Result<(), SimulationError> {
    each_sample(closed_loop, periods, motion.position.nrows(), |k, sample| {
        set(&mut motion.position, k, &sample.true_position_rad);
        set(&mut motion.velocity, k, &sample.true_velocity_rad_s);
        set(&mut motion.acceleration, k, &sample.true_acceleration_rad_s2);
    })
}

/// Hands over one sample of the loop in so many `periods`, `samples` in all.
fn each_sample(
    closed_loop: &mut ClosedLoop<&SampledReference>,
    periods: usize,
    samples: usize,
    mut take: impl FnMut(usize, &StepOutput),
) -> Result<(), SimulationError> {
    for k in 0..samples {
        if k > 0 {
            for _ in 1..periods {
                closed_loop.step()?;
            }
        }
        take(k, closed_loop.step()?);
    }
    Ok(())
}

/// One row of a signal.
fn set(signal: &mut DMatrix<f64>, k: usize, values: &[f64; MAX_JOINTS]) {
    for (entry, value) in signal.row_mut(k).iter_mut().zip(values) {
        *entry = *value;
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
    let whole = periods.round();
    // More is a mistake of units, and takes hours to simulate.
    if (1.0..=MOST_PERIODS).contains(&whole) && (periods - whole).abs() <= WHOLE_MULTIPLE * whole {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "in range")]
        return Ok(whole as usize);
    }
    Err(IdentificationError::ControllerPeriod { controller_period_s, sample_period_s })
}
