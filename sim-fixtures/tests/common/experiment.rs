//! The simulated arm's record as an experiment, the paper's settings, and a robot that is nearly
//! its.

use std::fmt::Write as _;

use didim_dynamics::SignalTiming;
use didim_dynamics::control::SimulatedController;
use didim_dynamics::robot::Robot;
use didim_dynamics::trajectory::{MoveSequence, RandomMoves};
use didim_identification::identification::{
    DecimationFilter, Experiment, Options, PositionFilter, Start,
};
use didim_sim::{Scenario, tx40_paper};

/// The shipped motion, or random moves of these seeds, none of them chosen.
pub(crate) const MOTIONS: [Option<u64>; 3] = [None, Some(9), Some(21)];

/// The paper's arm on one of these motions.
pub(crate) fn on_motion(motion: Option<u64>) -> Scenario {
    let scenario = tx40_paper().unwrap();
    let Some(seed) = motion else { return scenario };
    on_random_moves(scenario, seed, 14)
}

/// An arm on so many random moves; 14 are about the shipped motion's 6.9 s.
pub(crate) fn on_random_moves(scenario: Scenario, seed: u64, moves: usize) -> Scenario {
    let moves = random_moves(&scenario, seed, moves);
    scenario.with_moves(&moves).unwrap()
}

/// The moves themselves.
pub(crate) fn random_moves(scenario: &Scenario, seed: u64, moves: usize) -> MoveSequence {
    let moves = RandomMoves {
        seed,
        moves,
        range_fraction: 0.8,
        reach_rad: vec![1.2, 0.9, 1.2, 1.5, 1.2, 2.4],
        velocity_fraction: 1.0,
        acceleration_fraction: 1.0,
        dwell_s: 0.035,
    };
    moves.draw_sequence(scenario.limits()).unwrap()
}

/// Rest before and after the motion, in samples: 0.25 s at 5 kHz.
pub(crate) const REST: usize = 1250;

/// The scenario's motion with a rest before and after it. The motion's samples count; the rests are
/// there for the filters, which need neighbours, and for the loop, which sags into its steady error
/// at first. The torque command is held until the next sample.
pub(crate) fn experiment(scenario: &Scenario) -> Experiment {
    experiment_after(scenario, REST)
}

/// The same with so many samples of rest.
pub(crate) fn experiment_after(scenario: &Scenario, rest: usize) -> Experiment {
    let hold_s = scenario.controller().timing.sample_period_s();
    let record = scenario.record_with_rests(rest, rest).unwrap();
    let signals = record.motor_signals();
    Experiment::motor_side(&signals, scenario.robot().transmission())
        .unwrap()
        .with_torque_timing(SignalTiming { hold_s, delay_s: 0.0 })
        .unwrap()
        .with_counted(rest..rest + scenario.samples())
        .unwrap()
}

/// The same experiment by someone who takes the logged command for the torque of its instant.
pub(crate) fn hold_ignored(experiment: Experiment) -> Experiment {
    experiment.with_torque_timing(SignalTiming::INSTANTANEOUS).unwrap()
}

/// Names of the paper's essential parameters, which its robot states.
pub(crate) fn listed(scenario: &Scenario) -> Vec<String> {
    let listed = scenario.robot().nominal().unwrap().given_values();
    listed.iter().map(|(name, _)| name.clone()).collect()
}

/// What the methods do with an equation: the paper's settings but for the cut-off of the position
/// filter, one row in 125, these parameters or all.
pub(crate) fn regression(parameters: Option<Vec<String>>, cutoff_hz: f64) -> Options {
    let mut options = Options::new(
        PositionFilter { order: 4, cutoff_hz },
        DecimationFilter { order: 8, ripple_db: 0.05, cutoff_ratio: 0.8, factor: 125 },
    );
    options.parameters = parameters;
    options
}

/// The paper's settings but for the cut-off of the position filter, 50 Hz there: its 28 parameters,
/// one row in 125, and the controller that this scenario has.
pub(crate) fn loop_options(described: &Scenario, cutoff_hz: f64, start: Start) -> Options {
    let options = regression(Some(listed(described)), cutoff_hz);
    with_loop(options, described, start)
}

/// These options with the controller and the solver of a scenario.
pub(crate) fn with_loop(mut options: Options, described: &Scenario, start: Start) -> Options {
    options.controller = Some(SimulatedController::Cabinet {
        timing: described.controller().timing,
        joints: described.controller().joints.clone(),
        rescale_to_inertia_kg_m2: None,
    });
    options.simulation.integrator = described.simulation().integrator;
    options.simulation.substeps = described.simulation().substeps;
    options.simulation.start = start;
    options
}

/// The paper's robot with nominal parameters 15 % off the true ones: larger where `pattern` has a
/// bit set, counted from the first parameter, and smaller otherwise.
pub(crate) fn with_nominal_error(scenario: &Scenario, pattern: u64) -> Robot {
    let file = include_str!("../../../config/robots/tx40.toml");
    let (geometry, _) = file.split_once("[nominal]").unwrap();
    let mut text = format!("{geometry}[nominal]\n");
    for (k, (name, value)) in scenario.robot().nominal().unwrap().given_values().iter().enumerate()
    {
        let more = pattern >> k & 1 == 1;
        writeln!(text, "{name} = {:?}", value * if more { 1.15 } else { 0.85 }).unwrap();
    }
    Robot::from_toml(&text).unwrap()
}
