//! Recorded signals, and the times at which each is valid.

use core::ops::Range;
use std::borrow::Cow;

use nalgebra::{DMatrix, DVectorViewMut};

use super::experiment_error::ExperimentError;
use crate::signal::{delay_linear, difference_neighbours};
use didim_dynamics::MAX_JOINTS;
use didim_dynamics::SignalTiming;
use didim_dynamics::Signals;
use didim_dynamics::robot::Transmission;

/// One recording in an experiment.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Recording {
    /// Its samples.
    pub(crate) samples: Range<usize>,
    /// The samples that may become rows, a subset of `samples`.
    pub(crate) counted_samples: Range<usize>,
}

/// Time from the stamp of a signal to the instant at which it is valid, for each axis; negative if
/// it is logged late \[s\]. Empty if there are none.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SignalDelays {
    /// Those of the positions.
    pub position_s: Vec<f64>,
    /// Those of the torques, in addition to their timing.
    pub torque_s: Vec<f64>,
}

/// Joint-side signals on a uniform grid, of one recording or of several that follow each other: one
/// row per sample, one column per joint.
///
/// The constructors guarantee finite values, equal sizes and counted samples inside the record.
/// Positions are measured at the instants of the grid. No filter crosses the boundary between two
/// recordings.
#[derive(Clone, Debug, PartialEq)]
pub struct Experiment {
    sample_rate_hz: f64,
    position_rad: DMatrix<f64>,
    torque_nm: DMatrix<f64>,
    reference_rad: Option<DMatrix<f64>>,
    torque_timing: SignalTiming,
    reference_timing: SignalTiming,
    /// The recordings, in the order of their samples and without gaps; at least one.
    recordings: Vec<Recording>,
    /// Samples whose rows are not fitted.
    held_out: Vec<Range<usize>>,
}

impl Experiment {
    /// Creates an experiment from joint-side signals. Every signal is valid at its sample instant
    /// and every sample counts, unless [`with_torque_timing`](Self::with_torque_timing) and
    /// [`with_counted`](Self::with_counted) set something else. Owned signals are freed one by one,
    /// so that memory never holds two copies of all signals.
    ///
    /// # Errors
    /// Every [`ExperimentError`] but `Timing` and `Counted`.
    pub fn joint_side<'s>(signals: impl Into<Cow<'s, Signals>>) -> Result<Self, ExperimentError> {
        let signals = signals.into();
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
        let [position, torque, reference] = match signals {
            Cow::Borrowed(of) => [
                Some(Cow::Borrowed(of.position_rad.as_slice())),
                Some(Cow::Borrowed(of.torque_nm.as_slice())),
                of.reference_rad.as_deref().map(Cow::Borrowed),
            ],
            Cow::Owned(Signals { position_rad, torque_nm, reference_rad, .. }) => {
                [Some(position_rad), Some(torque_nm), reference_rad].map(|of| of.map(Cow::Owned))
            }
        };
        let matrix = |signal, columns: Option<Cow<'_, [Vec<f64>]>>| {
            columns.map(|columns| to_matrix(signal, columns, axes, samples)).transpose()
        };
        Ok(Self {
            sample_rate_hz,
            position_rad: matrix("position", position)?.unwrap_or_default(),
            torque_nm: matrix("torque", torque)?.unwrap_or_default(),
            reference_rad: matrix("reference", reference)?,
            torque_timing: SignalTiming::INSTANTANEOUS,
            reference_timing: SignalTiming::INSTANTANEOUS,
            recordings: vec![Recording { samples: 0..samples, counted_samples: 0..samples }],
            held_out: Vec::new(),
        })
    }

    /// Creates an experiment from motor-side signals. R⁻¹ transforms the positions and Rᵀ the
    /// torques.
    ///
    /// # Errors
    /// Those of [`joint_side`](Self::joint_side), and [`ExperimentError::Axes`] if the transmission
    /// has another number of motors.
    pub fn motor_side<'s>(
        signals: impl Into<Cow<'s, Signals>>,
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
        // The transmission may overflow huge finite values.
        check_finite("position", &experiment.position_rad)?;
        check_finite("torque", &experiment.torque_nm)?;
        experiment.reference_rad.iter().try_for_each(|r| check_finite("reference", r))?;
        Ok(experiment)
    }

    /// Returns the first recordings, at most up to this number of samples after the first counted
    /// sample. The last of them may be truncated.
    #[must_use]
    pub(crate) fn first_samples(&self, samples: usize) -> Self {
        let limit =
            self.recordings.first().map_or(0, |first| first.counted_samples.start) + samples;
        let mut recordings: Vec<Recording> = Vec::new();
        for Recording { samples: own, counted_samples: counted } in &self.recordings {
            // A recording that crosses the limit is cut there if the earlier ones have less than
            // half of the samples; otherwise it is left out.
            let few = recordings.last().is_none_or(|last| 2 * last.samples.end < limit);
            if own.end > limit && !few {
                break;
            }
            let before = |range: &Range<usize>| range.start.min(limit)..range.end.min(limit);
            recordings.push(Recording { samples: before(own), counted_samples: before(counted) });
            if own.end >= limit {
                break;
            }
        }
        let end = recordings.last().map_or(0, |last| last.samples.end);
        let rows = |of: &DMatrix<f64>| of.rows(0, end).into_owned();
        Self {
            position_rad: rows(&self.position_rad),
            torque_nm: rows(&self.torque_nm),
            reference_rad: self.reference_rad.as_ref().map(rows),
            held_out: self.held_out.iter().filter(|range| range.end <= end).cloned().collect(),
            recordings,
            ..*self
        }
    }

    /// Returns the means of each `count` successive samples of a recording, without the reference.
    /// Samples that are left over at its end are left out.
    #[must_use]
    pub(crate) fn means_of(&self, count: usize) -> Self {
        let mut recordings: Vec<Recording> = Vec::new();
        let (mut first_samples, mut samples) = (Vec::new(), 0);
        for Recording { samples: own, counted_samples: counted } in &self.recordings {
            let means = own.len() / count;
            first_samples.extend((0..means).map(|k| own.start + k * count));
            let start = samples + (counted.start - own.start).div_ceil(count).min(means);
            let end = samples + (counted.end - own.start) / count;
            recordings.push(Recording {
                samples: samples..samples + means,
                counted_samples: start.min(end)..end,
            });
            samples += means;
        }
        let mean_at = |sample: usize| first_samples.partition_point(|of| of + count <= sample);
        let held_out =
            self.held_out.iter().map(|of| mean_at(of.start)..mean_at(of.end + count - 1));
        Self {
            sample_rate_hz: self.sample_rate_hz / count as f64,
            position_rad: means_from(&self.position_rad, &first_samples, count),
            torque_nm: means_from(&self.torque_nm, &first_samples, count),
            reference_rad: None,
            held_out: held_out.collect(),
            recordings,
            ..*self
        }
    }

    /// Changes the positions, and the torques, of all joints (samples × joints).
    pub(crate) fn change_signals(
        &mut self,
        positions: impl FnOnce(&mut DMatrix<f64>),
        torques: impl FnOnce(&mut DMatrix<f64>),
    ) {
        positions(&mut self.position_rad);
        torques(&mut self.torque_nm);
    }

    /// Undoes a first-order low-pass of this time constant \[s\] in a signal of all samples, each
    /// recording separately.
    pub(crate) fn undo_low_pass(&self, mut signal: DVectorViewMut<'_, f64>, time_constant_s: f64) {
        let logged = signal.clone_owned();
        for Range { start, end } in self.recordings.iter().map(|of| of.samples.clone()) {
            for k in start..end {
                let (one, other, rate) =
                    difference_neighbours(k - start, end - start, self.sample_rate_hz);
                let change = logged[start + other] - logged[start + one];
                signal[k] += time_constant_s * rate * change;
            }
        }
    }

    /// Undoes a delay \[samples\] of a signal of all samples, each recording separately. The last
    /// samples, whose values were not recorded, continue at the mean rate of the ones before.
    pub(crate) fn undo_delay(&self, mut signal: DVectorViewMut<'_, f64>, delay: f64) {
        let unknown = whole_samples(delay);
        for Range { start, end } in self.recordings.iter().map(|of| of.samples.clone()) {
            let mut part = signal.rows_range_mut(start..end);
            let logged = part.clone_owned();
            // Signals and delays are finite.
            if let Ok(earlier) = delay_linear(logged.as_slice(), -delay) {
                part.copy_from_slice(&earlier);
            }
            let count = logged.len();
            if unknown == 0 || count < 2 * unknown {
                continue;
            }
            let rate = (logged[count - 1] - logged[count - 1 - unknown]) / unknown as f64;
            for k in count - unknown..count {
                part[k] = logged[count - 1] + (k as f64 + delay - (count - 1) as f64) * rate;
            }
        }
    }

    /// Leaves the last samples of each recording out that have no values after a delay
    /// \[samples\] is undone.
    pub(crate) fn leave_out_delayed(&mut self, delay: f64) {
        for Recording { samples, counted_samples: counted } in &mut self.recordings {
            let end = samples.end.saturating_sub(whole_samples(delay));
            counted.end = counted.end.min(end).max(counted.start);
        }
    }

    /// Sets the times at which a logged torque acts.
    ///
    /// # Errors
    /// [`ExperimentError::Timing`].
    pub fn with_torque_timing(mut self, timing: SignalTiming) -> Result<Self, ExperimentError> {
        self.check_timing("torque", timing)?;
        self.torque_timing = timing;
        Ok(self)
    }

    /// Sets the times at which a logged reference acts.
    ///
    /// # Errors
    /// [`ExperimentError::Timing`].
    pub fn with_reference_timing(mut self, timing: SignalTiming) -> Result<Self, ExperimentError> {
        self.check_timing("reference", timing)?;
        self.reference_timing = timing;
        Ok(self)
    }

    /// Shifts the signals in time by the delays of their sources. The samples at the ends that then
    /// have no value do not count. `transmission` is that of motor-side delays.
    ///
    /// # Errors
    /// [`ExperimentError::Axes`] if the delays are those of another number of axes.
    pub fn with_signal_delays(
        mut self,
        delays: &SignalDelays,
        transmission: Option<&Transmission>,
    ) -> Result<Self, ExperimentError> {
        let (expected, rate_hz) = (self.joints(), self.sample_rate_hz);
        for (signal, of) in [("position", &delays.position_s), ("torque", &delays.torque_s)] {
            if !of.is_empty() && of.len() != expected {
                return Err(ExperimentError::Axes { signal, axes: of.len(), expected });
            }
        }
        let all = || delays.position_s.iter().chain(&delays.torque_s).map(|of| of * rate_hz);
        let [latest, earliest] =
            [all().fold(0.0, f64::max), all().fold(0.0, |most, of| most.max(-of))];
        if latest <= 0.0 && earliest <= 0.0 {
            return Ok(self);
        }
        let logged = self.clone();
        let shift = |signals: &mut DMatrix<f64>, of: &[f64]| {
            for (column, delay_s) in signals.column_iter_mut().zip(of) {
                logged.undo_delay(column, -delay_s * rate_hz);
            }
        };
        let [of_positions, of_torques] = [&delays.position_s, &delays.torque_s];
        match transmission {
            Some(transmission) => self.change_signals(
                |positions| {
                    change_motor_positions(positions, transmission, |of| shift(of, of_positions));
                },
                |torques| change_motor_torques(torques, transmission, |of| shift(of, of_torques)),
            ),
            None => self.change_signals(|of| shift(of, of_positions), |of| shift(of, of_torques)),
        }
        self.leave_out_delayed(earliest);
        for Recording { samples, counted_samples: counted } in &mut self.recordings {
            let start = samples.start + whole_samples(latest);
            counted.start = counted.start.max(start).min(counted.end);
        }
        Ok(self)
    }

    /// Joins several recordings of one arm into one experiment; each keeps its counted samples.
    /// References are kept if all recordings have them.
    ///
    /// # Errors
    /// [`ExperimentError::Empty`] without recordings, [`ExperimentError::Different`] if one has
    /// another sample rate, number of joints or timing than the first.
    pub fn join(recordings: &[Self]) -> Result<Self, ExperimentError> {
        let first = recordings.first().ok_or(ExperimentError::Empty)?;
        for (recording, other) in (1..).zip(recordings).skip(1) {
            let different = |what| Err(ExperimentError::Different { recording, what });
            if other.joints() != first.joints() {
                return different("number of joints");
            }
            if (other.sample_rate_hz / first.sample_rate_hz - 1.0).abs() > SAME_RATE {
                return different("sample rate");
            }
            let timing = |of: &Self| (of.torque_timing, of.reference_timing);
            if timing(other) != timing(first) {
                return different("timing");
            }
        }
        let stacked = |signal: &dyn Fn(&Self) -> Option<&DMatrix<f64>>| -> Option<DMatrix<f64>> {
            let parts = recordings.iter().map(signal).collect::<Option<Vec<_>>>()?;
            let samples = parts.iter().map(|part| part.nrows()).sum();
            let mut joined_rows = DMatrix::zeros(samples, first.joints());
            let mut next = 0;
            for part in parts {
                joined_rows.rows_mut(next, part.nrows()).copy_from(part);
                next += part.nrows();
            }
            Some(joined_rows)
        };
        let mut joined = first.clone();
        joined.reference_rad = stacked(&|of| of.reference_rad.as_ref());
        joined.position_rad = stacked(&|of| Some(&of.position_rad)).unwrap_or_default();
        joined.torque_nm = stacked(&|of| Some(&of.torque_nm)).unwrap_or_default();
        (joined.recordings, joined.held_out) = (Vec::new(), Vec::new());
        let mut start = 0;
        for part in recordings {
            let shifted = |range: &Range<usize>| start + range.start..start + range.end;
            joined.recordings.extend(part.recordings.iter().map(|of| Recording {
                samples: shifted(&of.samples),
                counted_samples: shifted(&of.counted_samples),
            }));
            joined.held_out.extend(part.held_out.iter().map(shifted));
            start += part.samples();
        }
        Ok(joined)
    }

    /// Sets the samples that may become rows of the observation matrix. All samples are filtered,
    /// so that the filters have neighbours at the ends of the counted part. Joined recordings have
    /// their own ranges.
    ///
    /// # Errors
    /// [`ExperimentError::Counted`].
    pub fn with_counted(mut self, counted: Range<usize>) -> Result<Self, ExperimentError> {
        let samples = self.samples();
        if counted.is_empty() || counted.end > samples || self.recordings.len() > 1 {
            return Err(ExperimentError::Counted { counted, samples });
        }
        self.recordings[0].counted_samples = counted;
        Ok(self)
    }

    /// Holds samples out. They pass the filters like all others, but their rows are not fitted by
    /// any method. The filters reach over about ten rows, so `samples` should extend that far
    /// beyond the predicted part at either end.
    ///
    /// The residual tests treat the rows before and after the range as neighbours. So a few
    /// products of an autocorrelation per range belong to rows that are far from each other.
    ///
    /// # Errors
    /// [`ExperimentError::Counted`] if the samples are not in the record.
    pub fn with_held_out(mut self, samples: Range<usize>) -> Result<Self, ExperimentError> {
        if samples.is_empty() || samples.end > self.samples() {
            return Err(ExperimentError::Counted { counted: samples, samples: self.samples() });
        }
        self.held_out.push(samples);
        Ok(self)
    }

    /// Returns true if the row of a sample is not fitted.
    pub(crate) fn is_held_out(&self, sample: usize) -> bool {
        self.held_out.iter().any(|range| range.contains(&sample))
    }

    /// Returns true if any samples are held out.
    pub(crate) fn has_held_out(&self) -> bool {
        !self.held_out.is_empty()
    }

    /// Returns the number of joints.
    pub fn joints(&self) -> usize {
        self.position_rad.ncols()
    }

    /// Returns the number of samples, counted or not.
    pub fn samples(&self) -> usize {
        self.position_rad.nrows()
    }

    /// Returns the sample rate \[Hz\].
    pub fn sample_rate_hz(&self) -> f64 {
        self.sample_rate_hz
    }

    /// Returns the measured joint positions, samples × joints \[rad or m\].
    pub fn position_rad(&self) -> &DMatrix<f64> {
        &self.position_rad
    }

    /// Returns the joint torques as logged, samples × joints \[N·m or N\]. They act at the times
    /// that [`torque_timing`](Self::torque_timing) returns.
    pub fn torque_nm(&self) -> &DMatrix<f64> {
        &self.torque_nm
    }

    /// Returns the joint references as logged, samples × joints \[rad or m\]; `None` if they were
    /// not recorded.
    pub fn reference_rad(&self) -> Option<&DMatrix<f64>> {
        self.reference_rad.as_ref()
    }

    /// Returns the times at which a logged torque acts.
    pub fn torque_timing(&self) -> SignalTiming {
        self.torque_timing
    }

    /// Returns the times at which a logged reference acts.
    pub fn reference_timing(&self) -> SignalTiming {
        self.reference_timing
    }

    /// Returns the samples that may become rows of the observation matrix. For several recordings,
    /// the range goes from the first counted sample of the first to the last counted sample of the
    /// last.
    pub fn counted(&self) -> Range<usize> {
        let [first, last] = [self.recordings.first(), self.recordings.last()];
        first.map_or(0, |of| of.counted_samples.start)..last.map_or(0, |of| of.counted_samples.end)
    }

    /// Returns the counted samples of each recording in turn.
    pub(crate) fn counted_samples(&self) -> impl Iterator<Item = usize> {
        self.recordings.iter().flat_map(|of| of.counted_samples.clone())
    }

    /// Returns the recordings; most experiments have one.
    pub(crate) fn recordings(&self) -> &[Recording] {
        &self.recordings
    }

    /// Returns the end \[samples\] of each recording, including the last.
    pub(crate) fn ends(&self) -> Vec<usize> {
        self.recordings.iter().map(|of| of.samples.end).collect()
    }

    /// Returns the index of the recording that contains a sample.
    pub(crate) fn recording_of(&self, sample: usize) -> usize {
        self.recordings.partition_point(|of| of.samples.end <= sample)
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

/// Relative difference up to which two sample rates are equal, because times in a file are rounded.
const SAME_RATE: f64 = 3e-4;

fn to_matrix(
    signal: &'static str,
    columns: Cow<'_, [Vec<f64>]>,
    axes: usize,
    expected: usize,
) -> Result<DMatrix<f64>, ExperimentError> {
    if columns.len() != axes {
        return Err(ExperimentError::Axes { signal, axes: columns.len(), expected: axes });
    }
    for (axis, column) in (1..).zip(columns.iter()) {
        let samples = column.len();
        if samples != expected {
            return Err(ExperimentError::Samples { signal, axis, samples, expected });
        }
    }
    let values = match columns {
        Cow::Borrowed(columns) => columns.concat(),
        Cow::Owned(columns) => {
            let mut values = Vec::with_capacity(axes * expected);
            columns.into_iter().for_each(|column| values.extend(column));
            values
        }
    };
    let matrix = DMatrix::from_vec(expected, axes, values);
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

/// Returns the number of samples in which a delay \[samples\] ends.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a number of samples")]
fn whole_samples(delay: f64) -> usize {
    delay.max(0.0).ceil() as usize
}

/// Changes joint positions, or what transforms like them (samples × joints), as those of the
/// motors.
pub(crate) fn change_motor_positions(
    positions: &mut DMatrix<f64>,
    transmission: &Transmission,
    change: impl FnOnce(&mut DMatrix<f64>),
) {
    map_samples(positions, |joint, motor| transmission.motor_position(joint, motor));
    change(positions);
    map_samples(positions, |motor, joint| transmission.joint_position(motor, joint));
}

/// Returns the means of `count` samples from each of some samples on.
fn means_from(signals: &DMatrix<f64>, first_samples: &[usize], count: usize) -> DMatrix<f64> {
    DMatrix::from_fn(first_samples.len(), signals.ncols(), |k, joint| {
        signals.column(joint).rows_range(first_samples[k]..first_samples[k] + count).mean()
    })
}

/// Changes joint torques (samples × joints) as those of the motors.
pub(crate) fn change_motor_torques(
    torques: &mut DMatrix<f64>,
    transmission: &Transmission,
    change: impl FnOnce(&mut DMatrix<f64>),
) {
    let mut motors = to_motor_torques(core::mem::take(torques), transmission);
    change(&mut motors);
    to_joint_torques(&mut motors, transmission);
    *torques = motors;
}

/// Returns motor torques for those of the joints (samples × joints).
pub(crate) fn to_motor_torques(
    mut torques: DMatrix<f64>,
    transmission: &Transmission,
) -> DMatrix<f64> {
    map_samples(&mut torques, |joint, motor| transmission.motor_torque(joint, motor));
    torques
}

/// Replaces motor torques (samples × motors) by those of the joints.
pub(crate) fn to_joint_torques(torques: &mut DMatrix<f64>, transmission: &Transmission) {
    let (samples, axes) = torques.shape();
    let mut joints = DMatrix::zeros(samples, axes);
    for (motor, torque) in torques.column_iter().enumerate() {
        for (joint, ratio) in transmission.row(motor).iter().enumerate() {
            if *ratio != 0.0 {
                joints.column_mut(joint).axpy(*ratio, &torque, 1.0);
            }
        }
    }
    *torques = joints;
}

/// Replaces every row by the result of `map`.
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

#[cfg(test)]
mod tests {
    use super::*;

    /// The left-over sample of the first recording takes no part in the means of the second.
    #[test]
    fn means_stay_within_their_recordings() {
        let recording = |first: f64, samples: usize, counted: Range<usize>| {
            let ramp = |axis: f64| (0..samples).map(|k| first + axis + k as f64).collect();
            let (position_rad, torque_nm) = (vec![ramp(0.0)], vec![ramp(0.5)]);
            let signals =
                Signals { sample_rate_hz: 100.0, position_rad, torque_nm, reference_rad: None };
            Experiment::joint_side(&signals).unwrap().with_counted(counted).unwrap()
        };
        let recordings = [recording(0.0, 7, 1..7), recording(100.0, 9, 3..8)];
        let joined = Experiment::join(&recordings).unwrap().with_held_out(10..12).unwrap();
        let means = joined.means_of(3);
        assert!((means.sample_rate_hz - 100.0 / 3.0).abs() < 1e-12);
        assert_eq!(means.position_rad.as_slice(), [1.0, 4.0, 101.0, 104.0, 107.0]);
        assert_eq!(means.torque_nm.as_slice(), [1.5, 4.5, 101.5, 104.5, 107.5]);
        let counted: Vec<_> =
            means.recordings.iter().map(|of| of.counted_samples.clone()).collect();
        assert_eq!(counted, [1..2, 3..4]);
        assert!(means.held_out.iter().eq([&(3..4)]), "{:?}", means.held_out);
    }

    /// A sine behind a low-pass lags by atan(ωT), and is √(1 + ω²T²) times smaller, whichever
    /// recording it is of.
    #[test]
    fn what_a_low_pass_made_of_signals_is_undone() {
        let (rate_hz, time_constant_s, speed) = (1000.0, 0.05, 12.0);
        let passed: f64 = speed * time_constant_s;
        let signal = |lag: f64, size: f64| -> Vec<Vec<f64>> {
            let position_of = |offset: f64| {
                move |k: i32| offset + size * (speed * f64::from(k) / rate_hz - lag).sin()
            };
            [1.0, -3.0].map(|offset| (0..400).map(position_of(offset)).collect()).to_vec()
        };
        let experiment = |lag: f64, size: f64| {
            let (position_rad, torque_nm) = (signal(lag, size), signal(lag, size));
            let signals =
                Signals { sample_rate_hz: rate_hz, position_rad, torque_nm, reference_rad: None };
            let recording = Experiment::joint_side(&signals).unwrap();
            Experiment::join(&[recording.clone(), recording]).unwrap()
        };
        let logged = experiment(passed.atan(), 1.0 / passed.hypot(1.0));
        let (mut found, before) = (logged.clone(), experiment(0.0, 1.0));
        let undo = |signal: &mut DMatrix<f64>| {
            for axis in signal.column_iter_mut() {
                logged.undo_low_pass(axis, time_constant_s);
            }
        };
        found.change_signals(undo, undo);
        let difference = |one: &DMatrix<f64>, other: &DMatrix<f64>| {
            let inside = (one - other).remove_rows_at(&[0, 399, 400, 799]);
            inside.amax()
        };
        assert!(difference(&logged.torque_nm, &before.torque_nm) > 0.4);
        assert!(difference(&found.torque_nm, &before.torque_nm) < 1e-4);
        assert!(difference(&found.position_rad, &before.position_rad) < 1e-4);
    }
}
