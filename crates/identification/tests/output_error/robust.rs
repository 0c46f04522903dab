//! Outliers in the record of a loop.

use didim_dynamics::Signals;
use didim_identification::identification::{
    Estimate, Experiment, IdentificationError, Method, Start, identify,
};
use didim_identification::regression::RobustLoss;

use super::loops;
use crate::common::arm::Random;
use crate::common::looped::{Looped, ZERO_ORDER_HOLD, pd, sampled};

/// 0.05 N·m of noise on the torques, and a spike of 10 N·m every second.
fn spoilt(looped: &Looped) -> Experiment {
    looped.record_with(ZERO_ORDER_HOLD, |signals: &mut Signals| {
        let mut random = Random(7);
        signals.torque_nm.iter_mut().flatten().for_each(|t| *t += 0.05 * random.normal());
        for torque in &mut signals.torque_nm {
            torque.iter_mut().skip(500).step_by(1000).for_each(|t| *t += 10.0);
        }
    })
}

#[test]
fn didim_does_not_follow_spikes() {
    let looped = Looped::random(41, 2, sampled(0.0), pd);
    let experiment = spoilt(&looped);
    let truth = looped.arm.true_base();
    let identify = |robust| -> Estimate {
        let mut options = looped.options();
        (options.simulation.start, options.robust) = (Start::IdimLs, robust);
        identify(Method::Didim, &looped.arm.robot, &looped.arm.base, &experiment, &options)
            .unwrap()
            .estimate
    };
    let (plain, robust) = (identify(None), identify(Some(RobustLoss::default_bisquare())));
    let furthest = |estimate: &Estimate| {
        let pairs = estimate.parameters.iter().zip(&robust.parameters).zip(&truth);
        let deviations = pairs.map(|((p, r), t)| (p.value - t).abs() / r.standard_deviation);
        deviations.fold(0.0, f64::max)
    };
    let (off, robust_deviation) = (furthest(&plain), furthest(&robust));
    println!(
        "{off:.1} and {robust_deviation:.1} robust σ, {:?}",
        robust.downweighted_rows_per_joint
    );
    assert!(off > 5.0 && robust_deviation < 3.0, "{off} {robust_deviation}");
}

#[test]
fn what_has_no_robust_weights_says_so() {
    let looped = Looped::random(41, 2, sampled(0.0), pd);
    let mut options = loops::options(&looped);
    options.robust = Some(RobustLoss::default_huber());
    let (robot, base) = (&looped.arm.robot, &looped.arm.base);
    let error = identify(Method::Clie, robot, base, &spoilt(&looped), &options).unwrap_err();
    assert!(matches!(error, IdentificationError::NotRobust { .. }), "{error}");
}
