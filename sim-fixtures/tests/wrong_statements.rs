//! Wrong configurations of the simulated TX40 are reported by name and size.

use didim_dynamics::control::{ControlTiming, ControllerConfig};
use didim_dynamics::dynamics::{BaseParameters, Model};
use didim_dynamics::robot::{JointIndex, MotorIndex, Robot};
use didim_dynamics::{SignalTiming, Signals};
use didim_identification::identification::{
    Change, Estimate, Experiment, Finding, FindingCode, Method, Note, NuisanceParameter, Options,
    Reason, Severity, Signal, Start, Subject, identify,
};
use didim_sim::{Scenario, tx40_paper};

use crate::common::experiment::{listed, loop_options, random_moves, regression};
use crate::expectation::Expectation;

/// Rest before and after the motion, in samples.
const REST: usize = 1250;

/// Identified by IDIM-LS from a record that was changed.
fn identified(scenario: &Scenario, change: impl FnOnce(&mut Signals)) -> Estimate {
    let mut signals = scenario.record_with_rests(REST, REST).unwrap().motor_signals();
    change(&mut signals);
    let options = regression(Some(listed(scenario)), 200.0);
    identified_as(scenario.robot(), scenario, &signals, (Method::IdimLs, &options))
}

/// Identified as a robot from the signals of a scenario, with its rests.
fn identified_as(
    robot: &Robot,
    scenario: &Scenario,
    signals: &Signals,
    (method, options): (Method, &Options),
) -> Estimate {
    let hold_s = scenario.controller().timing.sample_period_s();
    let experiment = Experiment::motor_side(signals, robot.transmission())
        .unwrap()
        .with_torque_timing(SignalTiming { hold_s, delay_s: 0.0 })
        .unwrap()
        .with_counted(REST..REST + scenario.samples())
        .unwrap();
    let base = BaseParameters::compute(&Model::new(robot)).unwrap();
    identify(method, robot, &base, &experiment, options).unwrap().estimate
}

/// Returns the findings with a code, and of each the joint that it is about, numbered from 1.
fn findings_of(estimate: &Estimate, code: FindingCode) -> Vec<(usize, Finding)> {
    let findings = estimate.verdict.findings().into_iter().filter(|finding| finding.code == code);
    let of_joint = findings.filter_map(|finding| match &finding.subject {
        Some(Subject::Joints(joints)) => Some((joints.first()?.number(), finding)),
        _ => None,
    });
    of_joint.collect()
}

/// Returns the joints with findings of this code, numbered from 1.
fn joints_of(estimate: &Estimate, code: FindingCode) -> Vec<usize> {
    findings_of(estimate, code).into_iter().map(|(joint, _)| joint).collect()
}

#[test]
fn the_zero_of_an_encoder_is_reported_with_its_size() {
    let scenario = tx40_paper().unwrap();
    for degrees in [3.0_f64, -5.0] {
        // Motor 2 turns 32 times as far as its joint.
        let estimate = identified(&scenario, |signals| {
            let offset = 32.0 * degrees.to_radians();
            signals.position_rad[1].iter_mut().for_each(|position| *position += offset);
        });
        let found = findings_of(&estimate, FindingCode::Geometry);
        let (joint, finding) = found.first().unwrap();
        assert_eq!((*joint, finding.unit.as_deref()), (2, Some("deg")), "{found:?}");
        // What has to be added to the positions as they are read.
        let value = finding.figure.unwrap();
        assert!((value / -degrees - 1.0).abs() < 0.2, "{value} for {degrees}");
        assert_eq!(estimate.verdict.uses.physical_values.applicable, Some(false));
    }
}

/// The factor is that by which a user has to multiply the configured gain: written down, the
/// finding goes.
#[test]
fn the_factor_of_a_torque_gain_mends_the_gain() {
    let scenario = tx40_paper().unwrap();
    for wrong in [1.2, 0.8] {
        let scaled = |gain: f64| {
            identified(&scenario, |signals| {
                signals.torque_nm[2].iter_mut().for_each(|torque| *torque *= gain);
            })
        };
        let find = |estimate: &Estimate| {
            let findings = estimate.verdict.findings();
            findings.into_iter().find(|finding| finding.code == FindingCode::TorqueGain)
        };
        let finding = find(&scaled(wrong)).unwrap();
        assert_eq!(finding.subject, Some(Subject::Joints(vec![JointIndex::new(2)])));
        assert_ne!(finding.severity, Severity::Blocking);
        let factor = finding.figure.unwrap();
        assert!((factor * wrong - 1.0).abs() < 0.03, "{factor} for {wrong}");
        assert_eq!(find(&scaled(wrong * factor)), None);
    }
}

#[test]
fn torques_in_another_unit_and_of_another_sign_are_one_sentence_each() {
    let scenario = tx40_paper().unwrap();
    let centimetres = identified(&scenario, |signals| {
        signals.torque_nm.iter_mut().flatten().for_each(|torque| *torque *= 100.0);
    });
    let of_joints = |reason: &Reason| matches!(reason, Reason::OtherUnit { .. });
    let reasons = &centimetres.verdict.reasons;
    assert!(!reasons.is_empty() && reasons.iter().all(of_joints), "{reasons:?}");
    let finding: FindingCode = Expectation::of("torques-in-another-unit").get("finding");
    assert!(centimetres.verdict.findings().iter().any(|of| of.code == finding));
    let sign_flipped = identified(&scenario, |signals| {
        signals.torque_nm.iter_mut().flatten().for_each(|torque| *torque = -*torque);
    });
    let reasons = &sign_flipped.verdict.reasons;
    assert!(matches!(reasons[..], [Reason::WrongSigns { .. }]), "{reasons:?}");
}

#[test]
fn one_torque_of_the_other_sign_is_reported_by_its_friction() {
    let scenario = tx40_paper().unwrap();
    let estimate = identified(&scenario, |signals| {
        signals.torque_nm[0].iter_mut().for_each(|torque| *torque = -*torque);
    });
    // What follows from it, single coefficients below 0, is left out.
    let reasons = &estimate.verdict.uses.prediction.reasons;
    let joint = JointIndex::new(0);
    let signal = Some(Signal::Torque);
    let expected = Reason::WrongSignsOfJoint { joint, negative: 2, signal, setting: None };
    assert_eq!(reasons[..], [expected]);
}

/// What is checked against a torque limit is not where the robot file leaves it open, and that is
/// said.
#[test]
fn without_torque_limits_the_largest_torque_takes_their_place_and_that_is_said() {
    let limit = "torque_max_nm = 131.84";
    let without_limit = with_row(limit, "torque_max_nm = \"unknown\"", Method::IdimLs);
    let joints = [0, 1].map(JointIndex::new).to_vec();
    let said = |note: &Note| *note == Note::TorqueLimitOpen { joints: joints.clone() };
    assert!(without_limit.verdict.notes.iter().any(said), "{:?}", without_limit.verdict.notes);
    let with_limit = with_row(limit, limit, Method::IdimLs);
    let of_limits = |note: &Note| matches!(note, Note::TorqueLimitOpen { .. });
    assert!(!with_limit.verdict.notes.iter().any(of_limits));
    let low = with_row(limit, "torque_max_nm = 1.0", Method::IdimLs);
    let other_unit = |reason: &Reason| matches!(reason, Reason::OtherUnit { .. });
    assert!(low.verdict.reasons.iter().any(other_unit), "{:?}", low.verdict.reasons);
    assert!(!without_limit.verdict.reasons.iter().any(other_unit));
    assert_eq!(without_limit.parameters, with_limit.parameters);
}

/// What another robot file makes of the paper's arm: one line of it is another.
fn with_row(row: &str, wrong: &str, method: Method) -> Estimate {
    let scenario = tx40_paper().unwrap();
    let file = include_str!("../../config/robots/tx40.toml");
    assert!(file.contains(row), "{row}");
    let mut file = file.replace(row, wrong);
    if wrong == UNCOUPLED {
        // Such an arm has no friction of a coupled motor.
        file = file.replace("fv_m6", "# fv_m6").replace("fc_m6", "# fc_m6");
    }
    let robot = Robot::from_toml(&file).unwrap();
    let names =
        robot.nominal().unwrap().given_values().iter().map(|(name, _)| name.clone()).collect();
    let options = match method {
        Method::IdimLs => regression(Some(names), 200.0),
        _ => Options {
            parameters: Some(names),
            ..loop_options(&scenario, 50.0, Start::UnitDriveInertias)
        },
    };
    let signals = scenario.record_with_rests(REST, REST).unwrap().motor_signals();
    identified_as(&robot, &scenario, &signals, (method, &options))
}

/// The rows of motors 3 and 6: 45 turns for one of joint 3, and 32 for one of joints 5 and 6.
const COUPLED: &str = "[0.0, 0.0, 0.0, 0.0, 32.0, 32.0]";
const UNCOUPLED: &str = "[0.0, 0.0, 0.0, 0.0, 0.0, 32.0]";
const TORQUE_RANGE: &str = "[0.0, 0.0, 0.0, 0.0, -32.0, 32.0]";
const GEAR: &str = "[0.0, 0.0, 45.0, 0.0, 0.0, 0.0]";
const OTHER_GEAR: &str = "[0.0, 0.0, 50.0, 0.0, 0.0, 0.0]";

/// A coupling that is left out leaves a model of other parameters that predicts to a per cent: a
/// note says what it looks like, and its values are not called physical.
#[test]
fn a_coupling_that_is_left_out_is_named() {
    let estimate = with_row(COUPLED, UNCOUPLED, Method::IdimLs);
    let named = estimate.verdict.notes.iter().find_map(|note| match note {
        Note::ModelError { nuisance, .. } => Some(nuisance.nuisance),
        _ => None,
    });
    assert_eq!(
        named,
        Some(NuisanceParameter::Coupling {
            joint: JointIndex::new(4),
            neighbour: JointIndex::new(5)
        })
    );
    assert!(estimate.extrapolation.relative_error < 0.05, "{:?}", estimate.extrapolation);
    assert_eq!(estimate.verdict.uses.physical_values.applicable, Some(false));
    // Moving alone, joint 6 has its own friction and that of its motor.
    let fc6 = estimate.parameters.iter().find(|p| p.name == "fc6").unwrap();
    let [joint, motor] = ["fc6", "fc_m6"].map(|name| tx40_paper().unwrap().truth_of(name).unwrap());
    let off = (fc6.value - joint - motor).abs() / fc6.combined_standard_deviation;
    assert!(off < 2.0, "{fc6:?} for {joint} and {motor}");

    // Nothing is said where nothing lacks.
    let right = with_row(COUPLED, COUPLED, Method::IdimLs);
    let said = |note: &Note| matches!(note, Note::ModelError { .. });
    assert!(!right.verdict.notes.iter().any(said), "{:?}", right.verdict.notes);
}

/// The gains of both joints would stand for it, and are left out. The values of the coupled motor
/// are called usable all the same: their uncertainty is too small by a factor of 8.
#[test]
fn a_coupling_of_the_other_sign_is_named() {
    let estimate = with_row(COUPLED, TORQUE_RANGE, Method::IdimLs);
    let named = estimate.verdict.findings().into_iter();
    let named: Vec<Finding> = named.filter(|of| of.code == FindingCode::Coupling).collect();
    let [coupling] = &named[..] else { panic!("{:#?}", estimate.verdict) };
    let expected = Expectation::of("coupling-of-the-other-sign");
    let motor = MotorIndex::new(expected.get("motor"));
    assert_eq!(coupling.subject, Some(Subject::Motors(vec![motor])));
    assert_eq!(coupling.figure, Some(expected.get("value")));
    assert_eq!(joints_of(&estimate, FindingCode::TorqueGain), [0; 0]);
    // The required uses do not need the explanation, and the reader has to see it all the same.
    let explains = |note: &Note| matches!(note, Note::Explanation(_));
    assert!(estimate.verdict.applicable && estimate.verdict.notes.iter().any(explains));
}

/// A loop of wrong joints makes other commands than were recorded, at these joints and no others.
#[test]
fn a_wrong_transmission_is_reported_by_the_commands_of_the_described_controller() {
    for (row, wrong, joints) in [
        (COUPLED, UNCOUPLED, &[5, 6][..]),
        (COUPLED, TORQUE_RANGE, &[5, 6]),
        (GEAR, OTHER_GEAR, &[3]),
    ] {
        let estimate = with_row(row, wrong, Method::Didim);
        assert_eq!(joints_of(&estimate, FindingCode::Controller), joints, "{wrong}");
        assert!(!estimate.verdict.applicable, "{wrong}");
    }
}

/// Torques that are all 5 % high are those of a heavier arm, under whatever controller: the
/// described one says that they are not.
#[test]
fn torque_gains_that_are_all_wrong_are_reported_by_the_described_controller() {
    let sampled = tx40_paper().unwrap();
    let sample_period_s = sampled.controller().timing.sample_period_s();
    let continuous = ControllerConfig {
        timing: ControlTiming::Continuous { sample_period_s },
        ..sampled.controller().clone()
    };
    let continuous = tx40_paper().unwrap().with_controller(continuous).unwrap();
    let timing_held = SignalTiming { hold_s: sample_period_s, delay_s: 0.0 };
    for (scenario, timing) in [(sampled, timing_held), (continuous, SignalTiming::INSTANTANEOUS)] {
        let base = BaseParameters::compute(&Model::new(scenario.robot())).unwrap();
        let options = loop_options(&scenario, 200.0, Start::IdimLs);
        let record = scenario.record_with_rests(REST, REST).unwrap();
        let accused: Vec<usize> =
            Expectation::of("common-gain-with-controller").get("accused_joints");
        for (gain, joints) in [(1.0, &[][..]), (1.05, &accused)] {
            let mut signals = record.motor_signals();
            signals.torque_nm.iter_mut().flatten().for_each(|torque| *torque *= gain);
            let experiment = Experiment::motor_side(&signals, scenario.robot().transmission())
                .unwrap()
                .with_torque_timing(timing)
                .unwrap()
                .with_counted(REST..REST + scenario.samples())
                .unwrap();
            for method in [Method::IdimLs, Method::Didim] {
                let identified = identify(method, scenario.robot(), &base, &experiment, &options);
                let estimate = identified.unwrap().estimate;
                let found = joints_of(&estimate, FindingCode::Controller);
                assert_eq!(found, joints, "{method} {gain} {timing:?}");
                // Without a simulated loop the figures do not depend on the controller.
                let applicable = joints.is_empty() || !method.simulates();
                let verdict = estimate.verdict;
                assert_eq!(verdict.applicable, applicable, "{method}: {:?}", verdict.reasons);
            }
        }
    }
}

const ON_THE_FLOOR: &str = "gravity_m_s2 = [0.0, 0.0, -9.81]";

#[test]
fn gravity_from_another_side_is_reported_with_its_direction() {
    for other in ["[0.0, 0.0, 9.81]", "[9.81, 0.0, 0.0]", "[0.0, -9.81, 0.0]"] {
        let estimate = with_row(ON_THE_FLOOR, &format!("gravity_m_s2 = {other}"), Method::IdimLs);
        let mut findings = estimate.verdict.findings().into_iter();
        let found = findings.find(|of| of.code == FindingCode::GravityDirection);
        let message = found.map(|finding| finding.message).unwrap_or_default();
        assert!(message.contains("[0.00, 0.00, -9.81]"), "{other}: {:?}", estimate.verdict);
    }
}

/// The robot file says that the base is level.
#[test]
fn a_base_that_leans_is_reported_with_its_direction() {
    let file = include_str!("../../config/robots/tx40.toml");
    assert!(file.contains(ON_THE_FLOOR));
    let level = Robot::from_toml(file).unwrap();
    for (angle_deg, axis) in [(15.0_f64, 0), (25.0, 1), (50.0, 0)] {
        let (sin, cos) = angle_deg.to_radians().sin_cos();
        let mut own = [0.0, 0.0, -9.81 * cos];
        own[axis] = 9.81 * sin;
        let row = format!("gravity_m_s2 = {own:?}");
        let leaning = Robot::from_toml(&file.replace(ON_THE_FLOOR, &row)).unwrap();
        let text = include_str!("../scenarios/tx40-paper.toml");
        let scenario = Scenario::from_toml(text, leaning).unwrap();
        let signals = scenario.record_with_rests(REST, REST).unwrap().motor_signals();
        let options = regression(Some(listed(&scenario)), 200.0);
        let estimate = identified_as(&level, &scenario, &signals, (Method::IdimLs, &options));
        let first = &estimate.verdict.findings()[0];
        assert_eq!(first.code, FindingCode::GravityDirection, "{:?}", estimate.verdict);
        let explanation = &estimate.verdict.uses.physical_values.explanations[0];
        let Some(Change::Gravity { gravity_m_s2, standard_deviation_m_s2 }) = explanation.change()
        else {
            panic!("{explanation:?}")
        };
        assert!(standard_deviation_m_s2 > 0.0 && standard_deviation_m_s2 < 0.2);
        for (found, own) in gravity_m_s2.iter().zip(own) {
            assert!((found - own).abs() < 3.0 * standard_deviation_m_s2, "{found} for {own}");
        }
    }
}

#[test]
fn absolute_values_of_torque_are_reported_alone() {
    let scenario = tx40_paper().unwrap();
    let estimate = identified(&scenario, |signals| {
        signals.torque_nm.iter_mut().flatten().for_each(|torque| *torque = torque.abs());
    });
    let findings = estimate.verdict.findings();
    assert_eq!(findings[0].code, FindingCode::UnsignedTorque, "{findings:?}");
    let causes = findings.iter().filter(|of| of.severity == Severity::Explanatory);
    assert_eq!(causes.map(|of| of.code).collect::<Vec<_>>(), []);
    assert!(!findings.iter().any(|of| of.code == FindingCode::WrongSignsOfJoint), "{findings:?}");
    assert!(!estimate.verdict.applicable);
    // One torque with a sign shows that the logger keeps signs.
    let estimate = identified(&scenario, |signals| {
        signals.torque_nm[3].iter_mut().for_each(|torque| *torque = torque.abs());
    });
    let findings = estimate.verdict.findings();
    assert!(!findings.iter().any(|of| of.code == FindingCode::UnsignedTorque), "{findings:?}");
}

/// A lag of 10 ms is a quarter of the time between the rows of many cells.
#[test]
fn torques_that_are_all_late_are_reported_with_their_delay() {
    let scenario = tx40_paper().unwrap();
    let period_s = scenario.controller().timing.sample_period_s();
    let late = (0..REST).find(|samples| *samples as f64 * period_s > 0.0099).unwrap();
    let estimate = identified(&scenario, |signals| {
        for torque in &mut signals.torque_nm {
            torque.rotate_right(late);
        }
    });
    let found =
        estimate.verdict.findings().into_iter().find(|of| of.code == FindingCode::LateSignal);
    let figure_s = found.and_then(|finding| finding.figure).unwrap_or_default();
    assert!((figure_s / 0.01 - 1.0).abs() < 0.1, "{figure_s} s: {:?}", estimate.verdict);
}

/// The condition number alone would say nothing of it where the motor of joint 6 turns with joint
/// 5.
#[test]
fn a_joint_that_does_not_move_is_no_joint_to_predict() {
    for fixed in [3, 5] {
        let scenario = tx40_paper().unwrap();
        let mut moves = random_moves(&scenario, 9, 14);
        let start = moves.start_rad[fixed];
        moves.moves.iter_mut().for_each(|of| of.target_rad[fixed] = start);
        let estimate = identified(&scenario.with_moves(&moves).unwrap(), |_| ());
        let prediction = &estimate.verdict.uses.prediction;
        let joints: Vec<usize> = (prediction.reasons.iter())
            .filter_map(|reason| match reason {
                Reason::Unmoved { joint, .. } => Some(joint.position()),
                _ => None,
            })
            .collect();
        assert_eq!(joints, [fixed], "{:?}", prediction.reasons);
        assert_eq!(prediction.applicable, Some(false));
    }
}

/// What follows from it, wrong zeros and couplings, comes behind.
#[test]
fn positions_that_are_not_logged_as_they_come_are_reported_with_their_time() {
    let scenario = tx40_paper().unwrap();
    let frozen = REST + 10_000..REST + 10_400;
    let estimate = identified(&scenario, |signals| {
        for position in &mut signals.position_rad[..2] {
            let last = position[frozen.start - 1];
            position[frozen.clone()].fill(last);
        }
    });
    let explained = &estimate.verdict.uses.prediction.explanations;
    let in_notes = estimate.verdict.notes.iter().filter_map(|note| match note {
        Note::Explanation(reason) => Some(reason),
        _ => None,
    });
    let reasons: Vec<&Reason> = explained.iter().chain(in_notes).collect();
    let Some(Reason::FrozenSignal { found }) = reasons.first() else { panic!("{reasons:?}") };
    assert_eq!((&found.motors[..], found.recording), (&[0, 1].map(MotorIndex::new)[..], 1));
    let time_of = |sample: usize| sample as f64 / 5000.0;
    assert!((found.from_s - time_of(frozen.start - 1)).abs() < 1e-9, "{found:?}");
    assert!((found.until_s - time_of(frozen.end)).abs() < 1e-9, "{found:?}");
}
