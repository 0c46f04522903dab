//! IDIM-IV on small arms.

use didim_dynamics::Signals;
use didim_identification::identification::{Experiment, Identification, Method, Start, identify};

use crate::common::arm::Random;
use crate::common::looped::{Looped, ZERO_ORDER_HOLD, pd, sampled};

/// Records of one motion.
const RECORDS: u64 = 10;

/// A log with noise: 0.02 N·m on the torques, and on the positions 2e-4 rad.
fn noisy(looped: &Looped, seed: u64) -> Experiment {
    looped.record_with(ZERO_ORDER_HOLD, |signals: &mut Signals| {
        let mut random = Random(seed);
        signals.torque_nm.iter_mut().flatten().for_each(|t| *t += 0.02 * random.normal());
        signals.position_rad.iter_mut().flatten().for_each(|q| *q += 2e-4 * random.normal());
    })
}

/// Noise of the positions bends the regressor of the measured motion, and least squares with it;
/// instruments of the simulated motion do not have it. A wide position filter lets it through.
#[test]
fn noise_of_the_positions_biases_least_squares_and_not_instruments() {
    let looped = Looped::random(50, 2, sampled(0.0), pd);
    let mut options = looped.options();
    options.simulation.start = Start::IdimLs;
    options.position_filter.cutoff_hz = 150.0;
    let (robot, base) = (&looped.arm.robot, &looped.arm.base);
    let truth = looped.arm.true_base();
    let mut means = [vec![0.0; truth.len()], vec![0.0; truth.len()]];
    for seed in 0..RECORDS {
        let experiment = noisy(&looped, seed);
        let squares = identify(Method::IdimLs, robot, base, &experiment, &options).unwrap();
        let instruments = identify(Method::IdimIv, robot, base, &experiment, &options).unwrap();
        for (mean, found) in means.iter_mut().zip([squares, instruments]) {
            let pairs = found.estimate.parameters.iter().zip(&truth);
            for (mean, (p, truth)) in mean.iter_mut().zip(pairs) {
                *mean += (p.value - truth) / p.standard_deviation / RECORDS as f64;
            }
        }
    }
    // Of an unbiased estimate these are standard normal.
    let rms = means.map(|means| {
        let squares: f64 = means.iter().map(|z| z * z * RECORDS as f64).sum();
        (squares / truth.len() as f64).sqrt()
    });
    println!("rms of the mean deviations: least squares {:.2}, instruments {:.2}", rms[0], rms[1]);
    // 12 parameters: 1 ± 0.2. The sign of friction remains bent by the noise of the speed.
    assert!(rms[0] > 3.0 && rms[1] < 0.5 * rms[0], "{rms:?}");
}

#[test]
fn every_start_leads_to_nearly_the_same_instruments() {
    let looped = Looped::random(51, 2, sampled(0.0), pd);
    let experiment = noisy(&looped, 0);
    let results = [Start::UnitDriveInertias, Start::IdimLs].map(|start| -> Identification {
        let mut options = looped.options();
        options.simulation.start = start;
        identify(Method::IdimIv, &looped.arm.robot, &looped.arm.base, &experiment, &options)
            .unwrap()
    });
    for (a, b) in results[0].estimate.parameters.iter().zip(&results[1].estimate.parameters) {
        // The iteration ends where a step changes nothing by more than 0.2 standard deviations, and
        // each leaves a small part of the change before.
        assert!((a.value - b.value).abs() < 0.05 * a.standard_deviation, "{a:?} {b:?}");
    }
    for estimate in results.map(|found| found.estimate) {
        let correlation = estimate.smallest_instrument_correlation.unwrap();
        println!("{} simulations, least correlation {correlation:.4}", estimate.simulations);
        assert!((0.9..=1.0).contains(&correlation), "{correlation}");
        assert_eq!(estimate.method, "idim-iv");
        assert!(!estimate.nuisance_parameters.is_empty());
    }
}
