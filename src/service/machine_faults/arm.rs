//! Four arms of different makers on random motions, and the frames of a motion.

use std::path::Path;
use std::sync::LazyLock;

use didim_drivers::frame::Frame;
use didim_dynamics::Signals;
use didim_dynamics::robot::Robot;
use didim_dynamics::trajectory::RandomMoves;
use didim_sim::fault_injection::{InjectedFault, damaged_frames};
use didim_sim::{CycleEncoder, PlaybackConfig, Scenario};

use super::draw::Plan;
use crate::cell::Cell;

/// Rest before the record, in which the loop settles under gravity \[s\].
const SETTLE_S: f64 = 1.5;
/// Rest before and after a motion \[s\]: a window ends within it.
const RESTS_S: [f64; 2] = [1.0, 2.0];
/// Time of the first frame of a motion, before it is sent \[ns\].
pub(super) const EPOCH_NS: u64 = 1_790_000_000_000_000_000;

/// Files of the cell, the scenario and the robot, how far a joint moves at most \[rad\], and the
/// number of moves.
type Files = (&'static str, &'static str, &'static str, f64, usize);

const FILES: [Files; 4] = [
    ("sim-fixtures/faults/cells/sync.toml", "tx40-paper", "tx40", 1.2, 7),
    ("config/cells/openarm.toml", "openarm", "openarm", 1.0, 7),
    ("config/cells/piper.toml", "piper", "piper", 1.0, 7),
    ("sim-fixtures/faults/cells/ur5e.toml", "ur5e", "ur5e", 1.0, 7),
];

/// An arm with its cell.
pub(super) struct Arm {
    pub(super) cell: Cell,
    scenario: Scenario,
    reach_rad: f64,
    moves: usize,
}

static ARMS_WITH_CELLS: LazyLock<Vec<Arm>> = LazyLock::new(|| FILES.map(Arm::read).into());

impl Arm {
    pub(super) fn get(number: u64) -> &'static Self {
        &ARMS_WITH_CELLS[usize::try_from(number).unwrap()]
    }

    fn read((cell, scenario, robot, reach_rad, moves): Files) -> Self {
        let root = Path::new(env!("CARGO_MANIFEST_DIR"));
        let read = |path: String| std::fs::read_to_string(root.join(path)).unwrap();
        let robot = Robot::from_toml(&read(format!("config/robots/{robot}.toml"))).unwrap();
        let text = read(format!("sim-fixtures/scenarios/{scenario}.toml"));
        let scenario = Scenario::from_toml(&text, robot).unwrap();
        let mut cell = Cell::read(&root.join(cell)).unwrap();
        // Short motions, for the time of the tests.
        cell.window.min_s = 3.0;
        Self { cell, scenario, reach_rad, moves }
    }
}

/// One motion of an arm with its truth.
pub(super) struct Motion {
    pub(super) cell: &'static Cell,
    pub(super) scenario: Scenario,
    record: Signals,
    encoder: CycleEncoder,
    pub(super) period_ns: u64,
}

impl Motion {
    pub(super) fn new(plan: &Plan) -> Self {
        let Arm { cell, scenario, reach_rad, moves } = Arm::get(plan.arm);
        let moves = RandomMoves {
            seed: plan.moves,
            moves: *moves,
            range_fraction: 0.8,
            reach_rad: vec![*reach_rad; scenario.limits().len()],
            velocity_fraction: 1.0,
            acceleration_fraction: 1.0,
            dwell_s: 0.05,
        };
        let moves = moves.draw_sequence(scenario.limits()).unwrap();
        let scenario = scenario.clone().with_seed(plan.noise).with_moves(&moves).unwrap();
        let [lead_in_s, tail_s] = RESTS_S;
        let rests = PlaybackConfig { lead_in_s: SETTLE_S + lead_in_s, tail_s, cycles: Some(1) };
        let scenario = scenario.with_playback(rests).unwrap();
        let rate_hz = cell.sample_rate_hz();
        let bus = cell.bus().unwrap();
        let loop_hz = 1.0 / scenario.controller().timing.sample_period_s();
        let step = rounded(loop_hz / rate_hz);
        let samples = rounded((lead_in_s + scenario.trajectory().duration_s() + tail_s) * rate_hz);
        let settling = rounded(SETTLE_S * loop_hz);
        let mut played = scenario.played_loop().unwrap();
        let signals = played.run(settling + samples * step).unwrap().motor_signals();
        let thin = |columns: Vec<Vec<f64>>| -> Vec<Vec<f64>> {
            let thinned = |of: Vec<f64>| of.into_iter().skip(settling).step_by(step).collect();
            columns.into_iter().map(thinned).collect()
        };
        let record = Signals {
            sample_rate_hz: rate_hz,
            position_rad: thin(signals.position_rad),
            torque_nm: thin(signals.torque_nm),
            reference_rad: signals.reference_rad.map(thin),
        };
        let encoder = CycleEncoder::new(bus.layout.clone(), bus.scales.clone());
        let period_ns = rounded(1e9 / rate_hz) as u64;
        Self { cell, scenario, record, encoder, period_ns }
    }

    /// Returns the frames of a motion, cycle by cycle, from [`EPOCH_NS`] on.
    pub(super) fn frames(&self, damage: Option<&InjectedFault>) -> Vec<Vec<Frame>> {
        let damage: Vec<InjectedFault> = damage.cloned().into_iter().collect();
        damaged_frames(&self.record, &damage, &self.encoder, EPOCH_NS).unwrap()
    }
}

fn rounded(number: f64) -> usize {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "of a motion")]
    let count = number.round() as usize;
    count
}
