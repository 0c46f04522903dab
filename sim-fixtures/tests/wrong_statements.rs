//! What is stated wrongly, on the simulated TX40: told by its name and size.

use didim_core::dynamics::{BaseParameters, Model};
use didim_core::identification::{
    Estimate, Experiment, Freedom, Method, Reason, SignalTiming, Signals, identify,
};
use didim_sim::{Scenario, tx40_paper};

use crate::common::experiment::{listed, regression};

/// Rest before and after the motion, in samples.
const REST: usize = 1250;

/// Identified by IDIM-LS from a record that was changed.
fn identified(scenario: &Scenario, change: impl FnOnce(&mut Signals)) -> Estimate {
    let mut signals = Signals::of_motors(&scenario.record_with_rests(REST, REST).unwrap());
    change(&mut signals);
    let hold_s = scenario.controller().timing.sample_period_s();
    let experiment = Experiment::motor_side(&signals, scenario.robot().transmission())
        .unwrap()
        .with_torque_timing(SignalTiming { hold_s, delay_s: 0.0 })
        .unwrap()
        .with_counted(REST..REST + scenario.samples())
        .unwrap();
    let base = BaseParameters::compute(&Model::new(scenario.robot())).unwrap();
    let options = regression(Some(listed(scenario)), 200.0);
    identify(Method::IdimLs, scenario.robot(), &base, &experiment, &options).unwrap().estimate
}

fn contradicted(reasons: &[Reason]) -> Vec<(Freedom, f64)> {
    let found = reasons.iter().filter_map(|reason| match reason {
        Reason::Contradicted { freedom } => Some((freedom.freedom, freedom.quantity?.value)),
        _ => None,
    });
    found.collect()
}

#[test]
fn the_zero_of_an_encoder_is_told_with_its_size() {
    let scenario = tx40_paper().unwrap();
    for degrees in [3.0_f64, -5.0] {
        // Motor 2 turns 32 times as far as its joint.
        let estimate = identified(&scenario, |signals| {
            let offset = 32.0 * degrees.to_radians();
            signals.position_rad[1].iter_mut().for_each(|position| *position += offset);
        });
        let reasons = &estimate.verdict.uses.prediction.reasons;
        let found = contradicted(reasons);
        let (freedom, value) = found.first().copied().unwrap();
        assert_eq!(freedom, Freedom::Zero(2), "{reasons:?}");
        assert!((value.abs() / degrees.abs() - 1.0).abs() < 0.2, "{value} for {degrees}");
        assert!(!estimate.verdict.applicable);
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
    let turned = identified(&scenario, |signals| {
        signals.torque_nm.iter_mut().flatten().for_each(|torque| *torque = -*torque);
    });
    let reasons = &turned.verdict.reasons;
    assert!(matches!(reasons[..], [Reason::WrongSigns { .. }]), "{reasons:?}");
}

#[test]
fn one_torque_of_the_other_sign_is_told_by_its_friction() {
    let scenario = tx40_paper().unwrap();
    let estimate = identified(&scenario, |signals| {
        signals.torque_nm[0].iter_mut().for_each(|torque| *torque = -*torque);
    });
    let reasons = &estimate.verdict.uses.prediction.reasons;
    let told = |reason: &Reason| matches!(reason, Reason::Negative { name, .. } if name == "fv1");
    assert!(reasons.iter().any(told), "{reasons:?}");
}
