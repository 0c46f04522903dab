//! What was recorded, and when each signal was valid.

use core::ops::Range;

use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::MAX_JOINTS;
use crate::robot::Transmission;
use crate::simulation::Record;

/// When the logged value of a signal acts, relative to the instant of its sample.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SignalTiming {
    /// The value acts from the sample's instant for this long \[s\]; 0 means it describes the
    /// instant itself. A torque command that is held until the next sample has one period here.
    #[serde(default)]
    pub hold_s: f64,
    /// The value acts this much later than the sample's instant \[s\]; negative when it acted
    /// before, as an old measurement does.
    #[serde(default)]
    pub delay_s: f64,
}

impl SignalTiming {
    /// The signal describes the instant of its sample.
    pub const INSTANTANEOUS: Self = Self { hold_s: 0.0, delay_s: 0.0 };

    /// The mean age of the logged value \[s\]: what the identification has to shift the signal by.
    pub fn mean_delay_s(self) -> f64 {
        self.delay_s + 0.5 * self.hold_s
    }
}

/// Signals as recorded on a uniform grid: one vector per axis, all of one length.
#[derive(Clone, Debug, PartialEq)]
pub struct Signals {
    /// Samples per second \[Hz\].
    pub sample_rate_hz: f64,
    /// Measured position per axis \[rad\], or \[m\] of a prismatic joint.
    pub position_rad: Vec<Vec<f64>>,
    /// Torque per axis \[N·m\], or force \[N\] of a prismatic joint.
    pub torque_nm: Vec<Vec<f64>>,
    /// What the controller was told to reach, in the unit of the position, when it is known.
    pub reference_rad: Option<Vec<Vec<f64>>>,
}

impl Signals {
    /// What a simulated loop logs on the motor side, its reference included.
    pub fn of_motors(record: &Record) -> Self {
        let columns = |matrix: &DMatrix<f64>| -> Vec<Vec<f64>> {
            matrix.column_iter().map(|column| column.iter().copied().collect()).collect()
        };
        Self {
            sample_rate_hz: record.sample_rate_hz,
            position_rad: columns(&record.motor_position_rad),
            torque_nm: columns(&record.motor_torque_nm),
            reference_rad: Some(columns(&record.motor_reference_rad)),
        }
    }
}

/// Joint-side signals of one window on a uniform grid: one row per sample, one column per joint.
///
/// Everything is finite, sizes agree, and the counted samples lie inside: guaranteed by its
/// constructors. Positions are measured at the instants of the grid.
#[derive(Clone, Debug, PartialEq)]
pub struct Experiment {
    sample_rate_hz: f64,
    position_rad: DMatrix<f64>,
    torque_nm: DMatrix<f64>,
    reference_rad: Option<DMatrix<f64>>,
    torque_timing: SignalTiming,
    reference_timing: SignalTiming,
    counted: Range<usize>,
    /// Samples whose rows are not fitted.
    held_out: Vec<Range<usize>>,
}

/// Why signals are no experiment. Axes are named from 1, samples from 0.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum ExperimentError {
    /// The sample rate is not a positive number. Remedy: state the rate of the record in Hz.
    #[error("sample rate of {sample_rate_hz} Hz is not a positive number")]
    SampleRate {
        /// The rate given \[Hz\].
        sample_rate_hz: f64,
    },
    /// Not as many axes as the arm has joints, or beyond [`MAX_JOINTS`]. Remedy: check the columns
    /// of the record against the robot file.
    #[error("the {signal} has {axes} axes where {expected} are expected")]
    Axes {
        /// Which signal.
        signal: &'static str,
        /// Axes it has.
        axes: usize,
        /// Axes it should have.
        expected: usize,
    },
    /// Signals of different length. Remedy: cut them to the same window.
    #[error("the {signal} of axis {axis} has {samples} samples where {expected} are expected")]
    Samples {
        /// Which signal.
        signal: &'static str,
        /// Axis, from 1.
        axis: usize,
        /// Samples it has.
        samples: usize,
        /// Samples of the first position.
        expected: usize,
    },
    /// There is no sample at all. Remedy: record something.
    #[error("the record is empty")]
    Empty,
    /// A value is NaN or infinite. Remedy: cut the record there; a filter would spread the hole.
    #[error("the {signal} of axis {axis} is {value} at sample {sample}")]
    NotFinite {
        /// Which signal.
        signal: &'static str,
        /// Axis, from 1.
        axis: usize,
        /// Sample, from 0.
        sample: usize,
        /// The value found.
        value: f64,
    },
    /// A time of validity is not finite, a hold is negative, or the shift exceeds the record.
    /// Remedy: state both in seconds; a hold is usually one sample period.
    #[error(
        "a {signal} held for {} s and delayed by {} s is impossible in this record; \
         both are seconds, a hold is usually one sample period", timing.hold_s, timing.delay_s
    )]
    Timing {
        /// Which signal.
        signal: &'static str,
        /// The timing given.
        timing: SignalTiming,
    },
    /// The counted samples are none, or not all in the record. Remedy: a non-empty part of
    /// `0..samples`.
    #[error("samples {} to {} are not a part of the record's {samples} samples", counted.start, counted.end)]
    Counted {
        /// The range given.
        counted: Range<usize>,
        /// Samples of the record.
        samples: usize,
    },
}

impl Experiment {
    /// An experiment from joint-side signals. Every signal describes its instant and every sample
    /// counts until [`with_torque_timing`](Self::with_torque_timing) and
    /// [`with_counted`](Self::with_counted) say otherwise.
    ///
    /// # Errors
    /// Every [`ExperimentError`] but `Timing` and `Counted`.
    pub fn joint_side(signals: &Signals) -> Result<Self, ExperimentError> {
        let sample_rate_hz = signals.sample_rate_hz;
        if !(sample_rate_hz.is_finite() && sample_rate_hz > 0.0) {
            return Err(ExperimentError::SampleRate { sample_rate_hz });
        }
        let axes = signals.position_rad.len();
        if !(1..=MAX_JOINTS).contains(&axes) {
            let expected = axes.clamp(1, MAX_JOINTS);
            return Err(ExperimentError::Axes { signal: "position", axes, expected });
        }
        let samples = signals.position_rad.first().map_or(0, Vec::len);
        if samples == 0 {
            return Err(ExperimentError::Empty);
        }
        let matrix = |signal, columns: &[Vec<f64>]| to_matrix(signal, columns, axes, samples);
        let reference = signals.reference_rad.as_deref();
        Ok(Self {
            sample_rate_hz,
            position_rad: matrix("position", &signals.position_rad)?,
            torque_nm: matrix("torque", &signals.torque_nm)?,
            reference_rad: reference.map(|columns| matrix("reference", columns)).transpose()?,
            torque_timing: SignalTiming::INSTANTANEOUS,
            reference_timing: SignalTiming::INSTANTANEOUS,
            counted: 0..samples,
            held_out: Vec::new(),
        })
    }

    /// An experiment from motor-side signals: positions by R⁻¹, torques by Rᵀ.
    ///
    /// # Errors
    /// As [`joint_side`](Self::joint_side), and [`ExperimentError::Axes`] when the transmission has
    /// another number of motors.
    pub fn motor_side(
        signals: &Signals,
        transmission: &Transmission,
    ) -> Result<Self, ExperimentError> {
        let mut experiment = Self::joint_side(signals)?;
        let (axes, expected) = (experiment.joints(), transmission.row(0).len());
        if axes != expected {
            return Err(ExperimentError::Axes { signal: "position", axes, expected });
        }
        let position = |motor: &[f64], joint: &mut [f64]| transmission.joint_position(motor, joint);
        map_samples(&mut experiment.position_rad, position);
        if let Some(reference) = &mut experiment.reference_rad {
            map_samples(reference, position);
        }
        map_samples(&mut experiment.torque_nm, |motor, joint| {
            transmission.joint_torque(motor, joint);
        });
        // A huge finite value may have overflowed.
        check_finite("position", &experiment.position_rad)?;
        check_finite("torque", &experiment.torque_nm)?;
        experiment.reference_rad.iter().try_for_each(|r| check_finite("reference", r))?;
        Ok(experiment)
    }

    /// States when a logged torque acts.
    ///
    /// # Errors
    /// [`ExperimentError::Timing`].
    pub fn with_torque_timing(mut self, timing: SignalTiming) -> Result<Self, ExperimentError> {
        self.check_timing("torque", timing)?;
        self.torque_timing = timing;
        Ok(self)
    }

    /// States when a logged reference acts.
    ///
    /// # Errors
    /// [`ExperimentError::Timing`].
    pub fn with_reference_timing(mut self, timing: SignalTiming) -> Result<Self, ExperimentError> {
        self.check_timing("reference", timing)?;
        self.reference_timing = timing;
        Ok(self)
    }

    /// States which samples may become rows of the observation matrix. All samples are filtered,
    /// so that the ends of the counted part have neighbours.
    ///
    /// # Errors
    /// [`ExperimentError::Counted`].
    pub fn with_counted(mut self, counted: Range<usize>) -> Result<Self, ExperimentError> {
        let samples = self.samples();
        if counted.is_empty() || counted.end > samples {
            return Err(ExperimentError::Counted { counted, samples });
        }
        self.counted = counted;
        Ok(self)
    }

    /// Holds samples out: they pass the filters as the others do, and their rows enter no equation,
    /// of whatever method. The filters reach over some ten rows, so `samples` should have so many
    /// more at either end than what is to be predicted.
    ///
    /// The rows before and after are taken for neighbours where residuals are judged: at one place per
    /// range, a few products of an autocorrelation are of rows that are far apart.
    ///
    /// # Errors
    /// [`ExperimentError::Counted`] when they are not in the record.
    pub fn with_held_out(mut self, samples: Range<usize>) -> Result<Self, ExperimentError> {
        if samples.is_empty() || samples.end > self.samples() {
            return Err(ExperimentError::Counted { counted: samples, samples: self.samples() });
        }
        self.held_out.push(samples);
        Ok(self)
    }

    /// Whether the row of a sample is not fitted.
    pub(crate) fn is_held_out(&self, sample: usize) -> bool {
        self.held_out.iter().any(|range| range.contains(&sample))
    }

    /// Whether any samples are held out.
    pub(crate) fn has_held_out(&self) -> bool {
        !self.held_out.is_empty()
    }

    /// Number of joints.
    pub fn joints(&self) -> usize {
        self.position_rad.ncols()
    }

    /// Number of samples, counted or not.
    pub fn samples(&self) -> usize {
        self.position_rad.nrows()
    }

    /// Samples per second \[Hz\].
    pub fn sample_rate_hz(&self) -> f64 {
        self.sample_rate_hz
    }

    /// Measured joint positions, samples × joints \[rad or m\].
    pub fn position_rad(&self) -> &DMatrix<f64> {
        &self.position_rad
    }

    /// Joint torques as logged, samples × joints \[N·m or N\]; when they act, says
    /// [`torque_timing`](Self::torque_timing).
    pub fn torque_nm(&self) -> &DMatrix<f64> {
        &self.torque_nm
    }

    /// Joint references as logged, samples × joints \[rad or m\], when they are known.
    pub fn reference_rad(&self) -> Option<&DMatrix<f64>> {
        self.reference_rad.as_ref()
    }

    /// When a logged torque acts.
    pub fn torque_timing(&self) -> SignalTiming {
        self.torque_timing
    }

    /// When a logged reference acts.
    pub fn reference_timing(&self) -> SignalTiming {
        self.reference_timing
    }

    /// The samples that may become rows of the observation matrix.
    pub fn counted(&self) -> Range<usize> {
        self.counted.clone()
    }

    fn check_timing(
        &self,
        signal: &'static str,
        timing: SignalTiming,
    ) -> Result<(), ExperimentError> {
        let duration = self.samples() as f64 / self.sample_rate_hz;
        let shift = timing.mean_delay_s();
        if timing.hold_s >= 0.0 && timing.hold_s <= duration && shift.abs() <= duration {
            Ok(())
        } else {
            Err(ExperimentError::Timing { signal, timing })
        }
    }
}

fn to_matrix(
    signal: &'static str,
    columns: &[Vec<f64>],
    axes: usize,
    expected: usize,
) -> Result<DMatrix<f64>, ExperimentError> {
    if columns.len() != axes {
        return Err(ExperimentError::Axes { signal, axes: columns.len(), expected: axes });
    }
    for (axis, column) in (1..).zip(columns) {
        let samples = column.len();
        if samples != expected {
            return Err(ExperimentError::Samples { signal, axis, samples, expected });
        }
    }
    let matrix = DMatrix::from_vec(expected, axes, columns.concat());
    check_finite(signal, &matrix)?;
    Ok(matrix)
}

fn check_finite(signal: &'static str, matrix: &DMatrix<f64>) -> Result<(), ExperimentError> {
    for (axis, column) in (1..).zip(matrix.column_iter()) {
        if let Some((sample, &value)) = column.iter().enumerate().find(|(_, v)| !v.is_finite()) {
            return Err(ExperimentError::NotFinite { signal, axis, sample, value });
        }
    }
    Ok(())
}

/// Replaces every row by its image.
fn map_samples(signals: &mut DMatrix<f64>, map: impl Fn(&[f64], &mut [f64])) {
    let joints = signals.ncols();
    let (mut from, mut to) = ([0.0; MAX_JOINTS], [0.0; MAX_JOINTS]);
    for mut row in signals.row_iter_mut() {
        for (value, from) in row.iter().zip(&mut from) {
            *from = *value;
        }
        map(&from[..joints], &mut to[..joints]);
        for (value, to) in row.iter_mut().zip(&to) {
            *value = *to;
        }
    }
}
