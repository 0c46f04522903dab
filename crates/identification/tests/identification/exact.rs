//! Exact torques give the parameters back, and what must not change the result does not.

use didim_identification::identification::{Experiment, Method, filtered_motion, identify};

use crate::common::arm::{Arm, Random, options, signals};

/// Largest deviation of a base parameter, relative to its value or to 0.1, whichever is more.
fn deviation(arm: &Arm, values: impl Iterator<Item = f64>) -> f64 {
    let truth = arm.true_base();
    values.zip(&truth).fold(0.0, |m: f64, (v, t)| m.max((v - t).abs() / t.abs().max(0.1)))
}

/// The torques belong to the very motion that the filters find.
#[test]
fn torques_of_the_filtered_motion_give_every_base_parameter_back() {
    for seed in 0..9 {
        let mut random = Random(seed);
        let mut arm = Arm::random(&mut random, 3);
        // Some of them with friction that grows with the load, or lags at reversals.
        match seed {
            5..=6 => arm = arm.with_load_friction(&mut random),
            7..=8 => arm = arm.with_hysteresis(&mut random),
            _ => {}
        }
        let mut options = options(20.0, 0.8, 10);
        // A random arm on a random motion: the values are judged, not the motion.
        options.limits.condition_number = 1e5;
        // These torques are exactly those of the filtered motion, not of the one before.
        options.limits.position_filter_deviations = f64::MAX;
        let position = arm.positions(&mut random, 4000, 400.0, 3.0);
        let silent = signals(400.0, position.clone(), position.clone());
        let motion = filtered_motion(
            &arm.robot,
            &Experiment::joint_side(&silent).unwrap(),
            &options.position_filter,
        )
        .unwrap();
        let experiment =
            Experiment::joint_side(signals(400.0, position, arm.torques(&motion))).unwrap();
        let identified =
            identify(Method::IdimLs, &arm.robot, &arm.base, &experiment, &options).unwrap();
        let estimate = &identified.estimate;
        assert_eq!(estimate.parameters.len(), arm.base.names().len());
        assert_eq!(estimate.rows, 3 * 400);
        let deviation = deviation(&arm, estimate.parameters.iter().map(|p| p.value));
        assert!(deviation < 1e-6, "seed {seed}: {deviation}");
        assert!(estimate.relative_error < 1e-9, "seed {seed}: {}", estimate.relative_error);
        assert!(estimate.verdict.applicable, "seed {seed}: {:?}", estimate.verdict);
    }
}

/// The same through gears and couplings: a motor-side recording is the joint-side one.
#[test]
fn motor_side_signals_give_the_same_result() {
    let mut random = Random(11);
    let arm = Arm::random(&mut random, 3);
    let options = options(20.0, 0.8, 10);
    let position = arm.positions(&mut random, 2000, 400.0, 3.0);
    let torque = arm.positions(&mut random, 2000, 400.0, 3.0);
    let transmission = arm.robot.transmission();
    let (mut motor_position, mut motor_torque) = (position.clone(), torque.clone());
    for k in 0..2000 {
        let mut motor = [0.0; 3];
        transmission.motor_position(&[0, 1, 2].map(|j| position[j][k]), &mut motor);
        (0..3).for_each(|j| motor_position[j][k] = motor[j]);
        transmission.motor_torque(&[0, 1, 2].map(|j| torque[j][k]), &mut motor);
        (0..3).for_each(|j| motor_torque[j][k] = motor[j]);
    }
    let joint = Experiment::joint_side(signals(400.0, position, torque)).unwrap();
    let motor = signals(400.0, motor_position, motor_torque);
    let motor = Experiment::motor_side(&motor, transmission).unwrap();
    let [a, b] = [joint, motor].map(|experiment| {
        identify(Method::IdimLs, &arm.robot, &arm.base, &experiment, &options).unwrap().estimate
    });
    for (a, b) in a.parameters.iter().zip(&b.parameters) {
        assert!((a.value - b.value).abs() < 1e-9 * a.standard_deviation.max(a.value.abs()));
    }
}

/// A column has the same bits whatever the others are.
#[test]
fn essential_parameters_have_the_columns_they_have_among_all() {
    use didim_identification::identification::{Selection, observation_matrix};

    let mut random = Random(3);
    let arm = Arm::random(&mut random, 3);
    let options = options(20.0, 0.8, 100);
    let position = arm.positions(&mut random, 20_000, 4000.0, 3.0);
    let silent = signals(4000.0, position.clone(), position);
    let experiment = Experiment::joint_side(&silent).unwrap();
    let motion = filtered_motion(&arm.robot, &experiment, &options.position_filter).unwrap();
    let decimation = options.decimation_filter.design().unwrap();
    fn matrix(
        names: Option<&[String]>,
        motion: &didim_identification::identification::Motion,
        decimation: &didim_identification::signal::ParallelDecimation,
        arm_robot: &didim_dynamics::robot::Robot,
        arm_base: &didim_dynamics::dynamics::BaseParameters,
        arm_model: &didim_dynamics::dynamics::Model,
    ) -> nalgebra::DMatrix<f64> {
        let selection = Selection::new(arm_robot, arm_base, names).unwrap();
        observation_matrix(arm_model, &selection, motion, decimation, 0..20_000).unwrap()
    }
    let full = matrix(None, &motion, &decimation, &arm.robot, &arm.base, &arm.model);
    for (index, name) in arm.base.names().iter().enumerate().step_by(5) {
        let alone = matrix(
            Some(std::slice::from_ref(name)),
            &motion,
            &decimation,
            &arm.robot,
            &arm.base,
            &arm.model,
        );
        assert_eq!(alone.ncols(), 1);
        for (a, b) in alone.iter().zip(full.column(index).iter()) {
            assert_eq!(a.to_bits(), b.to_bits(), "{name}");
        }
    }
}

/// The motion is known in closed form, and only its positions are given.
#[test]
fn analytic_torques_give_parameters_back_within_the_error_of_differences() {
    let mut random = Random(21);
    let arm = Arm::random(&mut random, 3);
    let options = options(100.0, 0.8, 40);
    // Central differences at 4 kHz are off by (ωT)²/3, 1.3e-6 at 1.25 Hz. The ends, where the
    // position filter has no neighbours, do not count.
    let motion = arm.motion(&mut random, 40_000, 4000.0, 1.25);
    let position = motion.position.column_iter().map(|q| q.iter().copied().collect()).collect();
    let experiment = Experiment::joint_side(signals(4000.0, position, arm.torques(&motion)))
        .unwrap()
        .with_counted(2000..38_000)
        .unwrap();
    let identified =
        identify(Method::IdimLs, &arm.robot, &arm.base, &experiment, &options).unwrap();
    let deviation = deviation(&arm, identified.estimate.parameters.iter().map(|p| p.value));
    assert!(deviation < 1e-4, "{deviation}");
}
