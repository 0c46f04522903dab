//! Identification from a measurement or a window, with the settings of the cell.

use std::borrow::Cow;
use std::ops::Range;
use std::sync::{Arc, Mutex, PoisonError};

use didim_dynamics::control::SimulatedController;
use didim_identification::identification::{
    ChosenCutoff, ChosenFriction, CrossValidation, Estimate, Experiment, ExperimentError, Failure,
    Identification, IdentificationError, Method, Note, Reduction, UncheckedParameter,
    choose_cutoff, choose_friction, cross_validate, essential_parameters, identify,
    identify_unchecked,
};

use didim_identification::regression::RegressionLimits;

use super::screening::{
    BeyondLimits, LawError, LimitExcess, RateError, check_limits, checked_measurement,
    commanded_controller,
};
use crate::archive::store::WindowProvenance;
use crate::cell::{Cell, CellError, SignalSource};
use crate::window::{DriveReadings, Window};
use didim_formats::{Measurement, Side};

/// Error when an identification fails. The inner errors state the remedy.
#[derive(Debug, thiserror::Error)]
pub enum IdentifyError {
    /// The time stamps give a sample rate that differs from the layout's, or no sample rate.
    #[error(transparent)]
    Rate(#[from] RateError),
    /// Positions or torques are far beyond the robot's limits.
    #[error(transparent)]
    Limits(#[from] BeyondLimits),
    /// The cell has no bus.
    #[error(transparent)]
    Cell(Box<CellError>),
    /// The data do not fit this robot as an experiment.
    #[error("the data do not fit this robot: {0}")]
    Experiment(#[from] ExperimentError),
    /// The cell asks for robust weights, but the method has none.
    #[error("`identification.robust`: {0}")]
    NotRobust(IdentificationError),
    /// The commands of the record do not contain a control law that the method can simulate.
    #[error("{0}")]
    Law(#[from] LawError),
    /// The method refused the data or failed.
    #[error("{0}")]
    Identification(#[from] IdentificationError),
}

impl IdentifyError {
    /// Returns the kind of failure if the method failed. `None` for other errors.
    pub fn failure(&self) -> Option<Failure> {
        match self {
            Self::Identification(error) => error.failure(),
            _ => None,
        }
    }
}

/// Identifies from one window of the live or replayed stream.
///
/// # Errors
/// See [`IdentifyError`].
pub fn identify_window(cell: &Cell, window: &Window) -> Result<Identification, IdentifyError> {
    let (measurement, beyond) = measurement_of(cell, window)?;
    // One line per window: the largest excess of a list that may have three entries per joint.
    if let Some(worst) = beyond.first() {
        tracing::warn!("window {}: {worst}", window.number);
    }
    let readings = window.readings();
    let law =
        law_of_commands(cell, cell.method, [(&measurement, &window.counted_samples, &readings)])?;
    let with_law = law.map(|law| {
        let mut changed = cell.clone();
        changed.options.controller = Some(law);
        changed
    });
    let cell = with_law.as_ref().unwrap_or(cell);
    let counted = window.counted_samples.clone();
    let mut identification = identify_measurement(cell, cell.method, &measurement, counted)?;
    add_settings(cell, &[SignalSource::Live], &mut identification.estimate);
    Ok(identification)
}

/// Adds the keys of the cell file that the findings of an estimate ask to change. `sources` are the
/// sources of its signals.
pub fn add_settings(cell: &Cell, sources: &[SignalSource], estimate: &mut Estimate) {
    estimate.verdict.add_settings(&|change| cell.setting(sources, change));
}

/// Returns the controller that the commands of the records contain. `None` unless the method
/// simulates a controller, the layout has the signals of the law, and the cell configures no
/// controller.
///
/// # Errors
/// [`LawError`].
pub fn law_of_commands<'a>(
    cell: &Cell,
    method: Method,
    records: impl IntoIterator<Item = (&'a Measurement, &'a Range<usize>, &'a DriveReadings)>,
) -> Result<Option<SimulatedController>, LawError> {
    if !(method.simulates() && cell.options.controller.is_none() && cell.has_commanded_law()) {
        return Ok(None);
    }
    commanded_controller(records, cell.robot.transmission(), cell.screening.commands).map(Some)
}

/// Converts a window to a measurement, and checks its sample rate and the robot's limits. Also
/// returns the values that exceed a limit without being an error, largest excess first.
pub(super) fn measurement_of(
    cell: &Cell,
    window: &Window,
) -> Result<(Measurement, Vec<LimitExcess>), IdentifyError> {
    let bus = cell.bus().map_err(|source| IdentifyError::Cell(Box::new(source)))?;
    let measurement = checked_measurement(&window.samples, &bus.layout, cell.screening.rate)?;
    let counted = &window.counted_samples;
    let beyond = check_limits(&measurement, counted, &cell.robot, cell.screening.limits)?;
    Ok((measurement, beyond))
}

/// Identifies from a measurement. Only the samples in `counted` are fitted; the others are margin
/// for the edges of the filters. The layout of the cell sets the time at which a torque is valid.
///
/// # Errors
/// See [`IdentifyError`].
pub fn identify_measurement(
    cell: &Cell,
    method: Method,
    measurement: &Measurement,
    counted: Range<usize>,
) -> Result<Identification, IdentifyError> {
    identify_measurements(cell, method, vec![(Cow::Borrowed(measurement), counted)])
}

/// Identifies one set of parameters from several measurements, each with its range of counted
/// samples. Owned measurements are moved and not copied.
///
/// # Errors
/// See [`IdentifyError`].
pub fn identify_measurements(
    cell: &Cell,
    method: Method,
    measurements: Vec<(Cow<'_, Measurement>, Range<usize>)>,
) -> Result<Identification, IdentifyError> {
    let rate_unchecked = measurements.iter().any(|(measurement, _)| measurement.rate_unchecked);
    let experiment = join_any(cell, measurements)?;
    cell.options.validate_robust(method).map_err(IdentifyError::NotRobust)?;
    let mut identification = identify(method, &cell.robot, &cell.base, &experiment, &cell.options)?;
    if rate_unchecked {
        identification.estimate.verdict.notes.push(Note::RateUnchecked);
    }
    Ok(identification)
}

/// Chooses the cut-off of the position filter from measurements. Calls `tried` after each trial
/// identification.
///
/// # Errors
/// See [`IdentifyError`].
pub fn choose_cutoff_from(
    cell: &Cell,
    measurements: &[(&Measurement, Range<usize>)],
    tried: impl FnMut(),
) -> Result<ChosenCutoff, IdentifyError> {
    let experiment = join_measurements(cell, measurements)?;
    Ok(choose_cutoff(&cell.robot, &cell.base, &experiment, &cell.options, tried)?)
}

/// Chooses the friction laws of a cell's robot from measurements. Calls `tried` after each trial
/// identification.
///
/// # Errors
/// See [`IdentifyError`].
pub fn choose_friction_from(
    cell: &Cell,
    measurements: &[(&Measurement, Range<usize>)],
    tried: impl FnMut(),
) -> Result<ChosenFriction, IdentifyError> {
    let experiment = join_measurements(cell, measurements)?;
    Ok(choose_friction(&cell.robot, &cell.base, &experiment, &cell.options, tried)?)
}

/// Returns the parameters of a measurement without a verdict, which takes most of the time.
///
/// # Errors
/// See [`IdentifyError`].
pub fn parameters_of_measurement(
    cell: &Cell,
    method: Method,
    measurement: &Measurement,
    counted: Range<usize>,
) -> Result<Vec<UncheckedParameter>, IdentifyError> {
    let experiment = to_experiment(cell, Cow::Borrowed(measurement), counted)?;
    cell.options.validate_robust(method).map_err(IdentifyError::NotRobust)?;
    Ok(identify_unchecked(method, &cell.robot, &cell.base, &experiment, &cell.options)?)
}

/// Returns the root mean square difference of two identifications over their common parameters.
/// Each difference is in units of its standard deviation. The value is about 1 if both
/// identifications are of the same arm and have the same model error.
pub fn rms_deviation(one: &[UncheckedParameter], other: &[UncheckedParameter]) -> f64 {
    let squares = one.iter().filter_map(|p| {
        let q = other.iter().find(|q| q.name == p.name)?;
        let deviation = p.standard_deviation.hypot(q.standard_deviation);
        Some(((p.value - q.value) / deviation).powi(2))
    });
    let (count, sum) = squares.fold((0.0, 0.0), |(count, sum), square| (count + 1.0, sum + square));
    (sum / count).sqrt()
}

/// Cross-validates a measurement: leaves out each of `blocks` consecutive parts of the counted
/// samples in turn, identifies from the rest and predicts the part.
///
/// # Errors
/// See [`IdentifyError`].
pub fn cross_validate_measurement(
    cell: &Cell,
    method: Method,
    measurement: &Measurement,
    counted: Range<usize>,
    blocks: usize,
) -> Result<CrossValidation, IdentifyError> {
    let experiment = to_experiment(cell, Cow::Borrowed(measurement), counted)?;
    cell.options.validate_robust(method).map_err(IdentifyError::NotRobust)?;
    Ok(cross_validate(method, &cell.robot, &cell.base, &experiment, &cell.options, blocks)?)
}

/// Converts measurements to one experiment of this cell.
pub(super) fn join_measurements(
    cell: &Cell,
    measurements: &[(&Measurement, Range<usize>)],
) -> Result<Experiment, ExperimentError> {
    let borrowed = measurements.iter().map(|(of, counted)| (Cow::Borrowed(*of), counted.clone()));
    join_any(cell, borrowed.collect())
}

fn join_any(
    cell: &Cell,
    measurements: Vec<(Cow<'_, Measurement>, Range<usize>)>,
) -> Result<Experiment, ExperimentError> {
    let mut experiments = measurements
        .into_iter()
        .map(|(measurement, counted)| to_experiment(cell, measurement, counted))
        .collect::<Result<Vec<_>, _>>()?;
    match experiments.pop() {
        Some(one) if experiments.is_empty() => Ok(one),
        last => {
            experiments.extend(last);
            Experiment::join(&experiments)
        }
    }
}

/// Converts a measurement to an experiment of this cell.
fn to_experiment(
    cell: &Cell,
    measurement: Cow<'_, Measurement>,
    counted: Range<usize>,
) -> Result<Experiment, ExperimentError> {
    let side = measurement.side;
    let signals = match measurement {
        Cow::Borrowed(of) => Cow::Borrowed(&of.signals),
        Cow::Owned(of) => Cow::Owned(of.signals),
    };
    let transmission = cell.robot.transmission();
    match side {
        Side::Motor => Experiment::motor_side(signals, transmission)?,
        Side::Joint => Experiment::joint_side(signals)?,
    }
    .with_torque_timing(cell.torque_timing)?
    .with_counted(counted)?
    .with_signal_delays(&cell.signal_delays, (side == Side::Motor).then_some(transmission))
}

/// Finds the essential parameters from measurements, with the filters of the cell.
///
/// # Errors
/// See [`IdentifyError`].
pub fn reduce_measurements(
    cell: &Cell,
    measurements: &[(&Measurement, Range<usize>)],
) -> Result<Reduction, IdentifyError> {
    let experiment = join_measurements(cell, measurements)?;
    let (robot, base) = (&cell.robot, &cell.base);
    let level = RegressionLimits::DEFAULT.significance_level;
    Ok(essential_parameters(robot, base, &experiment, &cell.options, level)?)
}

/// An identification and its window.
#[derive(Clone, Debug)]
pub struct LastWindow {
    /// The window.
    pub window: WindowProvenance,
    /// Identification from the window.
    pub identification: Identification,
}

/// The last identification of a worker, for plots.
#[derive(Clone, Debug, Default)]
pub struct LastIdentification(Arc<Mutex<Option<LastWindow>>>);

impl LastIdentification {
    /// Takes the identification out and returns it if it belongs to this window. An identification
    /// of another window is dropped, because its result was not stored.
    pub fn take(&self, window: u64) -> Option<LastWindow> {
        let last = self.0.lock().unwrap_or_else(PoisonError::into_inner).take();
        last.filter(|last| last.window.number == window)
    }

    pub(crate) fn set(&self, last: LastWindow) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = Some(last);
    }
}
