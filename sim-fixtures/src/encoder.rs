//! Conversion of motor-side values to the frames of one bus cycle.

use didim_drivers::frame::Frame;
use didim_drivers::layout::{
    AxisValues, CompiledLayout, CycleValues, EncodeError, MessagePlan, Quantity, Role, SampledBy,
};
use didim_drivers::units::Scales;
use didim_dynamics::MAX_JOINTS;
use didim_dynamics::Signals;

use crate::CycleReadings;

/// CiA 402 "operation enabled", with the additional bits that a drive in position mode sets.
const OPERATION_ENABLED: u16 = 0x1237;

/// Returns the time that a frame takes on the bus \[ns\]. A classic frame of n bytes has 47 + 8 n
/// bits and some stuff bits. The additional 20 % are between the usual and the largest number of
/// stuff bits. At 1 Mbit/s a bit takes a microsecond.
fn wire_time_ns(frame: &Frame) -> u64 {
    (47 + 8 * u64::from(frame.length)) * 1_200
}

/// Returns the axis of a message, or the lowest axis if the message belongs to several.
pub(crate) fn axis_of(message: &MessagePlan) -> usize {
    message.extractions.iter().map(|signal| signal.axis).min().unwrap_or(0)
}

/// Reason why the frames of a cycle cannot be created.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CycleError {
    /// A value does not fit its signal: the gains of the cell do not fit the arm.
    #[error("{0}; the cell's gains do not fit")]
    Value(#[from] EncodeError),
    /// The bus is too slow: no real bus could carry this layout at this rate.
    #[error(
        "the frames of a cycle take {needed_us} µs on the bus, the cycle has {period_us} µs; \
         lower the rate or send fewer frames"
    )]
    Overrun {
        /// Time of the frames at 1 Mbit/s \[µs\].
        needed_us: f64,
        /// Period of the cycle \[µs\].
        period_us: f64,
    },
}

/// Values that the drives and their controller send in one bus cycle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BusCycle {
    /// Counter of a packed frame.
    pub counter: u64,
    /// Measured motor angle \[rad\].
    pub motor_position_rad: [f64; MAX_JOINTS],
    /// Motor torque \[N·m\].
    pub motor_torque_nm: [f64; MAX_JOINTS],
    /// Reference that is sent in this cycle \[rad\]. If the layout says `next-sync`, it is the
    /// reference of the next cycle.
    pub motor_reference_rad: [f64; MAX_JOINTS],
    /// Additional readings of the drives, such as temperatures.
    pub readings: CycleReadings,
    /// True for each axis that sends its messages with only readings in this cycle.
    pub has_temperature: [bool; MAX_JOINTS],
}

/// Encoder that writes frames as the drives of a cell do: it uses the layout of the cell and
/// inverts its gains.
#[derive(Clone, Debug)]
pub struct CycleEncoder {
    layout: CompiledLayout,
    scales: Scales,
    /// Value of the status word or of the state signal that means an enabled drive.
    enabled_value: u16,
}

impl CycleEncoder {
    /// Creates an encoder for a layout and the gains that decode it.
    pub fn new(layout: CompiledLayout, scales: Scales) -> Self {
        let signal = layout.signal(Quantity::Enabled, 0).map(|_| layout.enabled_value());
        Self { layout, scales, enabled_value: signal.unwrap_or(OPERATION_ENABLED) }
    }

    /// Returns the layout of the frames.
    pub fn layout(&self) -> &CompiledLayout {
        &self.layout
    }

    /// Appends the frames of one cycle, stamped with the times at which a bus would deliver them.
    /// If signals are valid at the arrival of their frames ([`CompiledLayout::at_arrival`]), all
    /// frames have the stamp of the cycle's instant. Every value is rounded to a count of its
    /// signal.
    ///
    /// # Errors
    /// [`CycleError`] if a value does not fit its signal, or the frames do not fit the cycle.
    pub fn encode(
        &self,
        cycle: &BusCycle,
        stamp_ns: u64,
        frames: &mut Vec<Frame>,
    ) -> Result<(), CycleError> {
        let values = self.values(cycle);
        let before = frames.len();
        for role in [Role::Sync, Role::Sample, Role::Target] {
            self.layout.encode(role, &values, stamp_ns, frames)?;
        }
        for message in self.layout.messages().iter().filter(|message| message.role == Role::Reading)
        {
            if cycle.has_temperature[axis_of(message)] {
                frames.push(message.encode(&values, stamp_ns)?);
            }
        }
        // All data of one EtherCAT datagram arrive at once.
        let one_by_one = self.layout.process_data().is_none() && !self.layout.at_arrival();
        if one_by_one && self.layout.sampled_by() == SampledBy::Sync {
            // The arrival of the SYNC is the instant of the sample. The other frames arrive one
            // after the other.
            let mut arrival_ns = stamp_ns;
            for frame in frames.iter_mut().skip(before + 1) {
                arrival_ns += wire_time_ns(frame);
                frame.stamp_ns = arrival_ns;
            }
            self.check_room(arrival_ns - stamp_ns)?;
        }
        Ok(())
    }

    fn check_room(&self, needed_ns: u64) -> Result<(), CycleError> {
        #[expect(clippy::cast_precision_loss, reason = "a cycle is far shorter than 2^52 ns")]
        let needed_us = needed_ns as f64 * 1e-3;
        let period_us = self.layout.period_ns() * 1e-3;
        if needed_us >= period_us {
            return Err(CycleError::Overrun { needed_us, period_us });
        }
        Ok(())
    }

    /// Returns the messages of a cycle, as indices in the layout, in their order of arrival on a
    /// bus without SYNC. Each has its arrival time after the first message \[ns\]. The first
    /// message marks the cycle. The command and the reply of each axis follow. The last messages
    /// carry only readings.
    ///
    /// # Errors
    /// [`CycleError::Overrun`].
    pub(crate) fn arrival_times(&self) -> Result<Vec<(usize, u64)>, CycleError> {
        let messages = self.layout.messages();
        let mut order: Vec<usize> = (0..messages.len()).collect();
        order.sort_by_key(|index| {
            let message = &messages[*index];
            let seldom = message.role == Role::Reading;
            (seldom, message.role != Role::Sync, axis_of(message), message.role != Role::Target)
        });
        let mut arrival_ns = 0;
        let mut arrivals = Vec::with_capacity(order.len());
        for (place, index) in order.into_iter().enumerate() {
            let frame = messages[index].encode(&CycleValues::default(), 0)?;
            arrival_ns += if place == 0 { 0 } else { wire_time_ns(&frame) };
            arrivals.push((index, arrival_ns));
        }
        self.check_room(arrival_ns)?;
        Ok(arrivals)
    }

    /// Returns the values on the bus in a cycle of a motor-side record. The columns of the record
    /// have equal length.
    pub fn cycle_of(&self, record: &Signals, cycle: usize) -> BusCycle {
        let take = |columns: &[Vec<f64>], cycle: usize| {
            let mut values = [0.0; MAX_JOINTS];
            for (value, column) in values.iter_mut().zip(columns) {
                *value = column[cycle];
            }
            values
        };
        // A target that takes effect at the next SYNC is sent one cycle earlier.
        let ahead = usize::from(self.layout.reference_at_next_sync());
        let last = record.position_rad.first().map_or(0, Vec::len).saturating_sub(1);
        let target = (cycle + ahead).min(last);
        let reference = record.reference_rad.as_ref();
        BusCycle {
            counter: cycle as u64,
            motor_position_rad: take(&record.position_rad, cycle),
            motor_torque_nm: take(&record.torque_nm, cycle),
            motor_reference_rad: reference
                .map_or([0.0; MAX_JOINTS], |columns| take(columns, target)),
            readings: Default::default(),
            has_temperature: [false; MAX_JOINTS],
        }
    }

    /// Returns the frame of one message of the layout; `message` is its index in the layout.
    ///
    /// # Errors
    /// [`CycleError::Value`].
    pub(crate) fn encode_frame(
        &self,
        message: usize,
        cycle: &BusCycle,
        stamp_ns: u64,
    ) -> Result<Frame, CycleError> {
        Ok(self.layout.messages()[message].encode(&self.values(cycle), stamp_ns)?)
    }

    fn values(&self, cycle: &BusCycle) -> CycleValues {
        let mut values = CycleValues { counter: cycle.counter, ..Default::default() };
        for (j, axis) in values.axes.iter_mut().enumerate().take(self.layout.axes()) {
            *axis = AxisValues {
                position: self.scales.position_value(j, cycle.motor_position_rad[j]),
                torque: self.scales.torque_value(j, cycle.motor_torque_nm[j]),
                reference: self.scales.reference_value(
                    j,
                    cycle.motor_reference_rad[j],
                    cycle.motor_position_rad[j],
                ),
                status_word: self.enabled_value,
                readings: cycle.readings[j],
            };
        }
        values
    }
}
