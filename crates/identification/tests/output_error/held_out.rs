//! What is held out has no say, whatever the method.

use didim_dynamics::Signals;
use didim_identification::identification::{Experiment, Identification, Method, Start, identify};

use super::loops::{METHODS, options};
use crate::common::arm::Random;
use crate::common::looped::{Looped, ZERO_ORDER_HOLD, pd, sampled};

/// A record with noise, whose torques are 2 N·m off from one sample to another.
fn record(looped: &Looped, off: core::ops::Range<usize>) -> Experiment {
    looped.record_with(ZERO_ORDER_HOLD, |signals: &mut Signals| {
        let mut random = Random(9);
        signals.torque_nm.iter_mut().flatten().for_each(|t| *t += 0.05 * random.normal());
        signals.position_rad.iter_mut().flatten().for_each(|q| *q += 1e-5 * random.normal());
        for torque in &mut signals.torque_nm {
            torque[off.clone()].iter_mut().for_each(|t| *t += 2.0);
        }
    })
}

fn all_methods(looped: &Looped, experiment: &Experiment) -> Vec<Identification> {
    let mut loop_options = looped.options();
    loop_options.simulation.start = Start::IdimLs;
    let mut output_error = options(looped);
    output_error.simulation.start = Start::IdimLs;
    let (robot, base) = (&looped.arm.robot, &looped.arm.base);
    let mut estimates: Vec<_> = METHODS
        .iter()
        .map(|(_, m)| identify(*m, robot, base, experiment, &output_error).unwrap())
        .collect();
    estimates.push(identify(Method::Didim, robot, base, experiment, &loop_options).unwrap());
    estimates.push(identify(Method::IdimIv, robot, base, experiment, &loop_options).unwrap());
    estimates.push(identify(Method::IdimLs, robot, base, experiment, &loop_options).unwrap());
    estimates
}

#[test]
fn what_is_held_out_does_not_matter() {
    let looped = Looped::random(60, 2, sampled(0.0), pd);
    // Thirty rows of torque that is wrong, and fifteen more to either side.
    let (wrong, held_out) = (4000..4300, 3850..4450);
    let clean = record(&looped, 0..0).with_held_out(held_out.clone()).unwrap();
    let spoilt = record(&looped, wrong.clone()).with_held_out(held_out.clone()).unwrap();
    let exposed = record(&looped, wrong);
    let results = all_methods(&looped, &clean).into_iter().zip(all_methods(&looped, &spoilt));
    for ((a, b), exposed) in results.zip(all_methods(&looped, &exposed)) {
        let name = &a.estimate.method;
        fn furthest(
            other: &Identification,
            a_estimate_parameters: &[didim_identification::identification::ParameterEstimate],
        ) -> f64 {
            let pairs = a_estimate_parameters.iter().zip(&other.estimate.parameters);
            let shifts = pairs.map(|(a, b)| (a.value - b.value).abs() / a.standard_deviation);
            shifts.fold(0.0, f64::max)
        }
        let (hidden, seen) =
            (furthest(&b, &a.estimate.parameters), furthest(&exposed, &a.estimate.parameters));
        println!("{name}: {hidden:.1e} held out, {seen:.1} not");
        // What the filter still shows of 2 N·m fifteen rows away, against 0.05 N·m of noise.
        // Positions do not see the torques at all; the start does.
        assert!(hidden < 0.1, "{name}: {hidden}");
        assert!(seen > 1.0 || name == "cloe", "{name}: {seen}");
        let rows = a.fit.time_s.len();
        assert_eq!(a.estimate.rows, 2 * rows);
        assert_eq!(a.fit.equation_residuals[1].len(), rows);
        assert!(a.fit.time_s.iter().all(|t| !(3.85..4.45).contains(t)));
        // Still what the noise leaves, with the spectrum of fewer rows.
        for (p, q) in a.estimate.parameters.iter().zip(&b.estimate.parameters) {
            let ratio = p.standard_deviation / q.standard_deviation;
            assert!((0.9..1.1).contains(&ratio), "{name} {}: {ratio}", p.name);
        }
    }
}
