//! Errors put into the simulated arm on purpose do what they say and nothing else.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
#![allow(clippy::float_cmp, reason = "what must be the same bits is compared as such")]

use didim_core::dynamics::{Model, Workspace};
use didim_core::simulation::{NoiseConfig, Record, Stribeck, Unmodelled};
use didim_sim::{Payload, Scenario, tx40_paper, tx40_physical};

const SAMPLES: usize = 2000;

fn run(scenario: &Scenario) -> Record {
    scenario.closed_loop().unwrap().run(SAMPLES).unwrap()
}

fn stribeck() -> Unmodelled {
    let of_joint = Stribeck { torque_nm: 0.7, velocity_rad_s: 0.1, width_rad_s: 0.05 };
    Unmodelled { stribeck: Some(vec![of_joint; 6]), ..Default::default() }
}

/// What the model's friction leaves of the torque is the Stribeck torque, at every sample.
#[test]
fn unmodelled_friction_is_what_the_model_lacks() {
    let quiet = tx40_paper().unwrap().with_noise(NoiseConfig::with_seed(0)).unwrap();
    let scenario = quiet.clone().with_unmodelled(stribeck()).unwrap();
    let model = Model::new(scenario.robot());
    let (mut ws, mut torque) = (Workspace::new(), [0.0; 6]);
    let mut closed_loop = scenario.closed_loop().unwrap();
    let friction = stribeck().stribeck.unwrap();
    let mut largest = 0.0_f64;
    for k in 0..SAMPLES {
        let sample = closed_loop.step().unwrap();
        model.inverse_dynamics(
            &mut ws,
            scenario.standard_parameters(),
            &sample.true_position_rad[..6],
            &sample.true_velocity_rad_s[..6],
            &sample.true_acceleration_rad_s2[..6],
            &mut torque,
        );
        for j in 0..6 {
            let lacking = sample.joint_torque_nm[j] - torque[j];
            let expected = friction[j].torque(sample.true_velocity_rad_s[j]);
            assert!((lacking - expected).abs() < 1e-9, "sample {k}, joint {j}: {lacking}");
            largest = largest.max(lacking.abs());
        }
    }
    assert!(largest > 0.3, "the friction does nothing: {largest}");
    assert_ne!(run(&quiet).true_position_rad, run(&scenario).true_position_rad);
}

/// A wrong gain of motor 6 is seen in joints 5 and 6, which it drives; the motion is the same.
#[test]
fn a_wrong_gain_is_in_the_log_only() {
    let right = tx40_paper().unwrap();
    let gains = vec![1.0, 1.0, 1.0, 1.0, 1.0, 1.05];
    let wrong = right
        .clone()
        .with_unmodelled(Unmodelled { torque_gain: Some(gains), ..Default::default() })
        .unwrap();
    let (right, wrong) = (run(&right), run(&wrong));
    assert_eq!(right.true_position_rad, wrong.true_position_rad);
    assert_eq!(right.motor_position_rad, wrong.motor_position_rad);
    for k in 0..SAMPLES {
        for j in 0..5 {
            assert_eq!(right.motor_torque_nm[(k, j)], wrong.motor_torque_nm[(k, j)]);
        }
        let motor = right.motor_torque_nm[(k, 5)];
        assert_eq!(motor * 1.05, wrong.motor_torque_nm[(k, 5)]);
        // τ5 = 45 τ_m5 + 32 τ_m6, τ6 = 32 τ_m6
        for j in [4, 5] {
            let more = wrong.joint_torque_nm[(k, j)] - right.joint_torque_nm[(k, j)];
            assert!((more - 0.05 * 32.0 * motor).abs() < 1e-12, "sample {k}, joint {j}: {more}");
        }
    }
}

/// A payload is carried: the last joint of a straight arm that lies flat holds its weight, and the
/// truth is that of the arm alone.
#[test]
fn a_payload_is_carried_and_not_part_of_the_truth() {
    let alone = tx40_physical().unwrap();
    let loaded = alone.clone().with_payload(Payload::point_mass(1.0, [0.02, 0.0, 0.165])).unwrap();
    assert_eq!(alone.truth(), loaded.truth());
    let model = Model::new(alone.robot());
    let mut ws = Workspace::new();
    let mut torque = |scenario: &Scenario, q: [f64; 6], ddq: [f64; 6]| {
        let mut torque = [0.0; 6];
        let parameters = scenario.standard_parameters();
        model.inverse_dynamics(&mut ws, parameters, &q, &[0.0; 6], &ddq, &mut torque);
        torque
    };
    // Joint 2 turned by 90°: the payload's lever about it is 0.225 + 0.225 + 0.165 m.
    let flat = [0.0, core::f64::consts::FRAC_PI_2, 0.0, 0.0, 0.0, 0.0];
    let still = [0.0; 6];
    let more = torque(&loaded, flat, still)[1] - torque(&alone, flat, still)[1];
    assert!((more.abs() - 9.81 * 0.615).abs() < 1e-9, "{more}");
    // About joint 6 it adds m x² to the inertia.
    let spin = [0.0, 0.0, 0.0, 0.0, 0.0, 1.0];
    let mut inertia =
        |scenario| torque(scenario, still, spin)[5] - torque(scenario, still, still)[5];
    let more = inertia(&loaded) - inertia(&alone);
    assert!((more - 0.02 * 0.02).abs() < 1e-12, "{more}");
    assert_ne!(run(&alone).true_position_rad, run(&loaded).true_position_rad);
}

#[test]
fn a_correlation_time_changes_the_disturbance_and_nothing_else() {
    let noise = |correlation_s| NoiseConfig {
        disturbance_torque_nm: Some(vec![0.05; 6]),
        disturbance_correlation_s: correlation_s,
        ..NoiseConfig::with_seed(1)
    };
    let with = |correlation_s| tx40_paper().unwrap().with_noise(noise(correlation_s)).unwrap();
    // The scenario as shipped has this very noise.
    assert_eq!(run(&tx40_paper().unwrap()), run(&with(None)));
    assert_ne!(run(&with(None)), run(&with(Some(0.02))));
    let error = tx40_paper().unwrap().with_noise(noise(Some(0.0))).unwrap_err();
    assert!(error.to_string().contains("disturbance_correlation_s = 0"), "{error}");
}

/// What a scenario's file says reaches the loop, and a wrong key is refused.
#[test]
fn a_file_can_put_them_in() {
    let robot = tx40_paper().unwrap().robot().clone();
    let shipped = include_str!("../scenarios/tx40-paper.toml");
    let text = format!(
        "{shipped}disturbance_correlation_s = 0.02\n[simulation.unmodelled]\n\
         torque_gain = [1.0, 1.0, 1.05, 1.0, 1.0, 1.0]\n"
    );
    let scenario = Scenario::from_toml(&text, robot.clone()).unwrap();
    let simulation = scenario.simulation();
    assert_eq!(simulation.noise.as_ref().unwrap().disturbance_correlation_s, Some(0.02));
    assert_eq!(simulation.unmodelled.as_ref().unwrap().torque_gain.as_ref().unwrap()[2], 1.05);
    let error = Scenario::from_toml(&text.replace("torque_gain", "gain"), robot).unwrap_err();
    assert!(error.to_string().contains("gain"), "{error}");
}
