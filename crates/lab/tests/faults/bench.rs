//! From a simulated arm to results, in memory and in virtual time: record → damage → frames →
//! samples → windows → results.

use std::borrow::Cow;
use std::path::Path;
use std::sync::LazyLock;

use didim::analysis::identify::{identify_measurements, identify_window};
use didim::analysis::screening::check_limits;
use didim::analysis::{LogError, read_log};
use didim::cell::Cell;
use didim::live::worker::{WindowEvent, Windower};
use didim_drivers::assemble::{Assembler, Losses};
use didim_drivers::frame::Frame;
use didim_drivers::source::{CandumpWriter, InterfaceName, StampDigits};
use didim_dynamics::JointSample;
use didim_dynamics::Signals;
use didim_sim::fault_injection::{FaultInjectionError, InjectedFault, damaged_frames};
use didim_sim::{CycleEncoder, Scenario, tx40_paper};

use super::file::{BusOf, root};
use super::outcome::Outcome;

/// The loop is simulated at 5 kHz; the bus has one sample in ten of it.
const STEPS: usize = 10;
/// Rest before and after the motion \[cycles of the bus\].
const RESTS: [usize; 2] = [250, 300];
/// Somewhere in 2026, as stamps of logs are \[ns\].
const EPOCH_NS: u64 = 1_790_000_000_000_000_000;

/// The record that all faults of files have in common.
pub(super) static BASE: LazyLock<Bench> = LazyLock::new(|| Bench::new(tx40_paper().unwrap()));
/// Both cells.
static CELLS: LazyLock<[Cell; 2]> = LazyLock::new(|| {
    ["sync", "packed"].map(|name| {
        let file = root().join(format!("sim-fixtures/faults/cells/{name}.toml"));
        Cell::read(&file).unwrap_or_else(|error| panic!("{error}"))
    })
});

pub(super) fn cell(bus: BusOf) -> &'static Cell {
    &CELLS[bus as usize]
}

/// An arm with what its drives measured.
pub(super) struct Bench {
    pub(super) scenario: Scenario,
    record: Signals,
}

impl Bench {
    pub(super) fn new(scenario: Scenario) -> Self {
        let [before, after] = RESTS.map(|rest| rest * STEPS);
        let signals = scenario.record_with_rests(before, after).unwrap().motor_signals();
        let thin = |columns: Vec<Vec<f64>>| -> Vec<Vec<f64>> {
            columns.into_iter().map(|of| of.into_iter().step_by(STEPS).collect()).collect()
        };
        let record = Signals {
            sample_rate_hz: signals.sample_rate_hz / STEPS as f64,
            position_rad: thin(signals.position_rad),
            torque_nm: thin(signals.torque_nm),
            reference_rad: signals.reference_rad.map(thin),
        };
        Self { scenario, record }
    }

    /// What is on the bus, cycle by cycle; nothing where a value does not fit its signal.
    pub(super) fn frames(&self, bus: BusOf, faults: &[InjectedFault]) -> Option<Vec<Vec<Frame>>> {
        let bus_cell = cell(bus).bus().unwrap();
        let encoder = CycleEncoder::new(bus_cell.layout.clone(), bus_cell.scales.clone());
        match damaged_frames(&self.record, faults, &encoder, EPOCH_NS) {
            Err(FaultInjectionError::Encode(_)) => None,
            frames => Some(frames.unwrap()),
        }
    }
}

/// Samples, what was counted, and of each cycle what had been counted after it.
pub(super) struct Assembled {
    pub(super) samples: Vec<JointSample>,
    pub(super) losses: Losses,
    pub(super) after_cycle: Vec<Losses>,
}

/// The way of every frame; every frame and every cycle is accounted for.
pub(super) fn assemble(cell: &Cell, cycles: &[Vec<Frame>]) -> Assembled {
    let mut assembler = cell.bus().unwrap().assembler();
    let mut samples = Vec::new();
    let mut after_cycle = Vec::with_capacity(cycles.len());
    for frames in cycles {
        for frame in frames {
            assembler.handle_frame(frame);
            samples.extend(assembler.poll_sample());
        }
        after_cycle.push(*assembler.losses());
    }
    assembler.handle_timeout(u64::MAX);
    samples.extend(assembler.poll_sample());
    check_sums(&assembler);
    Assembled { samples, losses: *assembler.losses(), after_cycle }
}

fn check_sums(assembler: &Assembler) {
    let losses = assembler.losses();
    let frames = losses.frames_used + losses.frames.total() + assembler.frames_waiting();
    assert_eq!(losses.frames_received, frames, "{losses:?}");
    let cycles = losses.samples + losses.cycles.total() + assembler.cycles_waiting();
    assert_eq!(losses.cycles_begun, cycles, "{losses:?}");
}

/// What the service makes of samples, window by window.
pub(super) fn replay(cell: &Cell, samples: &[JointSample]) -> Vec<Outcome> {
    let mut windower = Windower::new(cell.window.plan(cell.sample_rate_hz()).unwrap());
    let mut events: Vec<WindowEvent> =
        samples.iter().filter_map(|sample| windower.handle_sample(sample)).collect();
    events.extend(windower.finish());
    let outcome = |event| match event {
        WindowEvent::Rejected(window) => {
            Outcome::none(window.rejection.cause(), window.rejection.to_string())
        }
        WindowEvent::Closed(window) => match identify_window(cell, &window) {
            Ok(identification) => Outcome::from_identification(identification),
            Err(error) => Outcome::none("refused", error.to_string()),
        },
    };
    events.into_iter().map(outcome).collect()
}

/// What `didim identify` makes of the same frames in a log, and in how many pieces.
pub(super) fn identify(cell: &Cell, folder: &Path, cycles: &[Vec<Frame>]) -> (Outcome, usize) {
    let log = folder.join("frames.log");
    let names = [InterfaceName::new("can0").unwrap()];
    let file = std::io::BufWriter::new(std::fs::File::create(&log).unwrap());
    let mut writer = CandumpWriter::new(file, &names, StampDigits::Nanoseconds);
    for frame in cycles.iter().flatten() {
        writer.write(frame).unwrap();
    }
    writer.finish().unwrap();
    let record = match read_log(&log, cell, &[]) {
        Ok(record) => record,
        Err(error @ LogError::NoSample { .. }) => {
            return (Outcome::none("no-sample", error.to_string()), 0);
        }
        Err(error) => return (Outcome::none("refused", error.to_string()), 0),
    };
    // As the command counts where neither beginning nor end is given: all but the margins, in
    // pieces that make a row.
    let plan = cell.window.plan(cell.sample_rate_hz()).unwrap();
    let parts = record.segments.len();
    let counted = record.segments.into_iter().filter_map(|piece| {
        let end = piece.measurement.samples().saturating_sub(plan.margin_after);
        let counted = plan.margin_before..end;
        let rows = counted.len() >= cell.options.decimation_filter.factor;
        rows.then_some((Cow::Owned(piece.measurement), counted))
    });
    let counted: Vec<_> = counted.collect();
    let beyond = counted.iter().find_map(|(measurement, counted)| {
        check_limits(measurement, counted, &cell.robot, cell.screening.limits).err()
    });
    if let Some(beyond) = beyond {
        return (Outcome::none("refused", beyond.to_string()), parts);
    }
    if counted.is_empty() {
        return (
            Outcome::none("refused", "each piece is margin for the filters".to_owned()),
            parts,
        );
    }
    match identify_measurements(cell, cell.method, counted) {
        Ok(identification) => (Outcome::from_identification(identification), parts),
        Err(error) => (Outcome::none("refused", error.to_string()), parts),
    }
}
