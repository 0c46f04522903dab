//! The choices that the options offer.

use didim_dynamics::SignalTiming;
use didim_dynamics::control::{ControlTiming, SimulatedController};
use didim_dynamics::dynamics::Workspace;
use didim_dynamics::simulation::Integrator;
use didim_dynamics::trajectory::ReferenceInterpolation;
use didim_identification::identification::{
    ConvergenceLimits, Identification, IdentificationError, IterationError, Method, Note, Options,
    ReferenceSource, Start, identify, mean_joint_inertia,
};
use nalgebra::DMatrix;

use crate::common::arm::{Arm, Random};
use crate::common::looped::{Looped, PERIOD_S, ZERO_ORDER_HOLD, pd, sampled};

/// A controller twice as fast as the record sees every other of its commands, and needs to know
/// how its drive interpolates the reference in between.
#[test]
fn a_controller_faster_than_the_record_gives_the_truth_back() {
    let fast = ControlTiming::Sampled { sample_period_s: 0.5 * PERIOD_S, computation_delay_s: 0.0 };
    let timing = SignalTiming { hold_s: 0.5 * PERIOD_S, delay_s: 0.0 };
    for interpolation in [ReferenceInterpolation::Cubic, ReferenceInterpolation::Linear] {
        let mut looped = Looped::random(6, 2, fast, pd);
        looped.interpolation = interpolation;
        let experiment = looped.record(timing);
        let mut options = looped.options();
        options.simulation.convergence.parameter_change = 1e-9;
        let output = looped.identify(&experiment, &options).unwrap();
        let deviation = looped.deviation(&output);
        // As in the tests of exactness.
        assert!(deviation < 1e-9, "{interpolation:?}: {deviation}");
    }
}

/// A target that is sent one period before it takes effect.
#[test]
fn a_reference_acts_when_its_timing_says() {
    let looped = Looped::random(7, 2, sampled(0.0), pd);
    let early = looped.record_with(ZERO_ORDER_HOLD, |signals| {
        for reference in signals.reference_rad.iter_mut().flatten() {
            reference.rotate_left(1);
        }
    });
    let timing = SignalTiming { hold_s: 0.0, delay_s: PERIOD_S };
    let honoured = early.clone().with_reference_timing(timing).unwrap();
    let mut options = looped.options();
    options.simulation.convergence.parameter_change = 0.01;
    let identify = |experiment| looped.identify(experiment, &options);
    let honoured = looped.deviation(&identify(&honoured).unwrap());
    // These limits stop at 1e-5 here; a period of 1 ms matters to a loop of 10 Hz.
    assert!(honoured < 1e-4, "{honoured}");
    // Ignored, the loop answers before it is asked: no parameters do that, and none are found.
    let ignored = identify(&early).unwrap_err();
    assert!(
        matches!(ignored, IdentificationError::Iteration(IterationError::NotConverged { .. })),
        "{ignored}"
    );
}

/// Proportional and derivative control of known bandwidth is the cabinet with rescaled gains.
#[test]
fn a_loop_of_the_cabinet_s_bandwidth_is_the_cabinet_s() {
    let looped = Looped::random(8, 2, sampled(0.0), pd);
    let experiment = looped.record(ZERO_ORDER_HOLD);
    let mut options = looped.rescaled_options(&experiment);
    let cabinet = looped.identify(&experiment, &options).unwrap();
    options.controller = Some(SimulatedController::Bandwidth {
        timing: sampled(0.0),
        bandwidth_hz: vec![10.0; 2],
        damping: 0.8,
        acceleration_feed_forward: false,
    });
    let bandwidth = looped.identify(&experiment, &options).unwrap();
    // The cabinet's gains are 10 Hz at the mean inertia along the reference, not over the rows.
    for (a, b) in cabinet.estimate.parameters.iter().zip(&bandwidth.estimate.parameters) {
        assert!((a.value - b.value).abs() < 2e-2 * a.value.abs().max(0.1), "{a:?} {b:?}");
    }
}

#[test]
fn without_a_reference_the_measured_position_stands_in_and_the_result_says_so() {
    let looped = Looped::random(9, 2, sampled(0.0), pd);
    let recorded = looped.record(ZERO_ORDER_HOLD);
    let silent = looped.record_with(ZERO_ORDER_HOLD, |signals| signals.reference_rad = None);
    let mut options = looped.options();
    options.controller = Some(SimulatedController::Bandwidth {
        timing: sampled(0.0),
        bandwidth_hz: vec![25.0; 2],
        damping: 0.8,
        acceleration_feed_forward: true,
    });
    let output = looped.identify(&silent, &options).unwrap();
    assert_eq!(output.estimate.reference, Some(ReferenceSource::MeasuredPosition));
    fn notes_substitute(found: &Identification) -> bool {
        let notes = &found.estimate.verdict.notes;
        notes.contains(&Note::NoReference)
    }
    assert!(notes_substitute(&output), "{:?}", output.estimate.verdict);
    let with_reference = looped.identify(&recorded, &looped.options()).unwrap();
    assert_eq!(with_reference.estimate.reference, Some(ReferenceSource::Recorded));
    assert!(!notes_substitute(&with_reference));
    let equation_error =
        identify(Method::IdimLs, &looped.arm.robot, &looped.arm.base, &silent, &options).unwrap();
    assert!(equation_error.estimate.reference.is_none());
    assert!(equation_error.estimate.convergence.is_empty());
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
    assert!(options.simulation.decimated);
    assert_eq!(options.simulation.start, Start::IdimLs);
    assert_eq!((options.simulation.integrator, options.simulation.substeps), (Integrator::Ode3, 1));
    assert_eq!(options.simulation.reference, ReferenceInterpolation::Cubic);
    assert_eq!(options.simulation.convergence, ConvergenceLimits::default());
    let full = format!(
        "{text}[simulation]\ndecimated = false\nstart = 'unit-drive-inertias'\n\
         reference = 'hold'\n[simulation.convergence]\nmax_simulations = 9\n"
    );
    let options: Options = toml::from_str(&full).unwrap();
    assert_eq!(options.simulation.convergence.max_simulations, 9);
    assert!(!options.simulation.decimated);
    assert_eq!(options.simulation.start, Start::UnitDriveInertias);
    for bad in [
        full.replace("max_simulations", "max_iterations"),
        full.replace("decimated", "decimate"),
        full.replace("'unit-drive-inertias'", "'zero'"),
        text.replace("kind = 'bandwidth'\n", ""),
    ] {
        assert!(toml::from_str::<Options>(&bad).is_err(), "{bad}");
    }
}

/// Where nothing but the links has inertia, a loop is held by what each joint has while the others
/// are free: a fraction of what it has while they stand.
#[test]
fn an_arm_with_torques_behind_the_gear_is_simulated_from_every_start() {
    for seed in 0..3 {
        let looped = Looped::behind_the_gear(seed, 5);
        fn record(
            reference: bool,
            looped: &Looped,
        ) -> didim_identification::identification::Experiment {
            looped.record_with(ZERO_ORDER_HOLD, |signals| {
                let mut random = Random(9);
                signals.torque_nm.iter_mut().flatten().for_each(|t| *t += 0.5 * random.normal());
                signals.reference_rad.take_if(|_| !reference);
            })
        }
        for start in [Start::IdimLs, Start::UnitDriveInertias] {
            let mut options = looped.options();
            options.simulation.start = start;
            let output = looped.identify(&record(true, &looped), &options).unwrap();
            assert!(looped.deviation(&output) < 0.5, "{seed} {start:?}");
            // Four times as fast as the cabinet's, along the measured motion, which it follows with
            // a lag.
            options.controller = Some(SimulatedController::Bandwidth {
                timing: sampled(0.0),
                bandwidth_hz: vec![40.0; 5],
                damping: 0.8,
                acceleration_feed_forward: true,
            });
            let estimate = looped.identify(&record(false, &looped), &options).unwrap().estimate;
            println!("{seed} {start:?}: {} in {}", estimate.relative_error, estimate.simulations);
            assert!(
                estimate.relative_error < 0.03,
                "{seed} {start:?}: {}",
                estimate.relative_error
            );
        }
    }
}

/// The eigenvalues of M⁻¹ diag(J) are the squares of the loops' frequencies over those that they
/// are tuned for.
#[test]
fn loops_tuned_for_the_inertia_of_a_joint_are_no_faster_than_the_joints_are_many() {
    for seed in 0..5 {
        let Arm { model, truth, .. } = Arm::random(&mut Random(seed), 6);
        let posture = DMatrix::from_row_slice(1, 6, &[0.3, -0.4, 1.0, 0.2, 0.7, -1.1]);
        let inertia = mean_joint_inertia(&model, &truth, &posture);
        let mut mass = DMatrix::zeros(6, 6);
        model.mass_matrix(&mut Workspace::new(), &truth, posture.as_slice(), mass.as_mut_slice());
        let inverse = mass.clone().try_inverse().unwrap();
        for (joint, inertia) in inertia.iter().enumerate() {
            assert!((inertia * inverse[(joint, joint)] - 1.0).abs() < 1e-9, "joint {joint}");
            assert!(*inertia < 1.000_001 * mass[(joint, joint)]);
        }
    }
}
