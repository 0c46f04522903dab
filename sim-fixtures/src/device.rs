//! Virtual device that converts the samples of the closed loop to frames, without a clock.

use didim_drivers::frame::{Frame, FrameError};
use didim_drivers::layout::{CompiledLayout, Quantity, Role};
use didim_drivers::units::Scales;
use didim_dynamics::simulation::{ClosedLoop, SetupError, SimulationError, StepOutput};
use didim_dynamics::trajectory::Reference;
use didim_dynamics::{MAX_JOINTS, Reading};

use crate::encoder::axis_of;
use crate::streamed::StreamedMeasurement;
use crate::thermal_model::readings;
use crate::{
    BusCycle, CycleEncoder, CycleError, ExcludedTorque, Fault, FaultAction, Playback, Scenario,
};

/// Maximum number of frames in one cycle. A cycle contains a SYNC, a sample, a target and the
/// readings of each axis, each of them at most twice, and an error report.
pub const CYCLE_FRAMES: usize = 2 * ((2 + Reading::ALL.len()) * MAX_JOINTS + 1) + 1;

/// Interval of messages that contain only readings \[ns\].
const READINGS_EVERY_NS: u64 = 25_000_000;

/// Simulated arm on a bus. It counts its own time: cycle k begins k periods after the start.
pub struct VirtualDevice {
    closed_loop: ClosedLoop<Playback>,
    reference: Playback,
    encoder: CycleEncoder,
    /// Messages of a cycle, each with its arrival time after the beginning of the cycle \[ns\]. The
    /// list is empty unless signals are valid at the arrival of their frames. `streamed` then
    /// computes their values between the samples of the loop.
    arrivals: Vec<(usize, u64)>,
    streamed: StreamedMeasurement,
    excluded: Option<ExcludedTorque>,
    faults: Vec<Fault>,
    steps_per_cycle: u32,
    period_ns: u64,
    cycles: u64,
    epoch_ns: u64,
    cycle: u64,
    silent_until: u64,
}

/// Reason why a device cannot be created or cannot continue.
#[derive(Debug, thiserror::Error)]
pub enum DeviceError {
    /// Scenario and layout differ in their number of axes.
    #[error("the layout has {layout} axes, the arm {arm}")]
    Axes {
        /// Number of axes of the layout.
        layout: usize,
        /// Number of axes of the arm.
        arm: usize,
    },
    /// A bus cycle is not a whole number of controller periods.
    #[error(
        "the bus cycle of {cycle_ns} ns is not a whole number of controller periods of {period_s} s"
    )]
    Period {
        /// Period of the bus cycle \[ns\].
        cycle_ns: f64,
        /// Period of the controller \[s\].
        period_s: f64,
    },
    /// A fault of the scenario cannot happen on this bus.
    #[error("the fault of cycle {cycle}: {reason}")]
    Fault {
        /// Cycle of the fault.
        cycle: u64,
        /// Reason why the fault cannot happen.
        reason: &'static str,
    },
    /// The loop cannot be built.
    #[error(transparent)]
    Setup(#[from] SetupError),
    /// The simulation failed.
    #[error(transparent)]
    Simulation(#[from] SimulationError),
    /// Gains and layout do not fit the arm or the rate.
    #[error(transparent)]
    Encode(#[from] CycleError),
    /// An error report of a fault has class bits that cannot exist.
    #[error(transparent)]
    Frame(#[from] FrameError),
}

impl VirtualDevice {
    /// Creates the device of a scenario. Its frames have the layout `layout`, and the gains of its
    /// drives are `scales`. Its stamps begin at `epoch_ns`.
    ///
    /// # Errors
    /// [`DeviceError`] if scenario and layout do not match.
    pub fn new(
        scenario: &Scenario,
        layout: CompiledLayout,
        scales: Scales,
        epoch_ns: u64,
    ) -> Result<Self, DeviceError> {
        let arm = scenario.robot().joints();
        if layout.axes() != arm {
            return Err(DeviceError::Axes { layout: layout.axes(), arm });
        }
        let closed_loop = scenario.played_loop()?;
        let period_s = closed_loop.period_s();
        let cycle_ns = layout.period_ns();
        let steps = (cycle_ns * 1e-9 / period_s).round();
        let is_multiple = (steps * period_s * 1e9 - cycle_ns).abs() <= 1e-6 * cycle_ns;
        if !(is_multiple && (1.0..=1e6).contains(&steps) && cycle_ns.fract() == 0.0) {
            return Err(DeviceError::Period { cycle_ns, period_s });
        }
        let reference = scenario.played_reference();
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "checked above; a float beyond the range saturates, and infinity means for \
                ever"
        )]
        let (steps_per_cycle, period_ns, cycles) = (
            steps as u32,
            cycle_ns as u64,
            (reference.duration_s() * 1e9 / cycle_ns + 1e-6).floor() as u64,
        );
        let at_arrival = layout.at_arrival();
        let encoder = CycleEncoder::new(layout, scales);
        let device = Self {
            closed_loop,
            reference,
            arrivals: if at_arrival { encoder.arrival_times()? } else { Vec::new() },
            streamed: StreamedMeasurement::new(scenario.controller()),
            encoder,
            excluded: None,
            faults: scenario.faults().to_vec(),
            steps_per_cycle,
            period_ns,
            cycles,
            epoch_ns,
            cycle: 0,
            silent_until: 0,
        };
        device.check_faults()?;
        Ok(device)
    }

    /// Returns the same device with reported torques that lack these terms.
    #[must_use]
    pub fn with_excluded_torque(self, excluded: Option<ExcludedTorque>) -> Self {
        Self { excluded, ..self }
    }

    /// Returns the layout of the device's frames.
    pub fn layout(&self) -> &CompiledLayout {
        self.encoder.layout()
    }

    /// Returns the period of the bus cycle \[ns\].
    pub fn period_ns(&self) -> u64 {
        self.period_ns
    }

    /// Returns the number of cycles to play; the largest possible number for endless playback.
    pub fn cycle_count(&self) -> u64 {
        self.cycles
    }

    /// Returns the due time of the next cycle \[ns since the start\]; `None` after the last one.
    pub fn poll_due(&self) -> Option<u64> {
        (self.cycle < self.cycles).then(|| self.cycle * self.period_ns)
    }

    /// Appends the frames of the next cycle, stamped with the times at which a bus would deliver
    /// them, and advances by one cycle. `frames` never grows by more than [`CYCLE_FRAMES`].
    ///
    /// # Errors
    /// [`DeviceError`]; then no frame is appended, and the device is no longer usable.
    pub fn poll_cycle(&mut self, frames: &mut Vec<Frame>) -> Result<(), DeviceError> {
        let stamp_ns = self.epoch_ns + self.cycle * self.period_ns;
        let before = frames.len();
        let encoded = if self.arrivals.is_empty() {
            let mut sample = self.advance()?;
            if let Some(excluded) = &mut self.excluded {
                excluded.subtract_from_sample(&mut sample);
            }
            self.encode(&sample, stamp_ns, frames).map_err(DeviceError::from)
        } else {
            self.append_streamed(stamp_ns, frames)
        };
        let encoded = encoded.and_then(|()| self.apply_faults(stamp_ns, before, frames));
        if let Err(error) = encoded {
            frames.truncate(before);
            return Err(error);
        }
        self.cycle += 1;
        Ok(())
    }

    /// Appends the frames of a cycle. Each frame has the values at its own arrival time.
    fn append_streamed(
        &mut self,
        stamp_ns: u64,
        frames: &mut Vec<Frame>,
    ) -> Result<(), DeviceError> {
        let start_ns = self.cycle * self.period_ns;
        let has_temperature = self.reports_temperature();
        for (message, after_ns) in self.arrivals.iter().copied() {
            let plan = &self.encoder.layout().messages()[message];
            if plan.role == Role::Reading && !has_temperature[axis_of(plan)] {
                continue;
            }
            let (closed_loop, excluded) = (&mut self.closed_loop, self.excluded.as_mut());
            let values = self.streamed.measure(closed_loop, excluded, start_ns + after_ns)?;
            frames.push(self.encoder.encode_frame(message, &values, stamp_ns + after_ns)?);
        }
        Ok(())
    }

    /// Returns true for each axis that sends its messages with only readings in this cycle. The
    /// axes take turns, because the bus may not have the capacity for all of them in one cycle.
    fn reports_temperature(&self) -> [bool; MAX_JOINTS] {
        let every = (READINGS_EVERY_NS / self.period_ns).max(1);
        core::array::from_fn(|axis| (self.cycle + axis as u64).is_multiple_of(every))
    }

    /// Runs the loop to the instant of the next cycle.
    fn advance(&mut self) -> Result<StepOutput, SimulationError> {
        let steps = if self.cycle == 0 { 1 } else { self.steps_per_cycle };
        for _ in 1..steps {
            self.closed_loop.step()?;
        }
        self.closed_loop.step().copied()
    }

    fn encode(
        &self,
        sample: &StepOutput,
        stamp_ns: u64,
        frames: &mut Vec<Frame>,
    ) -> Result<(), CycleError> {
        let motor_reference_rad = if self.layout().reference_at_next_sync() {
            // The targets of this cycle take effect at the next SYNC. Controller and drives
            // interpolate the same motion, so each target is the reference at that time.
            self.motor_reference_at_next_cycle(sample)
        } else {
            sample.motor_reference_rad
        };
        let cycle = BusCycle {
            counter: self.counter(),
            motor_position_rad: sample.motor_position_rad,
            motor_torque_nm: sample.motor_torque_nm,
            motor_reference_rad,
            readings: readings(sample.time_s),
            has_temperature: self.reports_temperature(),
        };
        self.encoder.encode(&cycle, stamp_ns, frames)
    }

    fn motor_reference_at_next_cycle(&self, sample: &StepOutput) -> [f64; MAX_JOINTS] {
        let n = self.reference.joints();
        let [mut joint, mut rate, mut acceleration, mut motor] = [[0.0; MAX_JOINTS]; 4];
        let time_s = sample.time_s + f64::from(self.steps_per_cycle) * self.closed_loop.period_s();
        self.reference.evaluate(time_s, &mut joint[..n], &mut rate[..n], &mut acceleration[..n]);
        self.closed_loop.transmission().motor_position(&joint[..n], &mut motor[..n]);
        motor
    }

    fn counter(&self) -> u64 {
        let wrong = self.faults_now().find_map(|action| match action {
            FaultAction::CorruptCounter { add } => Some(add),
            _ => None,
        });
        self.cycle.wrapping_add(wrong.unwrap_or(0))
    }

    fn faults_now(&self) -> impl Iterator<Item = FaultAction> + '_ {
        self.faults.iter().filter(|fault| fault.cycle == self.cycle).map(|fault| fault.action)
    }

    /// Applies the faults to the frames of the cycle, which are those from index `before` on.
    fn apply_faults(
        &mut self,
        stamp_ns: u64,
        before: usize,
        frames: &mut Vec<Frame>,
    ) -> Result<(), DeviceError> {
        let mut report = None;
        // Go from the last frame to the first, so that a removal does not shift the frames that are
        // still to be processed.
        for index in (0..frames.len() - before).rev() {
            let index_of = |action: FaultAction| match action {
                FaultAction::Drop { frame } | FaultAction::Duplicate { frame } => frame == index,
                _ => false,
            };
            match self.faults_now().find(|action| index_of(*action)) {
                Some(FaultAction::Drop { .. }) => {
                    frames.remove(before + index);
                }
                Some(FaultAction::Duplicate { .. }) => {
                    let copy = frames[before + index];
                    frames.insert(before + index + 1, copy);
                }
                _ => {}
            }
        }
        for action in self.faults_now() {
            if let FaultAction::ErrorFrame { class } = action {
                report = Some(Frame::error(class, &[0; 8])?.with_stamp(stamp_ns));
            }
        }
        let pause = self.faults_now().find_map(|action| match action {
            FaultAction::Pause { cycles } => Some(self.cycle.saturating_add(cycles)),
            _ => None,
        });
        self.silent_until = self.silent_until.max(pause.unwrap_or(0));
        if self.cycle < self.silent_until {
            frames.truncate(before);
        } else if let Some(report) = report {
            frames.insert(before, report);
        }
        Ok(())
    }

    fn check_faults(&self) -> Result<(), DeviceError> {
        let frames = self.layout().messages().len();
        for Fault { cycle, action } in self.faults.iter().copied() {
            let reason = match action {
                FaultAction::Drop { frame } | FaultAction::Duplicate { frame }
                    if frame >= frames =>
                {
                    "a cycle of this layout has not so many frames"
                }
                FaultAction::CorruptCounter { .. }
                    if self.layout().signal(Quantity::Counter, 0).is_none() =>
                {
                    "this layout has no counter"
                }
                FaultAction::ErrorFrame { class } => {
                    Frame::error(class, &[0; 8])?;
                    continue;
                }
                _ => continue,
            };
            return Err(DeviceError::Fault { cycle, reason });
        }
        Ok(())
    }
}
