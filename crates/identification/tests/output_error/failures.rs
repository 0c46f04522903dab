//! What ends an iteration is said by name.

use didim_dynamics::SignalTiming;
use didim_dynamics::control::SimulatedController;
use didim_identification::identification::{
    Failure, IdentificationError, IterationError, Method, Reason, SensitivityMethod, Start,
    identify,
};

use super::loops::{METHODS, options};
use crate::common::arm::Random;
use crate::common::looped::{Looped, PERIOD_S, RATE_HZ, ZERO_ORDER_HOLD, pd, sampled};

#[test]
fn too_few_simulations_are_no_result() {
    let looped = Looped::random(30, 2, sampled(0.0), pd);
    let experiment = looped.record(ZERO_ORDER_HOLD);
    for (name, method) in METHODS {
        let mut options = options(&looped);
        options.simulation.convergence.max_simulations = 2;
        let error = identify(method, &looped.arm.robot, &looped.arm.base, &experiment, &options)
            .unwrap_err();
        assert!(
            matches!(error, IdentificationError::Iteration(IterationError::NotConverged { .. })),
            "{name}: {error}"
        );
        assert_eq!(error.failure(), Some(Failure::NotConverged));
    }
}

#[test]
fn a_loop_that_diverges_at_the_start_is_named() {
    let looped = Looped::random(31, 2, sampled(0.0), pd);
    let experiment = looped.record(ZERO_ORDER_HOLD);
    for (name, method) in METHODS {
        let mut options = options(&looped);
        // Far beyond what a loop of 1 kHz can hold.
        options.controller = options.controller.map(|own| own.with_gain(2000.0));
        let error = identify(method, &looped.arm.robot, &looped.arm.base, &experiment, &options)
            .unwrap_err();
        assert!(
            matches!(error, IdentificationError::Iteration(IterationError::FirstSimulation { .. })),
            "{name}: {error}"
        );
        assert_eq!(error.failure(), Some(Failure::Diverged));
    }
}

/// The arm's controller is another one: no parameters explain the torques, and the verdict says so.
#[test]
fn a_minimum_above_the_noise_is_not_applicable() {
    let looped = Looped::random(32, 2, sampled(0.0), pd);
    let mut experiment = looped.record(ZERO_ORDER_HOLD);
    experiment = experiment.with_counted(2000..4000).unwrap();
    let mut options = options(&looped);
    options.simulation.start = Start::IdimLs;
    options.controller = Some(SimulatedController::Bandwidth {
        timing: sampled(0.0),
        bandwidth_hz: vec![4.0; 2],
        damping: 0.3,
        acceleration_feed_forward: false,
    });
    let outcome =
        identify(Method::Clie, &looped.arm.robot, &looped.arm.base, &experiment, &options);
    let is_refused = match &outcome {
        Ok(found) => {
            let reasons = &found.estimate.verdict.reasons;
            assert!(!found.estimate.verdict.applicable);
            assert_eq!(found.estimate.verdict.failure, Some(Failure::LocalMinimum));
            reasons.iter().any(|reason| matches!(reason, Reason::AboveNoise { .. }))
        }
        Err(error) => panic!("{error}"),
    };
    assert!(is_refused, "{:?}", outcome.map(|f| f.estimate.verdict));
}

/// A short motion under so much noise that no method knows the parameters better: the verdict
/// speaks of the motion, and the criterion has not failed.
#[test]
fn noise_that_leaves_every_method_uncertain_is_not_insensitivity() {
    let looped = Looped::random(32, 2, sampled(0.0), pd);
    let experiment = looped.record_with(ZERO_ORDER_HOLD, |signals| {
        let mut random = Random(5);
        signals.torque_nm.iter_mut().flatten().for_each(|t| *t += 10.0 * random.normal());
    });
    let experiment = experiment.with_counted(2000..3000).unwrap();
    let mut options = options(&looped);
    options.simulation.start = Start::IdimLs;
    let (robot, base) = (&looped.arm.robot, &looped.arm.base);
    let estimate = identify(Method::Clie, robot, base, &experiment, &options).unwrap().estimate;
    let equation_error =
        identify(Method::IdimLs, robot, base, &experiment, &options).unwrap().estimate;
    let mut well_known: Vec<f64> = (equation_error.parameters.iter().zip(&estimate.parameters))
        .filter(|(p, _)| p.relative_standard_deviation < 1.0 / 3.0)
        .map(|(p, found)| found.standard_deviation / p.value.abs())
        .collect();
    well_known.sort_by(f64::total_cmp);
    let median = well_known[well_known.len() / 2];
    println!("{median:.2} of {} parameters", well_known.len());
    assert!(median > 0.12, "there is too little noise: {median}");
    assert!(!estimate.verdict.applicable, "{:?}", estimate.verdict);
    assert_eq!(estimate.verdict.failure, None, "{:?}", estimate.verdict);
}

#[test]
fn options_are_validated_before_anything_is_recorded() {
    let looped = Looped::random(33, 2, sampled(0.0), pd);
    let robot = &looped.arm.robot;
    let good = options(&looped);
    good.validate_simulation(robot, RATE_HZ, ZERO_ORDER_HOLD).unwrap();
    let mut bad = good.clone();
    bad.simulation.convergence.max_simulations = 1;
    assert!(bad.validate_simulation(robot, RATE_HZ, ZERO_ORDER_HOLD).is_err());
    let mut bad = good.clone();
    bad.simulation.didim_steps = good.simulation.convergence.max_simulations;
    let error = bad.validate_simulation(robot, RATE_HZ, ZERO_ORDER_HOLD).unwrap_err();
    assert!(matches!(error, IdentificationError::DidimSteps { .. }), "{error}");
    let mut bad = good.clone();
    bad.simulation.start = Start::Nominal;
    let error = bad.validate_simulation(robot, RATE_HZ, ZERO_ORDER_HOLD).unwrap_err();
    assert!(matches!(error, IdentificationError::NoNominalParameters { .. }));
    assert_eq!(error.failure(), None);
    assert!(good.validate_simulation(robot, 1.3 * RATE_HZ, ZERO_ORDER_HOLD).is_err());
    let late = SignalTiming { hold_s: PERIOD_S, delay_s: 0.5 * PERIOD_S };
    assert!(good.validate_simulation(robot, RATE_HZ, late).is_err());
    let mut bad = good;
    bad.simulation.substeps = 0;
    bad.simulation.sensitivities = SensitivityMethod::Differences;
    assert!(bad.validate_simulation(robot, RATE_HZ, ZERO_ORDER_HOLD).is_err());
}
