//! Data received in one bus cycle until now.

use didim_dynamics::{JointSample, MAX_JOINTS};

use super::arrived::{ArrivedValues, InterpolationSpan};
use super::losses::CycleCause;
use super::values::{References, Values, index_bit, is_enabled};
use crate::layout::{CompiledLayout, Role};
use crate::units::Scales;

/// One cycle, from its SYNC until the decision about it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Cycle {
    pub(super) stamp_ns: u64,
    pub(super) sequence: u64,
    pub(super) values: Values,
    pub(super) references: References,
    /// Received messages, one bit for each index of a message.
    pub(super) messages: u64,
    /// Number of frames in the cycle, without those that carried only references.
    pub(super) frames: u64,
    /// Messages that were missing in the previous cycle, one bit for each index of a message.
    pub(super) missing_before: u64,
    /// True if a frame arrived so late in the cycle that it may belong to the next one.
    pub(super) is_doubtful: bool,
    /// First values in this cycle of the signals that are valid at the arrival of their frames, and
    /// the latest values from before the SYNC of the cycle.
    pub(super) first_arrivals: ArrivedValues,
    pub(super) previous_arrivals: ArrivedValues,
    /// Cause that makes the cycle lose its sample; the first one in the order of [`CycleCause`].
    pub(super) fault: Option<CycleCause>,
}

/// Bits of the messages and of the references that make a cycle complete.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct CompleteMask {
    /// Messages that a cycle needs, one bit for each index of a message.
    messages: u64,
    /// Axes that need a reference, one bit for each axis: all axes if the layout has a reference,
    /// otherwise none.
    axes: u64,
}

impl CompleteMask {
    pub(super) fn new(layout: &CompiledLayout) -> Self {
        let messages = layout.messages().iter().enumerate();
        Self {
            messages: messages
                .filter(|(_, message)| message.role == Role::Sample)
                .fold(0, |bits, (index, _)| bits | index_bit(index)),
            axes: if layout.has_reference() { index_bit(layout.axes()) - 1 } else { 0 },
        }
    }

    pub(super) fn missing_messages(&self, cycle: &Cycle) -> u64 {
        self.messages & !cycle.messages
    }
}

impl Cycle {
    /// Returns true if no drive is enabled.
    pub(super) fn is_idle(&self, axes: usize) -> bool {
        self.values.status_word.iter().take(axes).all(|word| !is_enabled(*word))
    }

    /// Returns the sample of this cycle in SI units, regardless of earlier cycles. Signals that are
    /// valid at the arrival of their frames are interpolated over at most `reach_ns`.
    ///
    /// # Errors
    /// Returns the cause that makes the cycle lose its sample.
    pub(super) fn sample(
        &self,
        complete: CompleteMask,
        axes: usize,
        scales: &Scales,
        reach_ns: Option<u64>,
    ) -> Result<JointSample, CycleCause> {
        if complete.missing_messages(self) != 0 {
            return Err(CycleCause::MissingAxis);
        }
        if let Some(fault) = self.fault {
            return Err(fault);
        }
        if let Some(reach_ns) = reach_ns {
            return self.sample_of_arrivals(complete, axes, scales, reach_ns);
        }
        let mut sample = JointSample::zero(self.sequence, self.stamp_ns);
        sample.has_reference = complete.axes != 0 && self.references.axes == complete.axes;
        for axis in 0..axes.min(MAX_JOINTS) {
            let position = scales.position_rad(axis, self.values.position[axis]);
            sample.motor_position_rad[axis] = position;
            sample.motor_torque_nm[axis] = scales.torque_nm(axis, self.values.torque[axis]);
            if sample.has_reference {
                let reference = scales.reference_rad(axis, self.references.value[axis], position);
                sample.motor_reference_rad[axis] = reference;
                sample.has_reference = scales.is_continuous(axis, position, reference);
            }
        }
        if !sample.has_reference {
            sample.motor_reference_rad = [0.0; MAX_JOINTS];
        }
        Ok(sample)
    }

    fn sample_of_arrivals(
        &self,
        complete: CompleteMask,
        axes: usize,
        scales: &Scales,
        reach_ns: u64,
    ) -> Result<JointSample, CycleCause> {
        let (before, after) = (&self.previous_arrivals, &self.first_arrivals);
        // Interpolates between two values of a signal, each with its arrival time, to the instant
        // of the sample.
        let between = |(from, before_ns): (f64, Option<u64>),
                       (to, after_ns): (f64, Option<u64>)| {
            let span =
                InterpolationSpan { instant_ns: self.stamp_ns, before_ns, after_ns, reach_ns };
            span.weight_of_earlier().map(|share| to + (from - to) * share)
        };
        let mut sample = JointSample::zero(self.sequence, self.stamp_ns);
        sample.has_reference = complete.axes != 0 && after.references.axes == complete.axes;
        for axis in 0..axes.min(MAX_JOINTS) {
            let position_of = |arrived: &ArrivedValues| {
                let position_rad = scales.position_rad(axis, arrived.values.position[axis]);
                (position_rad, arrived.position_ns[axis])
            };
            let position =
                between(position_of(before), position_of(after)).ok_or(CycleCause::MissingAxis)?;
            if before.position_ns[axis].is_some()
                && !scales.is_continuous(axis, position_of(before).0, position_of(after).0)
            {
                return Err(CycleCause::OutOfRange);
            }
            let torque_of = |arrived: &ArrivedValues| {
                (scales.torque_nm(axis, arrived.values.torque[axis]), arrived.torque_ns[axis])
            };
            let torque =
                between(torque_of(before), torque_of(after)).ok_or(CycleCause::MissingAxis)?;
            sample.motor_position_rad[axis] = position;
            sample.motor_torque_nm[axis] = torque;
            let reference_of = |ArrivedValues { references, .. }: &ArrivedValues| {
                let is_there = references.axes & index_bit(axis) != 0;
                let stamp_ns = is_there.then_some(references.stamp_ns[axis]);
                (scales.reference_rad(axis, references.value[axis], position), stamp_ns)
            };
            match between(reference_of(before), reference_of(after))
                .filter(|_| sample.has_reference)
            {
                Some(reference) if scales.is_continuous(axis, position, reference) => {
                    sample.motor_reference_rad[axis] = reference;
                }
                _ => sample.has_reference = false,
            }
        }
        if !sample.has_reference {
            sample.motor_reference_rad = [0.0; MAX_JOINTS];
        }
        Ok(sample)
    }
}
