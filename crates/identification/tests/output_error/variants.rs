//! The choices that the options offer.

use didim_dynamics::Signals;
use didim_identification::identification::{
    ConvergenceLimits, Estimate, Experiment, FindingCode, Method, Optimiser, Options,
    ReferenceSource, SensitivityMethod, Start,
};

use super::loops::{METHODS, options};
use crate::common::arm::Random;
use crate::common::looped::{Looped, ZERO_ORDER_HOLD, pd, sampled};

/// A loop whose log has noise: 0.05 N·m on the torques, 1e-5 rad on the positions.
fn noisy(looped: &Looped) -> Experiment {
    looped.record_with(ZERO_ORDER_HOLD, |signals: &mut Signals| {
        let mut random = Random(7);
        signals.torque_nm.iter_mut().flatten().for_each(|t| *t += 0.05 * random.normal());
        signals.position_rad.iter_mut().flatten().for_each(|q| *q += 1e-5 * random.normal());
    })
}

fn identify(
    looped: &Looped,
    method: Method,
    experiment: &Experiment,
    options: &Options,
) -> Estimate {
    let (robot, base) = (&looped.arm.robot, &looped.arm.base);
    didim_identification::identification::identify(method, robot, base, experiment, options)
        .unwrap()
        .estimate
}

/// Largest difference in standard deviations.
fn difference(a: &Estimate, b: &Estimate) -> f64 {
    let pairs = a.parameters.iter().zip(&b.parameters);
    pairs.fold(0.0, |largest: f64, (a, b)| {
        largest.max((a.value - b.value).abs() / a.standard_deviation)
    })
}

/// Every way to the minimum leads to the same one; the iteration ends within 0.2 standard
/// deviations of it, and a linear step from there leaves a tenth of that.
#[test]
fn optimisers_and_sensitivities_have_one_result() {
    let looped = Looped::random(40, 2, sampled(0.0), pd);
    let experiment = noisy(&looped);
    for (name, method) in METHODS {
        let mut options = options(&looped);
        options.simulation.start = Start::IdimLs;
        let reference = identify(&looped, method, &experiment, &options);
        assert_eq!(reference.reference, Some(ReferenceSource::Recorded));
        for optimiser in [Optimiser::LevenbergMarquardt, Optimiser::GaussNewton] {
            for sensitivities in [SensitivityMethod::Exact, SensitivityMethod::Differences] {
                options.simulation.optimiser = optimiser;
                options.simulation.sensitivities = sensitivities;
                let other = identify(&looped, method, &experiment, &options);
                let difference = difference(&reference, &other);
                println!(
                    "{name}, {optimiser:?}, {sensitivities:?}: {difference:.1e}, {} simulations",
                    other.simulations
                );
                assert!(difference < 0.02, "{name} {optimiser:?} {sensitivities:?}: {difference}");
                if sensitivities == SensitivityMethod::Differences {
                    let points = other.convergence.len();
                    let per_point = other.parameters.len() + 1;
                    assert!(other.simulations as usize >= points * per_point);
                }
            }
        }
    }
}

/// The truth lies where the standard deviations say, with and without the decimation filter.
#[test]
fn the_truth_is_within_the_standard_deviations() {
    let looped = Looped::random(41, 2, sampled(0.0), pd);
    let experiment = noisy(&looped);
    let truth = looped.arm.true_base();
    for (name, method) in METHODS {
        for decimated in [true, false] {
            let mut options = options(&looped);
            options.simulation.start = Start::IdimLs;
            options.simulation.decimated = decimated;
            let estimate = identify(&looped, method, &experiment, &options);
            let z = estimate.parameters.iter().zip(&truth);
            let z: Vec<f64> =
                z.map(|(p, truth)| (p.value - truth) / p.standard_deviation).collect();
            let rms = (z.iter().map(|z| z * z).sum::<f64>() / z.len() as f64).sqrt();
            let largest = z.iter().fold(0.0, |largest: f64, z| largest.max(z.abs()));
            println!("{name}, decimated {decimated}: rms {rms:.2}, largest {largest:.1}");
            // Of 16 parameters, the rms is 1 ± 0.18.
            assert!(rms < 1.6 && largest < 4.0, "{name} {decimated}: {rms} {largest}");
            // The model is the arm's, whatever equation was solved.
            let findings = estimate.verdict.findings();
            let of_values = [FindingCode::TorqueGain, FindingCode::TorqueDelay];
            let contradicted = findings.iter().find(|finding| of_values.contains(&finding.code));
            assert_eq!(contradicted, None, "{name}");
        }
    }
}

#[test]
fn files_need_state_only_what_is_physical() {
    let text = "position_filter = { cutoff_hz = 50.0 }\n\
                decimation_filter = { factor = 125 }\n\
                [controller]\n\
                kind = 'bandwidth'\n\
                timing = { kind = 'sampled', sample_period_s = 2e-4 }\n\
                bandwidth_hz = [50.0]\n\
                damping = 0.8\n\
                acceleration_feed_forward = true\n";
    let options: Options = toml::from_str(text).unwrap();
    assert_eq!(options.simulation.sensitivities, SensitivityMethod::Exact);
    assert_eq!(options.simulation.optimiser, Optimiser::LevenbergMarquardt);
    assert_eq!(options.simulation.convergence, ConvergenceLimits::default());
    assert!(options.simulation.decimated);
    let full =
        format!("{text}[simulation]\nsensitivities = 'differences'\noptimiser = 'gauss-newton'\n");
    let options: Options = toml::from_str(&full).unwrap();
    assert_eq!(options.simulation.sensitivities, SensitivityMethod::Differences);
    assert_eq!(options.simulation.optimiser, Optimiser::GaussNewton);
    for bad in [full.replace("'differences'", "'guess'"), full.replace("optimiser", "optimizer")] {
        assert!(toml::from_str::<Options>(&bad).is_err(), "{bad}");
    }
}
