//! Without noise the truth is a fixed point of the iteration: the simulated motion is then the real
//! one, and the torque that acts just after every sample is the logged one.

use didim_dynamics::SignalTiming;
use didim_dynamics::control::{ControlLaw, ControlTiming};
use didim_identification::identification::{
    ConvergenceLimits, KeptParameters, Method, Options, Start, identify,
};

use crate::common::looped::{Looped, PERIOD_S, ZERO_ORDER_HOLD, pd, sampled};

/// Rounding of the regression: machine precision times a condition number of 1e3 to 1e4, for
/// parameters a thousand times smaller than the largest. Changes of 1e-9 standard deviations (those
/// of IDIM-LS, 1e-2 of the parameters or less), of which the next step leaves a tenth, are below
/// it, and so is what two seconds leave of an error in the initial velocity.
const TOLERANCE: f64 = 1e-9;

fn check(name: &str, looped: &Looped, torque_timing: SignalTiming) {
    check_with(name, looped, torque_timing, |_| {});
}

fn check_with(
    name: &str,
    looped: &Looped,
    torque_timing: SignalTiming,
    change: impl Fn(&mut Options),
) {
    let experiment = looped.record(torque_timing);
    for mut options in [looped.options(), looped.rescaled_options(&experiment)] {
        change(&mut options);
        options.simulation.convergence = ConvergenceLimits {
            relative_error_change: 0.01,
            parameter_change: 1e-9,
            max_simulations: 30,
        };
        let output = looped.identify(&experiment, &options).unwrap();
        let deviation = looped.deviation(&output);
        assert!(deviation < TOLERANCE, "{name}: {deviation}");
        assert!(output.estimate.relative_error < TOLERANCE);
    }
}

#[test]
fn a_sampled_pd_gives_the_truth_back_whatever_its_delay() {
    for (seed, periods) in [(0, 0.0), (1, 0.4), (2, 1.0), (3, 1.7)] {
        let delay_s = periods * PERIOD_S;
        let looped = Looped::random(seed, 3, sampled(delay_s), pd);
        let timing = SignalTiming { hold_s: PERIOD_S, delay_s };
        check(&format!("delay of {periods} periods"), &looped, timing);
    }
}

#[test]
fn a_continuous_pd_gives_the_truth_back() {
    let timing = ControlTiming::Continuous { sample_period_s: PERIOD_S };
    let looped = Looped::random(4, 3, timing, pd);
    check("continuous", &looped, SignalTiming::INSTANTANEOUS);
}

#[test]
fn cascaded_loops_give_the_truth_back() {
    let law = |inertia: f64| ControlLaw::CascadedPPi {
        kv_per_s: 20.0,
        kp_s_per_rad: 100.0,
        ki_per_rad: 2000.0,
        k_tau_nm: inertia,
    };
    let looped = Looped::random(5, 3, sampled(0.0), law);
    check("cascade", &looped, ZERO_ORDER_HOLD);
}

#[test]
fn every_friction_law_is_simulated_as_it_is_fitted() {
    check("friction laws", &Looped::with_friction_laws(6, 3), ZERO_ORDER_HOLD);
}

/// The simulated arm's friction grows with its own load, and the loads of the estimate become those
/// of the arm.
#[test]
fn friction_that_grows_with_the_load_gives_the_truth_back() {
    check("load", &Looped::with_load_friction(8, 3), ZERO_ORDER_HOLD);
}

/// Friction that lags stands where the simulated joints have turned.
#[test]
fn friction_that_slides_at_reversals_gives_the_truth_back() {
    check("hysteresis", &Looped::with_hysteresis(9, 3, sampled(0.0)), ZERO_ORDER_HOLD);
}

/// Springs and cylinders that the file states, and every third parameter not identified but kept at
/// its true value.
#[test]
fn what_is_known_of_the_torques_leaves_the_truth_to_the_rest() {
    let looped = Looped::with_known_torques(7, 3, pd);
    check("known torques", &looped, ZERO_ORDER_HOLD);
    let names = looped.arm.base.names();
    let identified = names.iter().enumerate().filter(|(k, _)| k % 3 != 1);
    let identified: Vec<String> = identified.map(|(_, name)| name.clone()).collect();
    let keep = |options: &mut Options| {
        options.parameters = Some(identified.clone());
        options.keep_nominal = Some(KeptParameters::All);
        // Nothing is known of an arm of unit inertias.
        options.simulation.start = Start::IdimLs;
    };
    check_with("kept parameters", &looped, ZERO_ORDER_HOLD, keep);
    // By least squares alone, whose position filter smooths; without what was kept it is another
    // arm.
    let (experiment, mut options) = (looped.record(ZERO_ORDER_HOLD), looped.options());
    keep(&mut options);
    fn least_squares(
        options: &Options,
        experiment: &didim_identification::identification::Experiment,
        looped_arm_robot: &didim_dynamics::robot::Robot,
        looped_arm_base: &didim_dynamics::dynamics::BaseParameters,
    ) -> didim_identification::identification::Identification {
        let (robot, base) = (looped_arm_robot, looped_arm_base);
        identify(Method::IdimLs, robot, base, experiment, options).unwrap()
    }
    let with_known = least_squares(&options, &experiment, &looped.arm.robot, &looped.arm.base);
    assert_eq!(with_known.estimate.nominal.len(), names.len() - identified.len());
    options.keep_nominal = None;
    let without = least_squares(&options, &experiment, &looped.arm.robot, &looped.arm.base);
    assert!(without.estimate.nominal.is_empty());
    let [with, without] = [with_known, without].map(|found| looped.deviation(&found));
    assert!(with < 0.05 && without > 1.0, "{with} {without}");
}
