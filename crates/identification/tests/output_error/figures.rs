//! How far the simulated loop is from the measurements, and what is left of each equation.

use didim_dynamics::Signals;
use didim_identification::identification::{Experiment, Identification, Method, Start, identify};
use didim_identification::regression::autocorrelation;

use super::loops::{METHODS, options};
use crate::common::arm::Random;
use crate::common::looped::{Looped, ZERO_ORDER_HOLD, pd, pd_of, sampled};

const TORQUE_NOISE_NM: f64 = 0.05;
const POSITION_NOISE_RAD: f64 = 1e-5;

fn noisy(looped: &Looped) -> Experiment {
    looped.record_with(ZERO_ORDER_HOLD, |signals: &mut Signals| {
        let mut random = Random(9);
        signals
            .torque_nm
            .iter_mut()
            .flatten()
            .for_each(|t| *t += TORQUE_NOISE_NM * random.normal());
        signals
            .position_rad
            .iter_mut()
            .flatten()
            .for_each(|q| *q += POSITION_NOISE_RAD * random.normal());
    })
}

fn all_methods(looped: &Looped, experiment: &Experiment, decimated: bool) -> Vec<Identification> {
    let mut loop_options = looped.options();
    (loop_options.simulation.start, loop_options.simulation.decimated) = (Start::IdimLs, decimated);
    let mut output_error = options(looped);
    (output_error.simulation.start, output_error.simulation.decimated) = (Start::IdimLs, decimated);
    let (robot, base) = (&looped.arm.robot, &looped.arm.base);
    let mut estimates: Vec<_> = METHODS
        .iter()
        .map(|(_, method)| identify(*method, robot, base, experiment, &output_error).unwrap())
        .collect();
    estimates.push(identify(Method::Didim, robot, base, experiment, &loop_options).unwrap());
    estimates.push(identify(Method::IdimIv, robot, base, experiment, &loop_options).unwrap());
    estimates
}

/// With the right model, what is between a simulated loop and the measurements is their noise: of
/// every sample its whole level, of the decimated rows the tenth of its power that passes the
/// filter, 0.08 behind its edges.
#[test]
fn a_right_loop_is_off_by_the_noise() {
    let looped = Looped::random(60, 2, sampled(0.0), |inertia| pd_of(15.0, inertia));
    let experiment = noisy(&looped);
    let counted = experiment.counted();
    for (decimated, passed) in [(false, 1.0), (true, 0.08_f64.sqrt())] {
        for found in all_methods(&looped, &experiment, decimated) {
            let estimate = &found.estimate;
            for (errors, signals, noise) in [
                (
                    &estimate.relative_position_error_per_joint,
                    experiment.position_rad(),
                    POSITION_NOISE_RAD,
                ),
                (
                    &estimate.simulated_torque_error_per_joint,
                    experiment.torque_nm(),
                    TORQUE_NOISE_NM,
                ),
            ] {
                let errors = errors.as_ref().unwrap();
                assert_eq!(errors.len(), 2);
                for (joint, error) in errors.iter().enumerate() {
                    let column = signals.column(joint);
                    let rms =
                        column.rows_range(counted.clone()).norm() / (counted.len() as f64).sqrt();
                    let ratio = error / (passed * noise / rms);
                    println!("{} {decimated} {joint}: {ratio:.3}", estimate.method);
                    // 490 rows tell their own level to 3 %. IDIM-IV has the noise of the measured
                    // accelerations in its equation, and parameters that are no better than this.
                    let most = if estimate.method == "idim-iv" { 2.0 } else { 1.1 };
                    assert!((0.9..most).contains(&ratio), "{} {joint}: {ratio}", estimate.method);
                }
            }
        }
    }
}

/// The Durbin–Watson statistic is that of the residuals which the fit returns. The noise passes the
/// same filter.
#[test]
fn the_fit_has_the_residuals_of_the_equation_that_was_solved() {
    let looped = Looped::random(60, 2, sampled(0.0), pd);
    let experiment = noisy(&looped);
    for decimated in [false, true] {
        for Identification { estimate, fit } in all_methods(&looped, &experiment, decimated) {
            for (joint, residuals) in fit.equation_residuals.iter().enumerate() {
                let steps: f64 = residuals.windows(2).map(|w| (w[1] - w[0]).powi(2)).sum();
                let statistic = steps / residuals.iter().map(|r| r * r).sum::<f64>();
                let expected = estimate.durbin_watson_per_joint[joint];
                assert!((statistic - expected).abs() < 1e-12, "{} {joint}", estimate.method);
                let first = autocorrelation(residuals, 1)[0];
                let noise = fit.white_noise[0];
                // The noise of the accelerations is in the equation of IDIM-IV, and is not white.
                let white = (first - noise.mean).abs() < 4.0 * noise.deviation;
                assert!(white || estimate.method == "idim-iv", "{} {joint}", estimate.method);
                // Only CLOE solves an equation of the positions.
                let torque = fit.measured[joint].iter().zip(&fit.predicted[joint]);
                let same =
                    residuals.iter().zip(torque).all(|(r, (m, p))| (r - (m - p)).abs() < 1e-9);
                assert_eq!(same, estimate.method != "cloe", "{}", estimate.method);
            }
            let rows = fit.time_s.len() as f64;
            let noise = fit.white_noise[0];
            if !decimated {
                assert!(
                    noise.mean.abs() < 1e-15 && (noise.deviation - rows.powf(-0.5)).abs() < 1e-12
                );
            }
            let (weighted, plain) = (estimate.singular_values, estimate.unweighted_singular_values);
            for (values, number) in [
                (weighted, estimate.condition_number),
                (plain, estimate.unweighted_condition_number),
            ] {
                assert!((values.max / values.min / number - 1.0).abs() < 1e-12);
            }
        }
    }
}
