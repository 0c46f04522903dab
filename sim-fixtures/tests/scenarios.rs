//! The shipped scenarios do what they are for.
#![allow(clippy::float_cmp, reason = "what is set to zero is zero")]

use didim_dynamics::dynamics::{Model, Workspace};
use didim_dynamics::robot::{JointIndex, Robot};
use didim_dynamics::simulation::{ClosedLoop, InitialState, SimulationError};
use didim_dynamics::trajectory::{Reference, SampledReference};
use didim_sim::{PlaybackConfig, Scenario, ScenarioError, tx40_paper, tx40_physical};
use nalgebra::DMatrix;

const PAPER: &str = include_str!("../scenarios/tx40-paper.toml");
const ROBOT: &str = include_str!("../../config/robots/tx40.toml");

#[test]
fn the_paper_s_truth_is_its_28_parameters() {
    let scenario = tx40_paper().unwrap();
    let set: Vec<_> = scenario.truth().iter().filter(|(_, value)| *value != 0.0).collect();
    assert_eq!(set.len(), 28);
    for (name, value) in [("zz1r", 1.24), ("my3r", -0.60), ("ia6", 0.01), ("fc_m6", 1.90)] {
        let truth = scenario.truth_of(name).unwrap();
        assert!((truth - value).abs() < 1e-12, "{name}: {truth}");
    }
    assert_eq!(scenario.truth_of("xx9"), None);
}

#[test]
fn the_physical_truth_is_regrouped() {
    let truth = tx40_physical().unwrap();
    // ZZ1R = ZZ1 + Ia1 + YY2 + YY3 + 0.07 MZ3 + 0.05185 (M3 + M4 + M5 + M6)
    let expected =
        0.352 + 0.362 + 0.0881 + 0.0224 + 0.07 * 0.265 + 0.05185 * (4.07 + 3.62 + 1.02 + 0.2);
    assert!((truth.truth_of("zz1r").unwrap() - expected).abs() < 1e-9);
}

/// Every joint follows its reference, no torque is limited, and the arm comes to rest.
#[test]
fn the_arm_tracks_the_motion() {
    for scenario in [tx40_paper().unwrap(), tx40_physical().unwrap()] {
        let record = scenario.closed_loop().unwrap().run(scenario.samples()).unwrap();
        assert_eq!((record.samples(), record.sample_rate_hz), (34_500, 5000.0));
        let error = &record.joint_reference_rad - &record.true_position_rad;
        for (j, limit) in scenario.robot().limits().enumerate() {
            let rms = (error.column(j).norm_squared() / 34_500.0).sqrt();
            let largest = error.column(j).amax();
            let torque = record.joint_torque_nm.column(j).amax() / limit.torque_max.unwrap();
            println!(
                "{} joint {}: error rms {:.2} mrad, largest {:.2} mrad, torque {:.2}",
                scenario.name(),
                j + 1,
                1e3 * rms,
                1e3 * largest,
                torque
            );
            assert!(rms < 4e-3 && largest < 10e-3, "joint {}: {rms} {largest}", j + 1);
            assert!(torque < 0.9, "joint {}", j + 1);
        }
        assert!(record.true_velocity_rad_s.row(34_499).amax() < 0.05);
    }
}

/// Inverse dynamics of the simulated motion is the torque that moved it, at every sample.
#[test]
fn the_motion_is_that_of_its_torque() {
    for scenario in [tx40_paper().unwrap(), tx40_physical().unwrap()] {
        let mut closed_loop = scenario.closed_loop().unwrap();
        let model = Model::new(scenario.robot());
        let mut ws = Workspace::new();
        let mut torque = [0.0; 6];
        for k in 0..10_000 {
            let sample = closed_loop.step().unwrap();
            model.inverse_dynamics(
                &mut ws,
                scenario.standard_parameters(),
                &sample.true_position_rad[..6],
                &sample.true_velocity_rad_s[..6],
                &sample.true_acceleration_rad_s2[..6],
                &mut torque,
            );
            for (j, (torque, felt)) in torque.iter().zip(&sample.true_torque_nm).enumerate() {
                let error = torque - felt;
                assert!(error.abs() < 1e-10, "sample {k}, joint {}: {error}", j + 1);
            }
        }
    }
}

/// As examples/tune_moves.rs computes it, on the motion as shipped.
#[test]
fn the_motion_excites_as_well_as_the_published_recording() {
    let scenario = tx40_paper().unwrap();
    let (robot, trajectory) = (scenario.robot(), scenario.trajectory());
    let model = Model::new(robot);
    let names = robot.nominal().unwrap().given_values();
    let columns: Vec<_> =
        names.iter().map(|(name, _)| robot.parameters().find(name).unwrap()).collect();
    let p = model.parameter_names().len();
    let mut ws = Workspace::new();
    let mut regressor = vec![0.0; 6 * p];
    let mut observation = DMatrix::zeros(1380 * 6, columns.len());
    for k in 0..1380_u32 {
        let [mut q, mut dq, mut ddq] = [[0.0; 6]; 3];
        trajectory.evaluate(f64::from(k) / 200.0, &mut q, &mut dq, &mut ddq);
        model.regressor(&mut ws, &q, &dq, &ddq, &mut regressor);
        for j in 0..6 {
            for (to, from) in columns.iter().enumerate() {
                observation[(k as usize * 6 + j, to)] = regressor[j * p + from];
            }
        }
    }
    let singular = observation.singular_values();
    let condition = singular.max() / singular.min();
    println!("condition number {condition:.1}");
    assert!((105.0..125.0).contains(&condition), "{condition}");
}

#[test]
fn the_noise_s_seed_decides() {
    let run = |seed| tx40_paper().unwrap().with_seed(seed).closed_loop().unwrap().run(50).unwrap();
    assert_eq!(run(5), run(5));
    assert_ne!(run(5), run(6));
}

fn refusal(text: &str) -> ScenarioError {
    Scenario::from_toml(text, Robot::from_toml(ROBOT).unwrap()).unwrap_err()
}

#[test]
fn what_is_wrong_with_a_scenario_is_said() {
    let error = refusal(&PAPER.replace("tail_s", "tial_s"));
    let line = 1 + PAPER.lines().position(|line| line.starts_with("tail_s")).unwrap();
    let ScenarioError::Format { line: found, message } = &error else { panic!("{error}") };
    assert!(found.abs_diff(line) <= 2, "line {found}, not {line}");
    assert!(message.contains("tial_s"), "{message}");

    let error = refusal(&PAPER.replace("robot = \"tx40\"", "robot = \"rx90\""));
    assert!(matches!(error, ScenarioError::OtherRobot { .. }), "{error}");
    let error = refusal(&PAPER.replace("0.118, 0.000]\nstart", "9.0, 0.000]\nstart"));
    assert!(error.to_string().contains("move 0, joint 5"), "{error}");
    let error = refusal(&PAPER.replace("kp_per_rad = 341.87", "kp_per_rad = nan"));
    assert!(error.to_string().contains("kp_per_rad"), "{error}");
    let error = refusal(&PAPER.replace("lead_in_s = 0.5", "lead_in_s = -0.5"));
    assert!(error.to_string().contains("playback.lead_in_s"), "{error}");
}

/// A limit that is nearly 0 makes a motion that never ends.
#[test]
fn a_motion_is_bounded() {
    let with = |from: &str, to: &str| refusal(&PAPER.replacen(from, to, 1));
    let accelerations = "acceleration_max_rad_s2 = [20.0, 20.0,";
    for (from, to, key, least_s) in [
        (accelerations, "acceleration_max_rad_s2 = [20.0, 1e-308,", "motion", 1e150),
        (accelerations, "acceleration_max_rad_s2 = [20.0, 1e-3,", "motion", 601.0),
        ("lead_in_s = 0.5", "lead_in_s = 1e9", "motion", 1e9),
        ("samples = 34500", "samples = 1000000000000", "samples", 2e8),
    ] {
        let error = with(from, to);
        let ScenarioError::TooLong { key: found, duration_s } = &error else { panic!("{error}") };
        assert!(*found == key && *duration_s >= least_s, "{error}");
        assert!(error.to_string().len() < 200, "{error}");
    }
    let points = DMatrix::from_element(3, 6, 0.0);
    let slow = SampledReference::new(1e-300, &points).unwrap();
    let error = tx40_paper().unwrap().with_recorded_motion(slow).unwrap_err();
    assert!(matches!(error, ScenarioError::TooLong { key: "motion", .. }), "{error}");
}

#[test]
fn a_motion_is_repeated_from_where_it_ended() {
    let playback = PlaybackConfig { lead_in_s: 0.5, tail_s: 0.25, cycles: None };
    let reference = tx40_paper().unwrap().with_playback(playback).unwrap().played_reference();
    assert!(reference.duration_s().is_infinite());
    let state_at = |t: f64| {
        let [mut q, mut dq, mut ddq] = [[0.0; 6]; 3];
        reference.evaluate(t, &mut q, &mut dq, &mut ddq);
        (q, dq)
    };
    for k in 0..100 {
        let t = 0.08 * f64::from(k);
        let ((q, dq), (q_later, dq_later)) = (state_at(t), state_at(t + 3.0 * reference.cycle_s()));
        for j in 0..6 {
            assert!((q[j] - q_later[j]).abs() < 1e-9 && (dq[j] - dq_later[j]).abs() < 1e-8);
        }
    }
    assert!(state_at(0.0).1.iter().all(|velocity| *velocity == 0.0));
}

/// The paper's start, every parameter 0 but ia_j = 1 and ia_5 = 2, can be simulated with the
/// arm's gains as long as its torque is not limited: an inertia of 1 kg·m² at joint 6 needs more
/// than the drive has. With ia_5 = 1 the coupling leaves no positive definite mass matrix.
#[test]
fn the_paper_s_start_can_be_simulated_and_its_reason_shows() {
    let scenario = tx40_paper().unwrap();
    let start = |ia5: f64| -> Vec<f64> {
        let value = |name: &String| match name.as_str() {
            "ia5" => ia5,
            // Ia1 and Ia2 are regrouped into ZZ1R and ZZ2R.
            "zz1" | "zz2" | "ia3" | "ia4" | "ia6" => 1.0,
            _ => 0.0,
        };
        scenario.robot().parameters().names().iter().map(value).collect()
    };
    let unlimited = scenario.controller().clone().without_torque_limits();
    let build = |controller| {
        let (robot, reference) = (scenario.robot(), scenario.trajectory());
        let initial = InitialState::OnReference;
        ClosedLoop::new(robot, &start(2.0), controller, reference, scenario.simulation(), initial)
            .unwrap()
    };
    let error = build(scenario.controller()).run(scenario.samples()).unwrap_err();
    assert!(
        matches!(error, SimulationError::Divergence { joint, .. } if joint.position() == 5),
        "{error}"
    );
    let mut closed_loop = build(&unlimited);
    let record = closed_loop.run(scenario.samples()).unwrap();
    let error = (&record.joint_reference_rad - &record.true_position_rad).amax();
    println!("largest error from the paper's start: {error:.4} rad");
    assert!(error < 0.5, "{error}");
    closed_loop.restart(&start(1.0)).unwrap();
    let error = closed_loop.step().unwrap_err();
    assert_eq!(
        error,
        SimulationError::NotPositiveDefinite { joint: JointIndex::new(4), time_s: 0.0 }
    );
}
