//! Damages at random: which, how large and when.
#![allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "counts of a record")]

use didim_sim::fault_injection::{
    AxisSignal, FrameFault, FrameRole, InjectedFault, RecordFault, SignalFault,
};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng as _, SeedableRng as _};

use super::file::BusOf;

/// Faults that no data show have own files, and are drawn no larger than this: gains and scales of
/// the wrist, or those next to other faults that corrupt what the other joints would show; the rate
/// of a gateway with own stamps, and a gain of all joints.
const IN_NO_DATA: f64 = 0.05;
/// Axes whose torque is next to nothing but their own friction and inertia, which go with their
/// gain.
const OWN_TORQUE: [usize; 3] = [4, 5, 6];
/// Axes with whose position next to nothing goes but that friction and inertia.
const OWN_POSITION: [usize; 3] = [4, 5, 6];
/// Torque and position of one axis, both scaled, are those of another inertia, which has a file of
/// its own: the second one is drawn no larger than this.
const SECOND: f64 = 0.006;
/// Cycles of the record, about.
const CYCLES: u64 = 4_000;

/// Damages at random.
pub(super) struct Draw {
    random: ChaCha8Rng,
    /// Axes of which something is scaled.
    scaled: Vec<usize>,
    /// Whether there are several damages.
    several: bool,
}

impl Draw {
    pub(super) fn new(seed: u64) -> Self {
        Self { random: ChaCha8Rng::seed_from_u64(seed), scaled: Vec::new(), several: false }
    }

    pub(super) fn below(&mut self, count: u64) -> u64 {
        self.random.next_u64() % count
    }

    fn uniform(&mut self) -> f64 {
        (self.random.next_u64() >> 11) as f64 / 9_007_199_254_740_992.0
    }

    /// Between two sizes, each order of magnitude as often.
    fn size(&mut self, least: f64, most: f64) -> f64 {
        least * (most / least).powf(self.uniform())
    }

    /// Either way.
    fn signed(&mut self, least: f64, most: f64) -> f64 {
        let size = self.size(least, most);
        if self.below(2) == 0 { size } else { -size }
    }

    /// The factor of a gain or a scale of an axis, up to `most` where the data can show it.
    fn factor(&mut self, axis: usize, in_no_data: &[usize], most: f64) -> f64 {
        let most = match self.several || in_no_data.contains(&axis) {
            _ if self.scaled.contains(&axis) => SECOND,
            true => IN_NO_DATA,
            false => most,
        };
        self.scaled.push(axis);
        self.signed(0.005, most).exp()
    }

    fn axis(&mut self) -> usize {
        self.below(6) as usize + 1
    }

    fn some_axis(&mut self) -> Option<usize> {
        (self.below(4) > 0).then(|| self.axis())
    }

    fn signal(&mut self) -> AxisSignal {
        [AxisSignal::Position, AxisSignal::Torque, AxisSignal::All][self.below(3) as usize]
    }

    pub(super) fn faults(&mut self, bus: BusOf) -> Vec<InjectedFault> {
        let count = 1 + self.below(3);
        self.several = count > 1;
        (0..count).map(|_| self.fault_injection(bus)).collect()
    }

    fn fault_injection(&mut self, bus: BusOf) -> InjectedFault {
        let action = if self.below(5) == 0 {
            RecordFault::Frames(self.of_frames(bus))
        } else {
            RecordFault::Of(self.of_signals())
        };
        let first = self.below(CYCLES) as usize;
        let fault = InjectedFault { action, from: 0, cycles: None, every: 1 };
        match (&fault.action, self.below(3)) {
            // What is one fault of the whole record.
            (
                RecordFault::Of(SignalFault::Resample { .. })
                | RecordFault::Frames(FrameFault::Stretch { .. }),
                _,
            ) => fault,
            (
                RecordFault::Of(
                    SignalFault::Cut | SignalFault::Repeat | SignalFault::Freeze { .. },
                )
                | RecordFault::Frames(_),
                choice,
            ) => {
                let cycles = Some(self.size(1.0, 1_000.0) as usize);
                let every = if choice == 0 { 1 + self.below(200) as usize } else { 1 };
                InjectedFault { from: first, cycles, every, ..fault }
            }
            (_, 0) => InjectedFault { from: first, ..fault },
            (_, 1) => InjectedFault {
                from: first,
                cycles: Some(self.size(1.0, 2_000.0) as usize),
                ..fault
            },
            _ => fault,
        }
    }

    fn of_signals(&mut self) -> SignalFault {
        let own_axis = self.axis();
        let axis = Some(own_axis);
        match self.below(19) {
            0 => SignalFault::Freeze { signal: self.signal(), axis: self.some_axis() },
            1 => SignalFault::Hold {
                signal: self.signal(),
                axis: self.some_axis(),
                length: 2 + self.below(20) as usize,
            },
            2 => SignalFault::Delay {
                signal: self.signal(),
                axis: self.some_axis(),
                by: 1 + self.below(12) as usize,
            },
            3 => SignalFault::Swap { signal: self.signal(), axes: [self.axis(), self.axis()] },
            4 => {
                let value = self.signed(0.02, 20.0);
                SignalFault::Add { signal: AxisSignal::Position, axis, value }
            }
            5 => {
                let value = self.signed(0.005, 0.5);
                SignalFault::Add { signal: AxisSignal::Torque, axis, value }
            }
            6 | 7 => SignalFault::Scale {
                signal: AxisSignal::Torque,
                axis,
                factor: self.factor(own_axis, &OWN_TORQUE, 0.7),
            },
            8 => SignalFault::Scale {
                signal: AxisSignal::Torque,
                axis: None,
                factor: 1.0 + self.signed(0.001, 0.02),
            },
            9 => SignalFault::Scale {
                signal: AxisSignal::Position,
                axis,
                factor: self.factor(own_axis, &OWN_POSITION, 0.5),
            },
            10 => {
                let sign = if self.below(2) == 0 { 1.0 } else { -1.0 };
                let most = if self.several { IN_NO_DATA } else { 1.0 };
                SignalFault::ScalePositive {
                    axis: self.axis(),
                    factor: self.signed(0.01, most).exp(),
                    sign,
                }
            }
            11 => SignalFault::Saturate { axis: self.axis(), limit: self.size(0.1, 2.0) },
            12 => SignalFault::LowPass {
                signal: self.signal(),
                axis: self.some_axis(),
                cutoff_hz: self.size(1.0, 100.0),
            },
            13 => SignalFault::Ripple { axis: self.axis(), amplitude: self.size(0.003, 0.3) },
            14 => SignalFault::Noise {
                signal: AxisSignal::Torque,
                axis: self.some_axis(),
                rms: self.size(0.003, 0.5),
                seed: self.below(1000),
            },
            15 => SignalFault::Noise {
                signal: AxisSignal::Position,
                axis: self.some_axis(),
                rms: self.size(1e-4, 0.1),
                seed: self.below(1000),
            },
            16 => SignalFault::Quantise {
                signal: self.signal(),
                axis: self.some_axis(),
                step: self.size(1e-3, 0.2),
            },
            17 => SignalFault::Resample { ratio: 1.0 + self.signed(1e-3, 0.015) },
            _ if self.below(2) == 0 => SignalFault::Cut,
            _ => SignalFault::Repeat,
        }
    }

    fn of_frames(&mut self, bus: BusOf) -> FrameFault {
        let frame = [FrameRole::Sync, FrameRole::Sample, FrameRole::Sample, FrameRole::Target]
            [self.below(4) as usize];
        let bits = if bus == BusOf::Packed { 480 } else { 64 };
        match self.below(9) {
            0 => FrameFault::Drop { frame, axis: self.some_axis() },
            1 => FrameFault::Double { frame, axis: self.some_axis() },
            2 | 3 => FrameFault::Flip {
                frame: FrameRole::Sample,
                axis: self.some_axis(),
                bit: self.below(bits) as usize,
            },
            4 => FrameFault::Late { axis: self.axis() },
            5 => FrameFault::Jitter { us: self.size(1.0, 3_000.0), seed: self.below(1000) },
            6 => FrameFault::Stretch { ratio: 1.0 + self.signed(1e-5, 0.05) },
            7 => FrameFault::ClockStep { ms: self.signed(0.1, 1e6) },
            _ => FrameFault::Burst { length: 1 + self.below(50) as usize },
        }
    }
}
