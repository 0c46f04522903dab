//! CLIE and CLOE on the simulated TX40, starting 15 % off its parameters.

use std::time::Instant;

use crate::common::experiment::{loop_options, with_nominal_error};
use didim_dynamics::SignalTiming;
use didim_dynamics::dynamics::{BaseParameters, Model};
use didim_dynamics::robot::Robot;
use didim_dynamics::simulation::{
    ClosedLoop, InitialState, SimulationConfig, Stribeck, Unmodelled,
};
use didim_identification::identification::{
    self, Estimate, Experiment, Failure, Method, Options, Reason, Start,
};
use didim_sim::{Payload, Scenario, tx40_paper};

/// The scenario's motion as a log holds it, with this much of its noise.
fn record(scenario: &Scenario, simulation: &SimulationConfig) -> Experiment {
    record_on_grid(scenario, simulation, scenario.samples(), None)
}

/// The same with logged motor positions on a grid [rad]; the controller has the exact ones.
fn record_on_grid(
    scenario: &Scenario,
    simulation: &SimulationConfig,
    samples: usize,
    grid_rad: Option<f64>,
) -> Experiment {
    let mut record = ClosedLoop::new(
        scenario.robot(),
        scenario.standard_parameters(),
        scenario.controller(),
        scenario.trajectory(),
        simulation,
        InitialState::OnReference,
    )
    .unwrap()
    .run(samples)
    .unwrap();
    if let Some(grid) = grid_rad {
        record.motor_position_rad.apply(|q| *q = (*q / grid).round() * grid);
    }
    let signals = record.motor_signals();
    let hold_s = scenario.controller().timing.sample_period_s();
    Experiment::motor_side(&signals, scenario.robot().transmission())
        .unwrap()
        .with_torque_timing(SignalTiming { hold_s, delay_s: 0.0 })
        .unwrap()
}

fn options(scenario: &Scenario) -> Options {
    loop_options(scenario, 50.0, Start::Nominal)
}

/// Which parameters are larger: the bits of the golden ratio.
const PATTERN: u64 = 0x9e37_79b9_7f4a_7c15;

const METHODS: [(&str, Method); 2] = [("CLIE", Method::Clie), ("CLOE", Method::Cloe)];

fn identify(method: Method, robot: &Robot, experiment: &Experiment, options: &Options) -> Estimate {
    let base = BaseParameters::compute(&Model::new(robot)).unwrap();
    identification::identify(method, robot, &base, experiment, options).unwrap().estimate
}

/// Largest relative deviation from the truth.
fn largest_deviation(scenario: &Scenario, estimate: &Estimate) -> f64 {
    estimate.parameters.iter().fold(0.0, |largest: f64, p| {
        largest.max((p.value / scenario.truth_of(&p.name).unwrap() - 1.0).abs())
    })
}

/// Root mean square and largest of the deviations from the truth, in standard deviations.
fn deviations(scenario: &Scenario, estimate: &Estimate) -> (f64, f64) {
    let z = estimate
        .parameters
        .iter()
        .map(|p| (p.value - scenario.truth_of(&p.name).unwrap()) / p.standard_deviation);
    let z: Vec<f64> = z.collect();
    let mean_square = z.iter().map(|z| z * z).sum::<f64>() / z.len() as f64;
    (mean_square.sqrt(), z.iter().fold(0.0, |largest: f64, z| largest.max(z.abs())))
}

/// No noise, ideal encoders; the loop forgets the initial velocity in the two seconds that do not
/// count.
#[test]
fn without_noise_both_methods_lead_to_the_truth() {
    let scenario = tx40_paper().unwrap();
    let experiment = record(&scenario, &SimulationConfig::default())
        .with_counted(10000..scenario.samples() - 500)
        .unwrap();
    let robot = with_nominal_error(&scenario, PATTERN);
    for (name, method) in METHODS {
        let estimate = identify(method, &robot, &experiment, &options(&scenario));
        let largest = largest_deviation(&scenario, &estimate);
        println!("{name}: {largest:.1e} after {} simulations", estimate.simulations);
        // Changes of 0.2 standard deviations at errors of the smallest level, 1e-9 of the signals,
        // leave up to 1e-8 before the last linear step.
        assert!(largest < 1e-7, "{name}: {largest}");
        assert!(estimate.simulations <= 7, "{:?}", estimate.convergence);
    }
}

#[test]
fn with_noise_the_truth_is_within_the_standard_deviations() {
    let scenario = tx40_paper().unwrap();
    let experiment = record(&scenario, scenario.simulation());
    let robot = with_nominal_error(&scenario, PATTERN);
    for (name, method) in METHODS {
        let mut near = options(&scenario);
        near.simulation.didim_steps = 2;
        let begin = Instant::now();
        let same = identify(method, &robot, &experiment, &near);
        let with_didim = begin.elapsed();
        let begin = Instant::now();
        let estimate = identify(method, &robot, &experiment, &options(&scenario));
        let elapsed = begin.elapsed();
        for (a, b) in estimate.parameters.iter().zip(&same.parameters) {
            let deviation = (a.value - b.value).abs() / a.standard_deviation;
            assert!(deviation < 0.1, "{name}, {}: {deviation}", a.name);
        }
        println!(
            "{name} after 2 steps of DIDIM: {with_didim:.2?}, {} simulations",
            same.simulations
        );
        let (rms, largest) = deviations(&scenario, &estimate);
        println!(
            "{name}: {elapsed:.2?}, {} simulations, rms {rms:.2}, largest {largest:.1}, condition \
             number {:.0}",
            estimate.simulations, estimate.condition_number
        );
        assert!(estimate.verdict.applicable, "{:?}", estimate.verdict);
        assert!(estimate.simulations <= 6, "{:?}", estimate.convergence);
        // 28 parameters: the rms of white deviations is 1 ± 0.13.
        assert!(rms < 1.5 && largest < 4.0, "{name}: {rms} {largest}");
    }
}

/// CLOE compares positions, and its model is checked on the torques all the same.
#[test]
fn what_the_arm_has_next_to_the_model_is_found_by_both_methods() {
    let scenario = tx40_paper().unwrap();
    let of_joint = |joint: usize| Stribeck {
        torque_nm: 0.1 * scenario.truth_of(&format!("fc{joint}")).unwrap(),
        velocity_rad_s: 0.1,
        sign_width_rad_s: 0.05,
    };
    let stribeck = Some((1..=6).map(of_joint).collect());
    let stribeck = Unmodelled { stribeck, ..Default::default() };
    let payload = Payload::point_mass(1.0, [0.0, 0.0, 0.165]);
    let robot = with_nominal_error(&scenario, PATTERN);
    for (wrong, named) in [
        (scenario.clone().with_unmodelled(stribeck).unwrap(), "friction law"),
        (scenario.clone().with_payload(payload).unwrap(), "parameters left out"),
    ] {
        let experiment = record(&wrong, wrong.simulation());
        for (name, method) in METHODS {
            let estimate = identify(method, &robot, &experiment, &options(&wrong));
            let most = &estimate.nuisance_parameters[..3];
            println!("{name}, {named}: {most:?}");
            let is_named = most.iter().any(|found| found.nuisance.to_string().contains(named));
            assert!(is_named, "{name}: {most:?}");
        }
    }
}

/// Gains that are described 3 % too large make every parameter of CLOE as much too large. The
/// torques along its motion say so.
#[test]
fn the_torques_show_a_wrong_gain_from_a_heavier_arm() {
    let scenario = tx40_paper().unwrap();
    let experiment = record(&scenario, scenario.simulation());
    let mut options = options(&scenario);
    options.controller = options.controller.map(|controller| controller.with_gain(1.03));
    let verdict =
        identify(Method::Cloe, &with_nominal_error(&scenario, PATTERN), &experiment, &options)
            .verdict;
    println!("{:?}", verdict.reasons);
    let is_named =
        verdict.reasons.iter().any(|reason| matches!(reason, Reason::OtherParameters { .. }));
    assert!(is_named && !verdict.applicable, "{:?}", verdict.reasons);
}

/// Section 4.3. The first two seconds, logged with positions on a grid of 0.01 rad of the motor.
///
/// Under a stiff loop the positions hardly depend on the parameters: 15 % of error in them is what
/// the grid hides, and the method stays within its own, large, standard deviations of the start.
/// Under a soft loop the same grid shows them. Torques show them under both.
#[test]
fn a_stiff_loop_hides_the_parameters_from_the_positions_and_a_soft_one_does_not() {
    let scenario = tx40_paper().unwrap();
    let robot = with_nominal_error(&scenario, PATTERN);
    let start = robot.nominal().unwrap().given_values();
    let simulation = SimulationConfig::default();
    // The scenario's bandwidth times a factor.
    for (stiffness, stiff) in [(4.0, true), (0.3, false)] {
        let scenario = scenario.clone().with_bandwidth(stiffness).unwrap();
        let experiment = record_on_grid(&scenario, &simulation, 10_000, Some(0.01));
        for (name, method) in METHODS {
            let estimate = identify(method, &robot, &experiment, &options(&scenario));
            let pairs = estimate.parameters.iter().zip(start);
            let shifts =
                pairs.map(|(p, (_, from))| ((p.value - from) / p.standard_deviation).powi(2));
            let shift = (shifts.sum::<f64>() / start.len() as f64).sqrt();
            let relative = estimate.parameters.iter().map(|p| p.relative_standard_deviation);
            let mut relative: Vec<f64> = relative.collect();
            relative.sort_by(f64::total_cmp);
            let median = relative[relative.len() / 2];
            println!(
                "{name}, {stiffness} times the bandwidth: moved by {shift:.2} standard deviations, \
                 of which the median is {:.2} %, {} simulations",
                100.0 * median,
                estimate.simulations
            );
            // Noise alone moves by 1 ± 0.13 (28 parameters), 15 % in units of the standard
            // deviations by as much again.
            let insensitive = estimate.verdict.failure == Some(Failure::Insensitive);
            assert_eq!(insensitive, stiff && name == "CLOE", "{:?}", estimate.verdict);
            if stiff && name == "CLOE" {
                assert!(shift < 2.0 && median > 0.1, "{shift} {median}");
            } else {
                assert!(shift > 100.0 && median < 0.01, "{name} {stiffness}: {shift} {median}");
            }
        }
    }
}
