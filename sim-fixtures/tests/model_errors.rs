//! Errors put into the simulated arm on purpose do what they say and nothing else.
#![allow(clippy::float_cmp, reason = "what must be the same bits is compared as such")]

use crate::common::experiment::{experiment, listed, regression};
use didim_dynamics::dynamics::{BaseParameters, Model, Workspace};
use didim_dynamics::robot::{NamedFrame, SignModel};
use didim_dynamics::simulation::{
    Cogging, FlexibleMode, MaxwellSlip, NoiseConfig, Record, Stribeck, Unmodelled,
};
use didim_identification::identification::{FindingCode, Method, identify};
use didim_sim::{Payload, Scenario, ScenarioError, tx40_paper, tx40_physical};

const SAMPLES: usize = 2000;

fn run(scenario: &Scenario) -> Record {
    scenario.closed_loop().unwrap().run(SAMPLES).unwrap()
}

fn stribeck() -> Unmodelled {
    let of_joint = Stribeck { torque_nm: 0.7, velocity_rad_s: 0.1, sign_width_rad_s: 0.05 };
    Unmodelled { stribeck: Some(vec![of_joint; 6]), ..Default::default() }
}

fn quiet() -> Scenario {
    tx40_paper().unwrap().with_noise(NoiseConfig::with_seed(0)).unwrap()
}

/// What the model leaves of the torques is `expected` of the position and velocity, at every
/// sample.
fn assert_model_error(
    unmodelled: Unmodelled,
    mut expected: impl FnMut(&[f64; 6], &[f64; 6]) -> [f64; 6],
) {
    assert_model_error_by_load(unmodelled, |q, dq, _| expected(q, dq));
}

/// The same of the load as well, the torque on links and rotors.
fn assert_model_error_by_load(
    unmodelled: Unmodelled,
    mut expected: impl FnMut(&[f64; 6], &[f64; 6], &[f64; 6]) -> [f64; 6],
) {
    let scenario = quiet().with_unmodelled(unmodelled).unwrap();
    let model = Model::new(scenario.robot());
    let (mut ws, mut torque, mut friction) = (Workspace::new(), [0.0; 6], [0.0; 6]);
    let mut closed_loop = scenario.closed_loop().unwrap();
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
        let [position, velocity] =
            [&sample.true_position_rad, &sample.true_velocity_rad_s].map(|signal| &signal[..6]);
        let parameters = scenario.standard_parameters();
        model.friction(&mut ws, parameters, position, velocity, &mut friction);
        let load = core::array::from_fn(|j| torque[j] - friction[j]);
        let motion = [&sample.true_position_rad, &sample.true_velocity_rad_s]
            .map(|signal| signal[..6].try_into().unwrap());
        let expected = expected(&motion[0], &motion[1], &load);
        for j in 0..6 {
            let missing = sample.joint_torque_nm[j] - torque[j];
            assert!((missing - expected[j]).abs() < 1e-9, "sample {k}, joint {j}: {missing}");
            largest = largest.max(missing.abs());
        }
    }
    assert!(largest > 0.3, "the error does nothing: {largest}");
    assert_ne!(run(&quiet()).true_position_rad, run(&scenario).true_position_rad);
}

#[test]
fn unmodelled_friction_is_what_the_model_lacks() {
    let friction = stribeck().stribeck.unwrap();
    assert_model_error(stribeck(), |_, dq| core::array::from_fn(|j| friction[j].torque(dq[j])));
}

/// The ripple of motor 6 is felt by joints 5 and 6, and drives.
#[test]
fn ripple_goes_with_the_angle_of_the_motor() {
    let ripple = |torque_nm| Cogging { torque_nm, periods_per_turn: 6, phase_rad: 0.7 };
    let cogging = [0.05, 0.05, 0.03, 0.01, 0.01, 0.02].map(ripple);
    let unmodelled = Unmodelled { cogging: Some(cogging.to_vec()), ..Default::default() };
    assert_model_error(unmodelled, |q, _| {
        let motor_rad = [
            32.0 * q[0],
            32.0 * q[1],
            45.0 * q[2],
            -48.0 * q[3],
            45.0 * q[4],
            32.0 * (q[4] + q[5]),
        ];
        let m: [f64; 6] =
            core::array::from_fn(|j| cogging[j].torque_nm * (6.0 * motor_rad[j] + 0.7).sin());
        let joint = [
            32.0 * m[0],
            32.0 * m[1],
            45.0 * m[2],
            -48.0 * m[3],
            45.0 * m[4] + 32.0 * m[5],
            32.0 * m[5],
        ];
        joint.map(|torque| -torque)
    });
}

#[test]
fn coulomb_friction_can_grow_with_the_load() {
    let share = 0.1;
    let unmodelled = Unmodelled { load_friction: Some(vec![share; 6]), ..Default::default() };
    assert_model_error_by_load(unmodelled, |_, dq, load| {
        core::array::from_fn(|j| share * load[j].abs() * (dq[j] / 0.05).tanh())
    });
}

#[test]
fn friction_can_lag_at_reversals() {
    let element = MaxwellSlip { torque_nm: 0.7, stiffness_nm_rad: 350.0 };
    let unmodelled = Unmodelled { hysteresis: Some(vec![element; 6]), ..Default::default() };
    let mut friction_before: Option<([f64; 6], [f64; 6])> = None;
    assert_model_error(unmodelled, |q, _| {
        let (before, friction) = friction_before.unwrap_or((*q, [0.0; 6]));
        let friction =
            core::array::from_fn(|j| (friction[j] + 350.0 * (q[j] - before[j])).clamp(-0.7, 0.7));
        friction_before = Some((*q, friction));
        friction
    });
}

/// fc (tanh(q̇/0.2) − tanh(q̇/0.05)), with motor 6's where joints 5 and 6 move together.
#[test]
fn coulomb_friction_can_be_wider_than_the_model_s() {
    let unmodelled = Unmodelled { coulomb_width_rad_s: Some(0.2), ..Default::default() };
    let scenario = quiet();
    let fc = |name: &str| scenario.truth_of(name).unwrap();
    let joint: [f64; 6] = core::array::from_fn(|j| fc(&format!("fc{}", j + 1)));
    let less = |v: f64| (v / 0.2).tanh() - (v / 0.05).tanh();
    assert!(matches!(scenario.robot().sign_model(0), SignModel::Tanh { width_rad_s: 0.05 }));
    assert_model_error(unmodelled, |_, dq| {
        let mut torque: [f64; 6] = core::array::from_fn(|j| joint[j] * less(dq[j]));
        let coupled = fc("fc_m6") * less(dq[4] + dq[5]);
        torque[4] += coupled;
        torque[5] += coupled;
        torque
    });
}

/// Flexible joints: what identification finds is the whole inertia, the better the stiffer they
/// are.
#[test]
fn slow_motion_of_a_flexible_arm_has_the_whole_inertia() {
    fn largest(frequency_hz: f64) -> f64 {
        let mode =
            |inertia_kg_m2| FlexibleMode { frequency_hz, damping_ratio: 0.05, inertia_kg_m2 };
        let inertia = [0.4, 0.3, 0.04, 0.01, 0.01, 0.003];
        let flexible = Some(inertia.map(mode).to_vec());
        let scenario =
            quiet().with_unmodelled(Unmodelled { flexible, ..Default::default() }).unwrap();
        let options = regression(Some(listed(&scenario)), 300.0);
        let base = BaseParameters::compute(&Model::new(scenario.robot())).unwrap();
        let experiment = experiment(&scenario);
        let estimate = identify(Method::IdimLs, scenario.robot(), &base, &experiment, &options)
            .unwrap()
            .estimate;
        let inertias = estimate.parameters.iter().filter(|p| p.name.starts_with("zz"));
        inertias.fold(0.0, |largest: f64, p| {
            largest.max((p.value / scenario.truth_of(&p.name).unwrap() - 1.0).abs())
        })
    }
    let (soft, stiff) = (largest(60.0), largest(120.0));
    println!("{soft:.4} {stiff:.4}");
    assert!(stiff < 0.01 && soft > 2.0 * stiff, "{soft} {stiff}");
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
    let scenario_with =
        |correlation_s| tx40_paper().unwrap().with_noise(noise(correlation_s)).unwrap();
    // The scenario as shipped has this very noise.
    assert_eq!(run(&tx40_paper().unwrap()), run(&scenario_with(None)));
    assert_ne!(run(&scenario_with(None)), run(&scenario_with(Some(0.02))));
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
    assert_eq!(scenario.truth(), tx40_paper().unwrap().truth());
    let loaded = format!("{text}[payload]\nmass_kg = 1.0\nposition_m = [0.0, 0.0, 0.165]\n");
    let loaded = Scenario::from_toml(&loaded, robot.clone()).unwrap();
    let payload = Payload::point_mass(1.0, [0.0, 0.0, 0.165]);
    assert_eq!(loaded, scenario.with_payload(payload).unwrap());
    let body = format!(
        "{text}[payload]\nmass_kg = 1.0\nfirst_moment_kg_m = [0.0, 0.0, 0.165]\n\
         inertia_kg_m2 = [0.027225, 0.0, 0.0, 0.027225, 0.0, 0.0]\n"
    );
    let body = Scenario::from_toml(&body, robot.clone()).unwrap();
    for (body, point) in body.standard_parameters().iter().zip(loaded.standard_parameters()) {
        assert!((body - point).abs() < 1e-15);
    }
    // In the frame of a link: x of the frame is z of the model, and it begins 0.1 m up.
    let frame = NamedFrame {
        name: "tool0".into(),
        origin_m: [0.0, 0.0, 0.1],
        axes: [[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]],
    };
    let of_urdf = robot.clone().with_frames(vec![frame]);
    let point = "[payload]\nmass_kg = 1.0\nposition_m = [0.065, 0.0, 0.0]\n";
    let named = format!("{text}{point}frame = \"tool0\"\n");
    let named = Scenario::from_toml(&named, of_urdf.clone()).unwrap();
    for (own, point) in named.standard_parameters().iter().zip(loaded.standard_parameters()) {
        assert!((own - point).abs() < 1e-12, "{own} {point}");
    }
    assert!(named.findings().is_empty() && loaded.findings().is_empty());
    let unnamed = Scenario::from_toml(&format!("{text}{point}"), of_urdf).unwrap();
    assert_eq!(unnamed.findings()[0].code, FindingCode::LoadFrame);
    let other = format!("{text}{point}frame = \"tool1\"\n");
    let error = Scenario::from_toml(&other, robot.clone()).unwrap_err();
    assert!(matches!(error, ScenarioError::Frame(_)), "{error}");
    let neither = format!("{text}[payload]\nmass_kg = 1.0\n");
    let error = Scenario::from_toml(&neither, robot.clone()).unwrap_err();
    assert!(error.to_string().contains("position_m"), "{error}");
    let error = Scenario::from_toml(&text.replace("torque_gain", "gain"), robot).unwrap_err();
    assert!(error.to_string().contains("gain"), "{error}");
}

/// Twice the bandwidth leaves a quarter of the error; what is no factor is refused.
#[test]
fn the_bandwidth_is_a_factor() {
    let scenario = quiet();
    fn largest_error(scenario: &Scenario) -> f64 {
        let record = run(scenario);
        (record.true_position_rad - record.joint_reference_rad).column(0).amax()
    }
    let ratio =
        largest_error(&scenario) / largest_error(&scenario.clone().with_bandwidth(2.0).unwrap());
    assert!((ratio - 4.0).abs() < 1.0, "{ratio}");
    for factor in [0.0, -1.0, f64::NAN] {
        let error = scenario.clone().with_bandwidth(factor).unwrap_err();
        assert!(error.to_string().contains("times the bandwidth"), "{error}");
    }
}
