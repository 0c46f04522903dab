//! Torques that are not recorded of every joint, or that lack gravity or friction.

use didim_dynamics::dynamics::{BaseParameters, Model};
use didim_dynamics::robot::{JointIndex, ParameterKind, Robot, TorqueTerm};
use didim_identification::identification::{
    Estimate, Experiment, FindingCode, IdentificationError, Method, Motion, Options, Selection,
    Severity, Use, filtered_motion, identify, observation_matrix,
};
use didim_identification::regression::{Observations, RobustLoss};
use nalgebra::DVector;

use crate::common::arm::{Arm, Random, options, signals};

/// An arm, its positions, the filtered motion, and the torques of that motion.
fn recording(seed: u64, noise: f64) -> (Arm, Vec<Vec<f64>>, Motion, Vec<Vec<f64>>) {
    let mut random = Random(seed);
    let arm = Arm::random(&mut random, 4);
    let position = arm.positions(&mut random, 4000, 400.0, 3.0);
    let silent = signals(400.0, position.clone(), position.clone());
    let silent = Experiment::joint_side(&silent).unwrap();
    let motion = filtered_motion(&arm.robot, &silent, &exact_options().position_filter).unwrap();
    let mut torques = arm.torques(&motion);
    torques.iter_mut().flatten().for_each(|torque| *torque += noise * random.normal());
    (arm, position, motion, torques)
}

fn exact_options() -> Options {
    let mut options = options(20.0, 0.8, 10);
    options.limits.condition_number = 1e5;
    options.limits.position_filter_deviations = f64::MAX;
    options
}

fn identified(
    robot: &Robot,
    position: &[Vec<f64>],
    torques: Vec<Vec<f64>>,
    options: &Options,
) -> Estimate {
    let experiment = Experiment::joint_side(signals(400.0, position.to_vec(), torques)).unwrap();
    let base = BaseParameters::compute(&Model::new(robot)).unwrap();
    identify(Method::IdimLs, robot, &base, &experiment, options).unwrap().estimate
}

/// Checks all base parameters of an estimate against those of the true standard parameters.
fn assert_true(estimate: &Estimate, robot: &Robot, standard: &[f64], what: &str) {
    let truth = BaseParameters::compute(&Model::new(robot)).unwrap().to_base(standard);
    assert_eq!(estimate.parameters.len(), truth.len(), "{what}");
    for (found, truth) in estimate.parameters.iter().zip(truth) {
        let deviation = (found.value - truth).abs() / truth.abs().max(0.1);
        assert!(deviation < 1e-6, "{what}: {} is {}, not {truth}", found.name, found.value);
    }
    assert!(estimate.relative_error < 1e-9, "{what}: {}", estimate.relative_error);
}

/// The sensors of a wrist are dead, then one in the middle of the arm.
#[test]
fn the_torques_of_some_joints_give_what_they_show() {
    for (seed, joints) in [(1, vec![0, 1, 2]), (2, vec![0, 2, 3]), (3, vec![1])] {
        let (arm, position, _, mut torques) = recording(seed, 0.0);
        let used: Vec<JointIndex> = joints.iter().copied().map(JointIndex::new).collect();
        let robot = arm.robot.clone().with_torque_joints(&used);
        for joint in (0..4).filter(|joint| !joints.contains(joint)) {
            torques[joint].fill(0.0);
        }
        let estimate = identified(&robot, &position, torques, &exact_options());
        assert_true(&estimate, &robot, &arm.truth, &format!("joints {joints:?}"));
        assert_eq!(estimate.rows, joints.len() * 400);
        let json = serde_json::to_value(&estimate).unwrap();
        for joint in 0..4 {
            let is_used = joints.contains(&joint);
            for figures in [
                &json["relative_error_per_joint"],
                &json["rms_error_per_joint_nm"],
                &json["relative_prediction_deviation_per_joint"],
                &json["durbin_watson_per_joint"],
                &json["whiteness_per_joint"],
                &json["effective_rows_per_joint"],
                &json["held_out"]["relative_error_per_joint"],
                &json["held_out"]["quantiles_per_joint"],
                &json["elsewhere"]["error_per_joint_nm"],
                &json["elsewhere"]["relative_error_per_joint"],
            ] {
                let figure = &figures[joint];
                let figure = figure.get("99 %").unwrap_or(figure);
                assert_eq!(figure.is_number(), is_used, "joint {joint}: {figures}");
            }
        }
        let uses = &estimate.verdict.uses;
        assert_ne!(uses.rigid_body.applicable, Some(true));
        let reasons = &uses.rigid_body.reasons;
        assert!(reasons.iter().any(|of| of.code() == FindingCode::IncompleteTorque), "{reasons:?}");
        for usage in [Use::Monitoring, Use::Prediction] {
            let verdict = uses.get(usage);
            assert!(verdict.figure.is_some_and(f64::is_finite), "{usage:?}: {verdict:?}");
        }
        assert!(
            !estimate.verdict.reasons.iter().any(|reason| {
                let text = reason.to_string();
                (0..4)
                    .filter(|j| !joints.contains(j))
                    .any(|j| text.contains(&format!("joint {}", j + 1)))
            }),
            "{:?}",
            estimate.verdict.reasons
        );
        let findings = estimate.verdict.findings();
        let mut incomplete = findings.iter().filter(|of| of.code == FindingCode::IncompleteTorque);
        assert!(incomplete.any(|of| of.severity == Severity::Advisory), "{findings:?}");
    }
}

/// Rows that are left out are rows of a weight that goes to 0.
#[test]
fn the_result_is_that_without_weight_on_the_other_joints() {
    let (arm, position, motion, torques) = recording(5, 0.3);
    let robot = arm.robot.clone().with_torque_joints(&[0, 1, 3].map(JointIndex::new));
    let options = exact_options();
    let estimate = identified(&robot, &position, torques.clone(), &options);

    let base = BaseParameters::compute(&Model::new(&robot)).unwrap();
    let selection = Selection::new(&arm.robot, &base, None).unwrap();
    let decimation = options.decimation_filter.design().unwrap();
    let matrix = observation_matrix(&arm.model, &selection, &motion, &decimation, 0..4000).unwrap();
    let experiment = Experiment::joint_side(signals(400.0, position, torques)).unwrap();
    let torque = decimation.decimate_columns(experiment.torque_nm(), 0..4000).unwrap();
    let torque = DVector::from_column_slice(torque.as_slice());
    let rows = torque.len() / 4;
    let used: Vec<usize> = (0..4 * rows).filter(|row| row / rows != 2).collect();
    let alone = Observations::new(matrix.select_rows(&used), torque.select_rows(&used), 3).unwrap();
    let levels = alone.noise_levels(&alone.solve_ordinary().unwrap().residuals);
    let all = Observations::new(matrix, torque, 4).unwrap();
    let levels = [levels[0], levels[1], 1e9, levels[2]];
    let solution = all.solve_weighted(&levels).unwrap();
    for (k, found) in estimate.parameters.iter().enumerate() {
        let (value, deviation) = (solution.parameters[k], solution.covariance[(k, k)].sqrt());
        assert!((found.value - value).abs() < 1e-6 * deviation, "{}: {value}", found.name);
        let classical = found.classical_standard_deviation;
        assert!((classical / deviation - 1.0).abs() < 1e-6, "{}: {classical}", found.name);
    }
}

/// A dead sensor may report anything.
#[test]
fn a_torque_that_is_left_out_changes_nothing() {
    let (arm, position, _, torques) = recording(7, 0.3);
    let robot = arm.robot.clone().with_torque_joints(&[0, 1, 2].map(JointIndex::new));
    for robust in [None, Some(RobustLoss::default_huber())] {
        let options = Options { robust, ..exact_options() };
        let with = |last: Vec<f64>| {
            let mut torques = torques.clone();
            torques[3] = last;
            serde_json::to_string(&identified(&robot, &position, torques, &options)).unwrap()
        };
        let dead = with(vec![0.0; 4000]);
        assert!(with(torques[3].clone()) == dead);
        assert!(with((0..4000).map(|k| 1e5 * f64::from(k % 7)).collect()) == dead);
    }
}

#[test]
fn what_needs_every_torque_is_refused() {
    let (arm, position, _, torques) = recording(9, 0.3);
    let experiment = Experiment::joint_side(signals(400.0, position, torques)).unwrap();
    let robot = arm.robot.clone().with_torque_joints(&[0, 1].map(JointIndex::new));
    let base = BaseParameters::compute(&Model::new(&robot)).unwrap();
    for method in [Method::IdimIv, Method::Clie, Method::Cloe, Method::Didim] {
        let refused = identify(method, &robot, &base, &experiment, &exact_options()).unwrap_err();
        let joints = [2, 3].map(JointIndex::new).to_vec();
        assert_eq!(refused, IdentificationError::MissingTorques { method, joints });
        let said = refused.to_string();
        assert!(said.contains("joint 3, 4") && said.contains("choose idim-ls"), "{said}");
    }
}

/// The driver subtracts gravity or friction of the true arm.
#[test]
fn torques_without_a_term_give_the_parameters_that_they_show() {
    let (arm, position, motion, complete) = recording(11, 0.0);
    let mut without_gravity = arm.clone();
    without_gravity.model = arm.model.clone().with_gravity([0.0; 3]);
    let kinds = arm.robot.parameters().parameters().iter().zip(&arm.truth);
    let is_friction = |kind| {
        use ParameterKind::{Fc, FcMotor, Fv, FvMotor};
        matches!(kind, Fc | FcMotor | Fv | FvMotor)
    };
    let smooth: Vec<f64> =
        kinds.map(|(of, value)| if is_friction(of.kind) { 0.0 } else { *value }).collect();
    for (terms, torques) in [
        (vec![TorqueTerm::Gravity], without_gravity.torques(&motion)),
        (vec![TorqueTerm::Friction], arm.torques_of(&smooth, &motion)),
        (
            vec![TorqueTerm::Friction, TorqueTerm::Gravity],
            without_gravity.torques_of(&smooth, &motion),
        ),
    ] {
        let robot = arm.robot.clone().without_torque_terms(&terms);
        assert_eq!(robot.recorded_torque().excluded_terms().len(), terms.len());
        let names = robot.parameters().names().iter();
        let truth: Vec<f64> =
            names.map(|name| arm.truth[arm.robot.parameters().find(name).unwrap()]).collect();
        let estimate = identified(&robot, &position, torques.clone(), &exact_options());
        assert_true(&estimate, &robot, &truth, &format!("{terms:?}"));
        let notes: Vec<String> = estimate.verdict.notes.iter().map(ToString::to_string).collect();
        let said = notes.iter().find(|note| note.contains("do not contain")).unwrap();
        assert!(terms.iter().all(|term| said.contains(&term.to_string())), "{said}");
        let complete = robot.with_complete_torque().gravity_m_s2();
        assert!(
            complete.iter().zip(arm.robot.gravity_m_s2()).all(|(of, own)| (of - own).abs() < 1e-12)
        );
        // The complete model does not fit these torques.
        let wrong = identified(&arm.robot, &position, torques, &exact_options());
        let gravity = terms.contains(&TorqueTerm::Gravity);
        assert!(!gravity || wrong.relative_error > 1e-3, "{}", wrong.relative_error);
    }
    // Complete torques do not fit a model without gravity.
    let robot = arm.robot.clone().without_torque_terms(&[TorqueTerm::Gravity]);
    let wrong = identified(&robot, &position, complete, &exact_options());
    assert!(wrong.relative_error > 1e-3, "{}", wrong.relative_error);
}
