//! Faults of the machine at random: which, when and how long. A plan has whole numbers only, so
//! that its text is the same everywhere.

use didim_sim::fault_injection::{FrameFault, FrameRole, InjectedFault, RecordFault};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng as _, SeedableRng as _};

/// Number of arms to draw from.
pub(super) const ARMS: u64 = 4;
/// Cycles of a motion that a fault of the bus may affect: the shortest motions have more.
const CYCLES: u64 = 1_500;
/// One millionth of a run.
pub(super) const MILLIONTH: u64 = 1_000_000;

/// A fault of the machine below the service.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum MachineFault {
    /// The process is killed, and started again after some time.
    Kill { away_ms: u64 },
    /// The power fails: the disk forgets what was not synced.
    PowerLoss { away_ms: u64, remains: u64 },
    /// The process that identifies is away, and the bus goes on: the order of two processes.
    EstimatorAway { away_ms: u64 },
    /// The process is stopped and continues.
    Stop { for_ms: u64 },
    /// So many waits end early by a signal.
    Interrupted { waits: u64 },
    /// The wall clock is set.
    ClockStep { by_ms: i64 },
    /// The interface is away.
    InterfaceGone { for_ms: u64 },
    /// Nothing more fits on the disk.
    DiskFull { for_ms: u64 },
    /// The disk refuses every change.
    DiskReadOnly { for_ms: u64 },
    /// The disk takes so long for every change.
    DiskLate { for_ms: u64, change_ms: u64 },
    /// Another configuration is loaded.
    Reload,
}

/// One run: an arm, its motion, and what happens to the machine.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Plan {
    pub(super) arm: u64,
    /// Seed of the moves.
    pub(super) moves: u64,
    /// Seed of the noise.
    pub(super) noise: u64,
    /// How often the motion is repeated.
    pub(super) motions: u64,
    /// A motion with a fault of its frames.
    pub(super) damage: Option<(u64, InjectedFault)>,
    /// Faults with their time in millionths of the run, in order.
    pub(super) faults: Vec<(u64, MachineFault)>,
}

struct Draw(ChaCha8Rng);

impl Draw {
    fn below(&mut self, count: u64) -> u64 {
        self.0.next_u64() % count
    }

    /// Returns a duration \[ms\]; each power of two as often.
    fn duration_ms(&mut self, least: u64, powers: u64) -> u64 {
        let scale = least << self.below(powers);
        scale + self.below(scale)
    }

    fn machine_fault(&mut self) -> MachineFault {
        match self.below(11) {
            0 => MachineFault::Kill { away_ms: self.duration_ms(50, 8) },
            1 => {
                let away_ms = self.duration_ms(200, 6);
                MachineFault::PowerLoss { away_ms, remains: self.0.next_u64() }
            }
            2 => MachineFault::EstimatorAway { away_ms: self.duration_ms(50, 9) },
            3 => MachineFault::Stop { for_ms: self.duration_ms(5, 12) },
            4 => MachineFault::Interrupted { waits: 1 + self.below(20) },
            5 => {
                let by_ms = self.duration_ms(1, 27).cast_signed();
                MachineFault::ClockStep { by_ms: if self.below(2) == 0 { by_ms } else { -by_ms } }
            }
            6 => MachineFault::InterfaceGone { for_ms: self.duration_ms(100, 7) },
            7 => MachineFault::DiskFull { for_ms: self.duration_ms(500, 7) },
            8 => MachineFault::DiskReadOnly { for_ms: self.duration_ms(500, 7) },
            9 => {
                let for_ms = self.duration_ms(500, 7);
                MachineFault::DiskLate { for_ms, change_ms: self.duration_ms(1, 13) }
            }
            _ => MachineFault::Reload,
        }
    }

    /// Returns a fault of frames of some cycles.
    fn frame_fault(&mut self) -> InjectedFault {
        let axis = usize::try_from(1 + self.below(6)).unwrap_or(1);
        let some = Some(axis);
        let action = match self.below(9) {
            0 => FrameFault::Drop { frame: FrameRole::Sample, axis: some },
            1 => FrameFault::Drop { frame: FrameRole::All, axis: None },
            2 => FrameFault::Double { frame: FrameRole::Sample, axis: some },
            3 => FrameFault::Contradict { axis },
            4 => FrameFault::Truncate { frame: FrameRole::Sample, axis: some },
            5 => FrameFault::Late { axis },
            6 => FrameFault::Error { class: 4 },
            7 => FrameFault::Remote,
            _ => FrameFault::Foreign { frames: 5 },
        };
        InjectedFault {
            action: RecordFault::Frames(action),
            from: usize::try_from(self.below(CYCLES)).unwrap_or(0),
            cycles: Some(1 << self.below(8)),
            every: 1,
        }
    }
}

impl Plan {
    /// Draws the plan of a seed.
    pub(super) fn draw(seed: u64) -> Self {
        let mut draw = Draw(ChaCha8Rng::seed_from_u64(seed));
        let (arm, moves, noise) = (seed % ARMS, draw.0.next_u64(), draw.0.next_u64());
        let motions = 3 + draw.below(3);
        let is_damaged = draw.below(3) == 0;
        let damage = is_damaged.then(|| (draw.below(motions), draw.frame_fault()));
        let count = 1 + draw.below(4);
        let faults = (0..count).map(|_| (draw.below(MILLIONTH), draw.machine_fault()));
        let mut faults: Vec<_> = faults.collect();
        faults.sort_by_key(|(at, _)| *at);
        Self { arm, moves, noise, motions, damage, faults }
    }
}
