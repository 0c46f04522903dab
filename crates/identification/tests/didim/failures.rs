//! What cannot be simulated or does not come to rest is said, with what to do.

use didim_dynamics::SignalTiming;
use didim_dynamics::control::{ControlError, ControlTiming, SimulatedController};
use didim_dynamics::robot::JointIndex;
use didim_dynamics::simulation::{SetupError, SimulationError};
use didim_identification::identification::{
    IdentificationError, IterationError, Note, Options, Start,
};

use crate::common::looped::{Looped, PERIOD_S, ZERO_ORDER_HOLD, pd, pd_of, sampled};

fn refused(change: impl Fn(&mut Options)) -> IdentificationError {
    let looped = Looped::random(0, 2, sampled(0.0), pd);
    let mut options = looped.options();
    change(&mut options);
    looped.identify(&looped.record(ZERO_ORDER_HOLD), &options).unwrap_err()
}

/// The start has ten times the inertia of the arm: its loop lags so much that the first steps
/// overshoot into parameters of no arm.
#[test]
fn a_step_that_cannot_be_simulated_is_halved_and_counted() {
    for seed in 0..3 {
        let looped = Looped::of_inertia(0.1, seed, 3, sampled(0.0), |j| pd_of(7.0, j));
        let output = looped.identify(&looped.record(ZERO_ORDER_HOLD), &looped.options()).unwrap();
        let steps = &output.estimate.convergence;
        let halvings: u32 = steps.iter().map(|step| step.halvings).sum();
        assert!(halvings > 0, "seed {seed}: {steps:?}");
        // Every simulation has led to a step or to a halving.
        assert_eq!(output.estimate.simulations as usize, steps.len() + halvings as usize);
        assert_eq!(steps.last().unwrap().simulation, output.estimate.simulations);
        // One more step than simulations: that with the renewed weights.
        assert_eq!(output.estimate.iterations as usize, steps.len() + 1);
        // The default limits stop it at 0.2 standard deviations of IDIM-LS, which the prefilter's
        // bias makes some 1e-3 wide here.
        let deviation = looped.deviation(&output);
        assert!(deviation < 5e-3, "seed {seed}: {deviation}");
    }
}

/// A joint whose torque is logged with the wrong sign asks for negative inertia, which no arm has:
/// the arm that is simulated gets what it lacks, and the verdict says what is wrong.
#[test]
fn a_joint_of_wrong_sign_is_simulated_and_named() {
    let looped = Looped::random(1, 3, sampled(0.0), pd);
    let experiment = looped.record_with(ZERO_ORDER_HOLD, |signals| {
        signals.torque_nm[2].iter_mut().for_each(|torque| *torque = -*torque);
    });
    let verdict = looped.identify(&experiment, &looped.options()).unwrap().estimate.verdict;
    assert!(!verdict.applicable);
    let reasons: Vec<String> = verdict.reasons.iter().map(ToString::to_string).collect();
    println!("{reasons:#?}");
    assert!(reasons[0].contains("sign") && reasons[0].contains("joint 3"), "{reasons:#?}");
}

#[test]
fn a_controller_that_does_not_hold_the_arm_names_joint_and_time() {
    // A sampled loop is unstable long before its bandwidth reaches half the sample rate.
    let error = refused(|options| {
        if let Some(SimulatedController::Cabinet { joints, .. }) = &mut options.controller {
            joints[1].law = pd_of(150.0, 1.0);
        }
    });
    let IdentificationError::Iteration(IterationError::FirstSimulation { cause }) = error else {
        panic!("{error}")
    };
    let SimulationError::Divergence { joint, time_s, .. } = cause else { panic!("{cause}") };
    assert_eq!(joint, JointIndex::new(1));
    assert!(time_s > 0.0 && time_s < 1.0, "{time_s}");
    assert!(error.to_string().contains("joint 2 diverged at 0."), "{error}");
}

/// Where the gains are not the cabinet's, nothing is lost by slower ones.
#[test]
fn a_stand_in_that_does_not_hold_the_arm_is_slowed_down() {
    let looped = Looped::random(0, 2, sampled(0.0), pd);
    let mut options = looped.options();
    options.controller = Some(SimulatedController::Bandwidth {
        timing: sampled(0.0),
        bandwidth_hz: vec![10.0, 250.0],
        damping: 0.8,
        acceleration_feed_forward: true,
    });
    let estimate = looped.identify(&looped.record(ZERO_ORDER_HOLD), &options).unwrap().estimate;
    let slower = estimate.verdict.notes.iter().find_map(|note| match note {
        Note::SlowerLoop { bandwidth_hz } => Some(bandwidth_hz),
        _ => None,
    });
    let Some(bandwidth_hz) = slower else { panic!("{:?}", estimate.verdict.notes) };
    assert_eq!(estimate.slower_bandwidth_hz, Some(*bandwidth_hz));
    let times = (bandwidth_hz / 10.0).ln() / 0.7_f64.ln();
    assert!(
        (1.0..=6.0).contains(&times.round()) && (times - times.round()).abs() < 1e-9,
        "{times}"
    );
}

#[test]
fn estimates_that_still_move_are_an_error() {
    let error = refused(|options| options.simulation.convergence.max_simulations = 2);
    let IdentificationError::Iteration(IterationError::NotConverged {
        simulations: 2,
        relative_error_change: Some(error_change),
        parameter_change,
        parameter,
    }) = &error
    else {
        panic!("{error}");
    };
    assert!(*error_change > 0.0 && *parameter_change > 0.2, "{error}");
    assert!(error.to_string().contains(&format!("leave {parameter} out")), "{error}");
}

#[test]
fn options_that_make_no_sense_are_named() {
    for (key, expected) in [("relative_error_change", 0.0), ("parameter_change", -1.0)] {
        let error = refused(|options| match key {
            "parameter_change" => options.simulation.convergence.parameter_change = expected,
            _ => options.simulation.convergence.relative_error_change = expected,
        });
        assert!(error.to_string().starts_with(&format!("convergence.{key} = ")), "{error}");
    }
    let error = refused(|options| options.simulation.convergence.max_simulations = 1);
    assert!(error.to_string().contains("convergence.max_simulations = 1"), "{error}");
    let error = refused(|options| options.simulation.start = Start::Nominal);
    assert!(matches!(error, IdentificationError::NoNominalParameters { .. }), "{error}");
    let error = refused(|options| options.simulation.substeps = 0);
    let expected_name = "substeps";
    assert!(
        matches!(
            error,
            IdentificationError::Setup(SetupError::BadValue { what: w, .. }) if w == expected_name
        ),
        "{error}"
    );
    let error = refused(|options| {
        if let Some(SimulatedController::Cabinet { joints, .. }) = &mut options.controller {
            joints.pop();
        }
    });
    let length = ControlError::Length { key: "joints", expected: 2, found: 1 };
    assert_eq!(error, IdentificationError::Setup(SetupError::Control(length)));
}

#[test]
fn times_of_record_and_controller_must_agree() {
    fn with_timing(timing: ControlTiming) -> IdentificationError {
        refused(|options| {
            if let Some(SimulatedController::Cabinet { timing: own, .. }) = &mut options.controller
            {
                *own = timing;
            }
        })
    }
    for period_s in [2.0 * PERIOD_S, 0.4 * PERIOD_S, 1.001 * PERIOD_S] {
        let error = with_timing(ControlTiming::Sampled {
            sample_period_s: period_s,
            computation_delay_s: 0.0,
        });
        assert_eq!(
            error,
            IdentificationError::ControllerPeriod {
                controller_period_s: period_s,
                sample_period_s: PERIOD_S
            }
        );
    }
    let error = with_timing(sampled(0.5 * PERIOD_S));
    let expected = IdentificationError::TorqueDelay { logged_s: 0.0, simulated_s: 0.5 * PERIOD_S };
    assert_eq!(error, expected);
    assert!(error.to_string().contains("500.000 µs"), "{error}");

    // A delay that moves the torque out of the record.
    let looped = Looped::random(0, 2, sampled(0.0), pd);
    let experiment = looped.record(SignalTiming { hold_s: 0.0, delay_s: 2100.0 * PERIOD_S });
    let error = looped.identify(&experiment, &looped.options()).unwrap_err();
    assert!(matches!(error, IdentificationError::TorqueOutside { .. }), "{error}");
}
