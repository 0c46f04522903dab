//! DIDIM on the simulated TX40.

use crate::common::experiment::{MOTIONS, experiment, loop_options, on_motion, with_nominal_error};
use didim_dynamics::control::SimulatedController;
use didim_dynamics::dynamics::{BaseParameters, Model};
use didim_dynamics::robot::{JointIndex, Robot, SignModel};
use didim_dynamics::simulation::{ClosedLoop, InitialState, SimulationConfig, SimulationError};
use didim_dynamics::{SignalTiming, Signals};
use didim_identification::identification::{
    self, Estimate, Experiment, IdentificationError, IterationError, Method, Note, Options,
    ReferenceSource, Start, mean_joint_inertia,
};
use didim_sim::{Scenario, tx40_paper};
use nalgebra::{DMatrix, DVectorView};

/// One sample in `every` of the scenario's loop, as a log holds it; no reference when it is not
/// `recorded`.
fn record(
    scenario: &Scenario,
    robot: &Robot,
    simulation: &SimulationConfig,
    every: usize,
    recorded: bool,
) -> Experiment {
    let record = ClosedLoop::new(
        robot,
        scenario.standard_parameters(),
        scenario.controller(),
        scenario.trajectory(),
        simulation,
        InitialState::OnReference,
    )
    .unwrap()
    .run(scenario.samples())
    .unwrap();
    fn columns(matrix: &DMatrix<f64>, every: &usize) -> Vec<Vec<f64>> {
        let column = |c: DVectorView<'_, f64>| c.iter().copied().step_by(*every).collect();
        matrix.column_iter().map(column).collect()
    }
    let signals = Signals {
        sample_rate_hz: record.sample_rate_hz / every as f64,
        position_rad: columns(&record.motor_position_rad, &every),
        torque_nm: columns(&record.motor_torque_nm, &every),
        reference_rad: recorded.then(|| columns(&record.motor_reference_rad, &every)),
    };
    let hold_s = scenario.controller().timing.sample_period_s();
    Experiment::motor_side(&signals, robot.transmission())
        .unwrap()
        .with_torque_timing(SignalTiming { hold_s, delay_s: 0.0 })
        .unwrap()
}

/// The scenario with its noise and encoders.
fn noisy(scenario: &Scenario) -> Experiment {
    record(scenario, scenario.robot(), scenario.simulation(), 1, true)
}

/// The paper's settings and start.
fn options(scenario: &Scenario) -> Options {
    loop_options(scenario, 50.0, Start::UnitDriveInertias)
}

fn identify(
    robot: &Robot,
    experiment: &Experiment,
    options: &Options,
) -> Result<Estimate, IdentificationError> {
    let base = BaseParameters::compute(&Model::new(robot)).unwrap();
    identification::identify(Method::Didim, robot, &base, experiment, options)
        .map(|found| found.estimate)
}

/// Largest difference of two estimates, in the first one's standard deviations.
fn difference(a: &Estimate, b: &Estimate) -> f64 {
    let pairs = a.parameters.iter().zip(&b.parameters);
    pairs.fold(0.0, |largest: f64, (a, b)| {
        largest.max((a.value - b.value).abs() / a.standard_deviation)
    })
}

/// Root mean square and largest of the deviations from the truth, in standard deviations.
fn deviations(scenario: &Scenario, estimate: &Estimate) -> (f64, f64) {
    let z = |p: &identification::ParameterEstimate| {
        (p.value - scenario.truth_of(&p.name).unwrap()) / p.standard_deviation
    };
    let z: Vec<f64> = estimate.parameters.iter().map(z).collect();
    let mean_square = z.iter().map(|z| z * z).sum::<f64>() / z.len() as f64;
    (mean_square.sqrt(), z.iter().fold(0.0, |largest: f64, z| largest.max(z.abs())))
}

/// No noise, ideal encoders. The initial velocity is known as well as the filter shows it, and the
/// loop forgets it in the two seconds that do not count (one second would leave 1e-9).
#[test]
fn without_noise_the_paper_s_start_leads_to_the_truth() {
    let scenario = tx40_paper().unwrap();
    let experiment = record(&scenario, scenario.robot(), &SimulationConfig::default(), 1, true)
        .with_counted(10000..scenario.samples() - 500)
        .unwrap();
    let mut options = options(&scenario);
    // Standard deviations of IDIM-LS, which are up to 1e-2 of the parameters.
    options.simulation.convergence.parameter_change = 1e-8;
    let estimate = identify(scenario.robot(), &experiment, &options).unwrap();
    let largest = estimate.parameters.iter().fold(0.0, |largest: f64, p| {
        largest.max((p.value / scenario.truth_of(&p.name).unwrap() - 1.0).abs())
    });
    println!("{largest:.1e} after {} simulations", estimate.simulations);
    // Machine precision times the condition number, some 2e3, is 1e-12 of the largest parameter;
    // the smallest is a thousandth of that.
    assert!(largest < 1e-9, "{largest}");
}

#[test]
fn every_start_leads_to_one_result_with_fixed_gains_and_with_gains_that_follow() {
    let scenario = tx40_paper().unwrap();
    let experiment = noisy(&scenario);
    let model = Model::new(scenario.robot());
    // Over the rows, as the gains that follow take it.
    let rows: Vec<usize> = (0..scenario.samples()).step_by(125).collect();
    let postures = experiment.position_rad().select_rows(&rows);
    let inertia = mean_joint_inertia(&model, scenario.standard_parameters(), &postures);
    for rescale in [false, true] {
        let mut first: Option<Estimate> = None;
        for (start, most) in
            [(Start::UnitDriveInertias, 10), (Start::Nominal, 4), (Start::IdimLs, 4)]
        {
            let mut options = options(&scenario);
            options.simulation.start = start;
            if let Some(SimulatedController::Cabinet { rescale_to_inertia_kg_m2, .. }) =
                &mut options.controller
            {
                *rescale_to_inertia_kg_m2 = rescale.then(|| inertia.clone());
            }
            let estimate = identify(scenario.robot(), &experiment, &options).unwrap();
            assert!(estimate.simulations <= most, "{start:?} {rescale}: {}", estimate.simulations);
            assert!(estimate.verdict.applicable && estimate.verdict.notes.is_empty());
            assert_eq!(estimate.reference, Some(ReferenceSource::Recorded));
            // 28 parameters: the rms of white deviations is 1 ± 0.13, and the classical σ is small
            // by 1.12.
            let (rms, largest) = deviations(&scenario, &estimate);
            assert!(rms < 1.5 && largest < 4.0, "{start:?} {rescale}: {rms} {largest}");
            // Gains that follow the estimate share its noise: the starts are compared among
            // themselves.
            let first = first.get_or_insert_with(|| estimate.clone());
            let difference = difference(first, &estimate);
            println!(
                "{start:?}, rescaled {rescale}: {} simulations, rms {rms:.2}, {difference:.3} from \
                the first",
                estimate.simulations
            );
            assert!(difference < 0.1, "{start:?} {rescale}: {difference}");
        }
    }
}

/// Behind a position filter that leaves the reversals of friction, IDIM-LS is within two standard
/// deviations of DIDIM: the first simulation leads to its answer, and the second confirms it.
#[test]
fn from_idim_ls_two_simulations_give_the_answer_of_every_other_start() {
    for motion in MOTIONS {
        let scenario = on_motion(motion);
        let experiment = experiment(&scenario);
        let identified_from = |robot: &Robot, start| {
            identify(robot, &experiment, &loop_options(&scenario, 200.0, start)).unwrap()
        };
        let near = identified_from(scenario.robot(), Start::IdimLs);
        assert_eq!(near.simulations, 2, "{motion:?}");
        for other in [
            identified_from(scenario.robot(), Start::UnitDriveInertias),
            identified_from(&with_nominal_error(&scenario, 0x9e37_79b9_7f4a_7c15), Start::Nominal),
            identified_from(&with_nominal_error(&scenario, 0x6a09_e667_f3bc_c908), Start::Nominal),
        ] {
            let difference = difference(&other, &near);
            println!("{motion:?}: {difference:.3} from {} simulations", other.simulations);
            assert!(difference < 0.1, "{motion:?}: {difference}");
            let [near, other] = [&near.verdict, &other.verdict];
            assert_eq!(near.reasons, other.reasons, "{motion:?}");
            assert_eq!(near.notes, other.notes, "{motion:?}");
        }
    }
}

/// The drive inertias of joints 5 and 6 are then [[1, 1], [1, 1]]: joint 5 has none left while
/// joint 6 is free.
#[test]
fn a_start_without_what_the_coupling_adds_to_joint_5_is_singular() {
    let scenario = tx40_paper().unwrap();
    let file = include_str!("../../config/robots/tx40.toml");
    let (geometry, _) = file.split_once("[nominal]").unwrap();
    let start = "zz1r = 1.0\nzz2r = 1.0\nia3 = 1.0\nia4 = 1.0\nia5 = 1.0\nia6 = 1.0\n";
    let robot = Robot::from_toml(&format!("{geometry}[nominal]\n{start}")).unwrap();
    let mut options = options(&scenario);
    options.simulation.start = Start::Nominal;
    let error = identify(&robot, &noisy(&scenario), &options).unwrap_err();
    let cause = SimulationError::NotPositiveDefinite { joint: JointIndex::new(4), time_s: 0.0 };
    assert_eq!(error, IdentificationError::Iteration(IterationError::FirstSimulation { cause }));
    assert!(error.to_string().contains("at joint 5") && error.to_string().contains("start"));
}

/// The same data with fewer or more rows. The standard deviations without a filter take 207,000
/// rows for independent, and white they are here.
#[test]
fn with_and_without_the_decimation_filter_the_result_is_the_same() {
    let scenario = tx40_paper().unwrap();
    let experiment = noisy(&scenario);
    let mut options = options(&scenario);
    let filtered = identify(scenario.robot(), &experiment, &options).unwrap();
    options.simulation.decimated = false;
    let strict = identify(scenario.robot(), &experiment, &options).unwrap();
    assert_eq!(filtered.rows, 6 * 276);
    assert_eq!(strict.rows, 6 * scenario.samples());
    for (a, b) in filtered.parameters.iter().zip(&strict.parameters) {
        let deviation = a.standard_deviation.hypot(b.standard_deviation);
        assert!((a.value - b.value).abs() < 4.0 * deviation, "{a:?} {b:?}");
    }
}

/// tanh(v/0.01) makes the friction of joint 6 at rest so stiff that ode3 at 5 kHz chatters, where
/// the real arm, integrated in eighths of that step, rests.
#[test]
fn chatter_at_rest_does_not_keep_the_estimates_from_standing_still() {
    let scenario = tx40_paper().unwrap();
    let sign_model = SignModel::Tanh { width_rad_s: 0.01 };
    let robot = scenario.robot().clone().with_sign_model(sign_model);
    let mut simulation = scenario.simulation().clone();
    simulation.substeps = 8;
    let experiment = record(&scenario, &robot, &simulation, 1, true);
    // That it does chatter: at rest, joint 6 changes its direction nearly every step.
    fn at_rest(simulation: &SimulationConfig, robot: &Robot, scenario: &Scenario) -> usize {
        let mut closed_loop = ClosedLoop::new(
            robot,
            scenario.standard_parameters(),
            scenario.controller(),
            scenario.trajectory(),
            simulation,
            InitialState::OnReference,
        )
        .unwrap();
        let velocity = closed_loop.run(150).unwrap().true_velocity_rad_s;
        let velocity = velocity.column(5);
        let turns = velocity.as_slice()[50..].windows(2).filter(|v| v[0] * v[1] < 0.0);
        turns.count()
    }
    let quiet = SimulationConfig { substeps: 8, ..SimulationConfig::default() };
    let turns = (
        at_rest(&SimulationConfig::default(), &robot, &scenario),
        at_rest(&quiet, &robot, &scenario),
    );
    println!("turns of joint 6 at rest in 99 steps: {} and {}", turns.0, turns.1);
    assert!(turns.0 > 50 && turns.1 < 10, "{turns:?}");

    let estimate = identify(&robot, &experiment, &options(&scenario)).unwrap();
    assert!(estimate.simulations <= 10, "{:?}", estimate.convergence);
    let (rms, largest) = deviations(&scenario, &estimate);
    println!("rms of the deviations: {rms:.2}, largest {largest:.1}");
    assert!(rms < 1.5 && largest < 4.0, "{rms} {largest}");
}

/// A bus that shows one command in ten, each held for a tenth of the bus's period.
#[test]
fn a_bus_slower_than_the_controller_shows_enough() {
    let scenario = tx40_paper().unwrap();
    let experiment = record(&scenario, scenario.robot(), scenario.simulation(), 10, true);
    let mut options = options(&scenario);
    options.decimation_filter.factor = 12;
    let estimate = identify(scenario.robot(), &experiment, &options).unwrap();
    assert!(estimate.simulations <= 10, "{:?}", estimate.convergence);
    let (rms, largest) = deviations(&scenario, &estimate);
    println!("rms of the deviations: {rms:.2}, largest {largest:.1}");
    assert!(rms < 1.5 && largest < 4.0, "{rms} {largest}");
}

/// The measured position stands in for the reference, so that a stiffer loop follows the measured
/// motion more closely, and the result comes closer to that of IDIM-LS: the lag goes with the
/// inverse of the bandwidth (friction over 2 ζ J ω) or faster.
#[test]
fn without_a_reference_a_stiffer_loop_is_nearer_to_idim_ls() {
    let scenario = tx40_paper().unwrap();
    let experiment = record(&scenario, scenario.robot(), scenario.simulation(), 1, false);
    let mut options = options(&scenario);
    let base = BaseParameters::compute(&Model::new(scenario.robot())).unwrap();
    let equation_error =
        identification::identify(Method::IdimLs, scenario.robot(), &base, &experiment, &options)
            .unwrap()
            .estimate;
    let differences = [25.0, 50.0, 100.0].map(|bandwidth_hz| {
        options.controller = Some(SimulatedController::Bandwidth {
            timing: scenario.controller().timing,
            bandwidth_hz: vec![bandwidth_hz; 6],
            damping: 0.8,
            acceleration_feed_forward: true,
        });
        let estimate = identify(scenario.robot(), &experiment, &options).unwrap();
        assert_eq!(estimate.reference, Some(ReferenceSource::MeasuredPosition));
        assert!(
            estimate.verdict.notes.contains(&Note::NoReference),
            "{:?}",
            estimate.verdict.notes
        );
        let pairs = estimate.parameters.iter().zip(&equation_error.parameters);
        let squares: f64 = pairs.map(|(a, b)| (a.value / b.value - 1.0).powi(2)).sum();
        (squares / 28.0).sqrt()
    });
    println!("rms of the relative differences: {differences:.4?}");
    assert!(differences[1] < 0.5 * differences[0] && differences[2] < 0.5 * differences[1]);
}
