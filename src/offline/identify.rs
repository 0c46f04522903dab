//! From a measurement or a window to an identification, as the cell wants it.

use std::borrow::Cow;
use std::ops::Range;
use std::sync::{Arc, Mutex, PoisonError};

use didim_core::control::SimulatedController;
use didim_core::identification::{
    ChosenCutoff, ChosenFriction, CrossValidation, Estimate, Experiment, ExperimentError, Failure,
    Identification, IdentificationError, Method, Note, Reduction, choose_cutoff, choose_friction,
    cross_validate, essential_parameters, identify,
};

use super::commanded::{LawError, commanded_controller};
use super::rate::{RateError, measurement};
use crate::archive::store::WindowProvenance;
use crate::cell::{Cell, CellError};
use crate::window::{DriveReadings, Window};
use didim_formats::{Measurement, Side};

/// Why nothing was identified; the inner errors carry the remedy.
#[derive(Debug, thiserror::Error)]
pub enum IdentifyError {
    /// The window's stamps tell another sample rate than the layout, or none.
    #[error(transparent)]
    Rate(#[from] RateError),
    /// The cell has no bus.
    #[error(transparent)]
    Cell(Box<CellError>),
    /// The data are no experiment of this robot.
    #[error("the data do not fit this robot: {0}")]
    Experiment(#[from] ExperimentError),
    /// The cell asks for robust weights of a method that has none.
    #[error("`identification.robust`: {0}")]
    NotRobust(IdentificationError),
    /// The commands of the record tell no law that the method could simulate.
    #[error("{0}")]
    Law(#[from] LawError),
    /// The method refused or failed.
    #[error("{0}")]
    Identification(#[from] IdentificationError),
}

impl IdentifyError {
    /// What kind of failure of the method it is, if it is one.
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
    let measurement = measurement_of(cell, window)?;
    let told = window.readings();
    let law = law_of_commands(cell, cell.method, [(&measurement, &window.counted, &told)])?;
    let own = law.map(|law| {
        let mut own = cell.clone();
        own.options.controller = Some(law);
        own
    });
    let cell = own.as_ref().unwrap_or(cell);
    identify_measurement(cell, cell.method, &measurement, window.counted.clone())
}

/// The controller that the commands of the records state, where the method simulates it, the layout names its law and the cell
/// states none.
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
    commanded_controller(records, cell.robot.transmission()).map(Some)
}

/// What was measured along a window, its rate checked.
pub(super) fn measurement_of(cell: &Cell, window: &Window) -> Result<Measurement, IdentifyError> {
    let bus = cell.bus().map_err(|source| IdentifyError::Cell(Box::new(source)))?;
    Ok(measurement(&window.samples, &bus.layout)?)
}

/// Identifies from a measurement, of which the samples in `counted` count and the others are margin
/// for the edges of the filters. The torque is valid when the cell's layout says so.
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

/// Identifies one set of parameters from several measurements, each with the samples that count in it. What is given away
/// is not in memory twice.
///
/// # Errors
/// See [`IdentifyError`].
pub fn identify_measurements(
    cell: &Cell,
    method: Method,
    measurements: Vec<(Cow<'_, Measurement>, Range<usize>)>,
) -> Result<Identification, IdentifyError> {
    let rate_unchecked = measurements.iter().any(|(measurement, _)| measurement.rate_unchecked);
    let experiment = joined_of(cell, measurements)?;
    cell.options.validate_robust(method).map_err(IdentifyError::NotRobust)?;
    let mut identification = identify(method, &cell.robot, &cell.base, &experiment, &cell.options)?;
    if rate_unchecked {
        identification.estimate.verdict.notes.push(Note::RateUnchecked);
    }
    Ok(identification)
}

/// Chooses the cut-off of the position filter for measurements; `tried` is called after each
/// identification on the way.
///
/// # Errors
/// See [`IdentifyError`].
pub fn choose_cutoff_from(
    cell: &Cell,
    measurements: &[(&Measurement, Range<usize>)],
    tried: impl FnMut(),
) -> Result<ChosenCutoff, IdentifyError> {
    let experiment = joined(cell, measurements)?;
    Ok(choose_cutoff(&cell.robot, &cell.base, &experiment, &cell.options, tried)?)
}

/// Chooses the friction laws of a cell's robot from measurements; `tried` is called after each
/// identification on the way.
///
/// # Errors
/// See [`IdentifyError`].
pub fn choose_friction_from(
    cell: &Cell,
    measurements: &[(&Measurement, Range<usize>)],
    tried: impl FnMut(),
) -> Result<ChosenFriction, IdentifyError> {
    let experiment = joined(cell, measurements)?;
    Ok(choose_friction(&cell.robot, &cell.base, &experiment, &cell.options, tried)?)
}

/// How far two identifications are apart: root mean square over the parameters that both have of their differences, in
/// the standard deviations of these. About 1 where both are of one arm and its model lacks the same in both.
pub fn rms_deviation(one: &Estimate, other: &Estimate) -> f64 {
    let squares = one.parameters.iter().filter_map(|p| {
        let q = other.parameters.iter().find(|q| q.name == p.name)?;
        let deviation = p.standard_deviation.hypot(q.standard_deviation);
        Some(((p.value - q.value) / deviation).powi(2))
    });
    let (count, sum) = squares.fold((0.0, 0.0), |(count, sum), square| (count + 1.0, sum + square));
    (sum / count).sqrt()
}

/// Identifies without each of `blocks` consecutive parts of the samples that count, in turn, and
/// predicts it.
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
    let experiment = experiment(cell, Cow::Borrowed(measurement), counted)?;
    cell.options.validate_robust(method).map_err(IdentifyError::NotRobust)?;
    Ok(cross_validate(method, &cell.robot, &cell.base, &experiment, &cell.options, blocks)?)
}

/// The experiment that measurements are to this cell.
pub(super) fn joined(
    cell: &Cell,
    measurements: &[(&Measurement, Range<usize>)],
) -> Result<Experiment, ExperimentError> {
    let borrowed = measurements.iter().map(|(of, counted)| (Cow::Borrowed(*of), counted.clone()));
    joined_of(cell, borrowed.collect())
}

fn joined_of(
    cell: &Cell,
    measurements: Vec<(Cow<'_, Measurement>, Range<usize>)>,
) -> Result<Experiment, ExperimentError> {
    let mut experiments = measurements
        .into_iter()
        .map(|(measurement, counted)| experiment(cell, measurement, counted))
        .collect::<Result<Vec<_>, _>>()?;
    match experiments.pop() {
        Some(one) if experiments.is_empty() => Ok(one),
        last => {
            experiments.extend(last);
            Experiment::joined(&experiments)
        }
    }
}

/// The experiment that a measurement is to this cell.
fn experiment(
    cell: &Cell,
    measurement: Cow<'_, Measurement>,
    counted: Range<usize>,
) -> Result<Experiment, ExperimentError> {
    let side = measurement.side;
    let signals = match measurement {
        Cow::Borrowed(of) => Cow::Borrowed(&of.signals),
        Cow::Owned(of) => Cow::Owned(of.signals),
    };
    match side {
        Side::Motor => Experiment::motor_side(signals, cell.robot.transmission())?,
        Side::Joint => Experiment::joint_side(signals)?,
    }
    .with_torque_timing(cell.torque_timing)?
    .with_counted(counted)
}

/// Finds the essential parameters in measurements, with the filters of the cell.
///
/// # Errors
/// See [`IdentifyError`].
pub fn reduce_measurements(
    cell: &Cell,
    measurements: &[(&Measurement, Range<usize>)],
) -> Result<Reduction, IdentifyError> {
    let experiment = joined(cell, measurements)?;
    let (robot, base) = (&cell.robot, &cell.base);
    Ok(essential_parameters(robot, base, &experiment, &cell.options, SIGNIFICANCE)?)
}

/// The usual level of an F-test: one parameter in twenty that is zero stays.
const SIGNIFICANCE: f64 = 0.05;

/// An identification and the window that it comes from.
#[derive(Clone, Debug)]
pub struct LastWindow {
    /// The window.
    pub window: WindowProvenance,
    /// What was identified from it.
    pub identification: Identification,
}

/// The last identification of a worker, for whoever wants to draw it.
#[derive(Clone, Debug, Default)]
pub struct LastIdentification(Arc<Mutex<Option<LastWindow>>>);

impl LastIdentification {
    /// Takes it out, if it is that of this window: one that was identified and not stored does not
    /// count.
    pub fn take(&self, window: u64) -> Option<LastWindow> {
        let last = self.0.lock().unwrap_or_else(PoisonError::into_inner).take();
        last.filter(|last| last.window.number == window)
    }

    pub(crate) fn set(&self, last: LastWindow) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = Some(last);
    }
}
