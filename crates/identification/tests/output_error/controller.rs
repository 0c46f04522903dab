//! The described controller, held against the recorded torques.

use didim_dynamics::control::{ControlLaw, ControlTiming, SimulatedController};
use didim_dynamics::{SignalTiming, Signals};
use didim_identification::identification::{
    ControllerUnchecked, Estimate, Experiment, FindingCode, Method, Note, NuisanceParameter,
    Options, Start, Subject, identify,
};

use super::loops::{cascade, pid};
use crate::common::arm::Random;
use crate::common::looped::{Looped, PERIOD_S, ZERO_ORDER_HOLD, pd, sampled};

const CONTINUOUS: ControlTiming = ControlTiming::Continuous { sample_period_s: PERIOD_S };

/// The timings, with that of the torque which is recorded under each.
const TIMINGS: [(ControlTiming, SignalTiming); 2] = [
    (
        ControlTiming::Sampled { sample_period_s: PERIOD_S, computation_delay_s: 0.0 },
        ZERO_ORDER_HOLD,
    ),
    (CONTINUOUS, SignalTiming::INSTANTANEOUS),
];

/// Noise of the recording that no controller has seen, relative to the rms of each torque; each
/// value takes this share of the one before.
#[derive(Clone, Copy, Debug)]
struct Noise {
    seed: u64,
    torque: f64,
    memory: f64,
    position_rad: f64,
}

const NONE: Noise = Noise { seed: 0, torque: 0.0, memory: 0.0, position_rad: 0.0 };

fn recorded(looped: &Looped, timing: SignalTiming, noise: Noise) -> Experiment {
    looped.record_with(timing, |signals: &mut Signals| {
        let mut random = Random(noise.seed);
        for torque in &mut signals.torque_nm {
            let rms = (torque.iter().map(|t| t * t).sum::<f64>() / torque.len() as f64).sqrt();
            let fresh = noise.torque * rms * (1.0 - noise.memory * noise.memory).sqrt();
            let mut value = noise.torque * rms * random.normal();
            for torque in torque {
                *torque += value;
                value = noise.memory * value + fresh * random.normal();
            }
        }
        let positions = signals.position_rad.iter_mut().flatten();
        positions.for_each(|q| *q += noise.position_rad * random.normal());
    })
}

fn estimated(
    looped: &Looped,
    method: Method,
    experiment: &Experiment,
    options: &Options,
) -> Estimate {
    let (robot, base) = (&looped.arm.robot, &looped.arm.base);
    identify(method, robot, base, experiment, options).unwrap().estimate
}

fn options(looped: &Looped) -> Options {
    let mut options = looped.options();
    options.simulation.start = Start::IdimLs;
    options
}

/// Joints, numbered from 1, whose controller is reported to differ.
fn joints_of_controller(estimate: &Estimate) -> Vec<usize> {
    let findings = estimate.verdict.findings().into_iter();
    let joints = findings.filter(|of| of.code == FindingCode::Controller).filter_map(|of| {
        let Some(Subject::Joints(joints)) = of.subject else { return None };
        joints.first().map(|joint| joint.number())
    });
    joints.collect()
}

/// The options with something done to the law of each joint, numbered from 1.
fn options_with(looped: &Looped, change: impl Fn(usize, &mut ControlLaw)) -> Options {
    let mut options = options(looped);
    if let Some(SimulatedController::Cabinet { joints, .. }) = &mut options.controller {
        (1..).zip(joints).for_each(|(joint, controller)| change(joint, &mut controller.law));
    }
    options
}

fn all_gains(law: &mut ControlLaw, factor: f64) {
    match law {
        ControlLaw::P { k_tau_nm, .. }
        | ControlLaw::Pd { k_tau_nm, .. }
        | ControlLaw::Pid { k_tau_nm, .. }
        | ControlLaw::CascadedPPi { k_tau_nm, .. } => *k_tau_nm *= factor,
    }
}

/// The kinds of noise: white and coloured (0.1 s) of the torques, and of the positions.
fn noises(seed: u64) -> Vec<Noise> {
    let mut noises = vec![NONE];
    for torque in [0.01, 0.03, 0.1] {
        noises.extend([0.0, 0.99].map(|memory| Noise { seed, torque, memory, ..NONE }));
    }
    noises.extend([1e-5, 1e-4].map(|position_rad| Noise { seed, position_rad, ..NONE }));
    noises
}

type Law = fn(f64) -> ControlLaw;

const LAWS: [(&str, Law); 3] = [("pd", pd), ("pid", pid), ("cascade", cascade)];

#[test]
fn noise_of_the_recording_is_no_fault_of_the_controller() {
    let mut largest: f64 = 0.0;
    for (timing, torque_timing) in TIMINGS {
        for (name, law) in LAWS {
            let looped = Looped::random(80, 2, timing, law);
            for noise in (0..4).flat_map(noises) {
                let experiment = recorded(&looped, torque_timing, noise);
                let estimate = estimated(&looped, Method::IdimLs, &experiment, &options(&looped));
                let errors = estimate.controller_error_per_joint.clone().unwrap();
                largest = errors.iter().fold(largest, |largest, error| largest.max(*error));
                assert_eq!(
                    joints_of_controller(&estimate),
                    [0; 0],
                    "{name} {timing:?} {noise:?}: {errors:?}"
                );
            }
        }
    }
    println!("largest error of a right controller: {largest:.1e}");
}

/// All gains, those of one joint, and one gain of one joint, 5 % high. Slow noise of a tenth of the
/// torque hides it: that is what a motion of five seconds tells.
#[test]
fn gains_that_are_not_the_recorded_ones_are_reported_through_noise() {
    for (timing, torque_timing) in TIMINGS {
        for (law_name, law) in LAWS {
            let looped = Looped::random(81, 2, timing, law);
            let all_changed = options_with(&looped, |_, law| all_gains(law, 1.05));
            let second = options_with(&looped, |joint, law| {
                if joint == 2 {
                    all_gains(law, 1.05);
                }
            });
            let first_kp = options_with(&looped, |joint, law| {
                if let (1, ControlLaw::Pd { kp_per_rad: kp, .. })
                | (1, ControlLaw::Pid { kp_per_rad: kp, .. })
                | (1, ControlLaw::CascadedPPi { kp_s_per_rad: kp, .. }) = (joint, law)
                {
                    *kp *= 1.05;
                }
            });
            let changes = [(&all_changed, &[1, 2][..]), (&second, &[2]), (&first_kp, &[1])];
            for noise in noises(1).into_iter().filter(|of| of.torque < 0.1 || of.memory == 0.0) {
                let experiment = recorded(&looped, torque_timing, noise);
                for (options, joints) in changes {
                    let estimate = estimated(&looped, Method::IdimLs, &experiment, options);
                    let errors = &estimate.controller_error_per_joint;
                    let name = format!("{law_name} {timing:?} {noise:?}: {joints:?} {errors:?}");
                    println!("{name}");
                    assert_eq!(joints_of_controller(&estimate), joints, "{name}");
                }
            }
        }
    }
}

/// A fit that simulates with the wrong gains, and fits well, is found by the same check.
#[test]
fn wrong_gains_are_reported_whatever_the_method() {
    for (timing, torque_timing) in TIMINGS {
        let looped = Looped::random(82, 2, timing, pd);
        let noise = Noise { torque: 0.03, ..NONE };
        let experiment = recorded(&looped, torque_timing, noise);
        let wrong = options_with(&looped, |_, law| all_gains(law, 1.05));
        for method in Method::ALL {
            let right = estimated(&looped, method, &experiment, &options(&looped));
            assert_eq!(
                joints_of_controller(&right),
                [0; 0],
                "{method} {:?}",
                right.controller_error_per_joint
            );
            let estimate = estimated(&looped, method, &experiment, &wrong);
            assert_eq!(
                joints_of_controller(&estimate),
                [1, 2],
                "{method} {:?}",
                estimate.controller_error_per_joint
            );
        }
    }
}

/// A position that one drive scales wrongly leaves the described law far from the recorded command,
/// and the check reports how far, with every law and scale.
#[test]
fn a_wrong_scale_of_a_position_shows_with_its_size() {
    let mut sizes = Vec::new();
    for (name, law) in LAWS {
        for (timing, torque_timing) in TIMINGS {
            let looped = Looped::random(85, 2, timing, law);
            for scale in [1.01, 1.03, 1.1] {
                let experiment = looped.record_with(torque_timing, |signals: &mut Signals| {
                    let mut random = Random(85);
                    signals
                        .torque_nm
                        .iter_mut()
                        .flatten()
                        .for_each(|t| *t += 0.1 * random.normal());
                    signals.position_rad[1].iter_mut().for_each(|q| *q *= scale);
                });
                let estimate = estimated(&looped, Method::IdimLs, &experiment, &options(&looped));
                let found = estimate.controller_error_per_joint.clone().unwrap();
                assert!(found[1] > 0.05, "{name}, {scale}: {found:?}");
                assert_eq!(joints_of_controller(&estimate), [2], "{name}, {scale}: {found:?}");
                sizes.push(found[1]);
            }
        }
    }
    assert_eq!(sizes.len(), 18);
    // A larger error of the scale has a larger size.
    assert!(sizes.chunks(3).all(|of| of.is_sorted()), "{sizes:?}");
}

/// A substitute controller does not identify the torque gains of the drives.
#[test]
fn a_substitute_controller_identifies_no_torque_gain() {
    let looped = Looped::random(86, 2, sampled(0.0), pd);
    let experiment = recorded(&looped, ZERO_ORDER_HOLD, NONE);
    let mut substitute = options(&looped);
    substitute.controller = Some(SimulatedController::Bandwidth {
        timing: sampled(0.0),
        bandwidth_hz: vec![8.0; 2],
        damping: 0.8,
        acceleration_feed_forward: true,
    });
    let mut gains = 0;
    for method in [Method::IdimIv, Method::Didim, Method::Clie] {
        let estimate = estimated(&looped, method, &experiment, &substitute);
        for found in &estimate.nuisance_parameters {
            let is_gain = matches!(
                found.nuisance,
                NuisanceParameter::CommonGain | NuisanceParameter::TorqueGain(_)
            );
            gains += usize::from(is_gain);
            assert!(!is_gain || found.quantity.is_none(), "{method}: {found:?}");
        }
    }
    assert_eq!(gains, 3 * 3);
}

/// A result that depends on the controller says why it was not checked, and no other.
#[test]
fn a_note_says_why_the_controller_was_not_checked() {
    use ControllerUnchecked::{BetweenSamples, NoCommand, NoReference, StandIn};

    let looped = Looped::random(83, 2, sampled(0.0), pd);
    let held_record = recorded(&looped, ZERO_ORDER_HOLD, NONE);
    let instant = recorded(&looped, SignalTiming::INSTANTANEOUS, NONE);
    let unreferenced = looped.record_with(ZERO_ORDER_HOLD, |signals| signals.reference_rad = None);
    let mut faster = options(&looped);
    if let Some(SimulatedController::Cabinet { timing, .. }) = &mut faster.controller {
        *timing =
            ControlTiming::Sampled { sample_period_s: 0.5 * PERIOD_S, computation_delay_s: 0.0 };
    }
    let mut stand_in = options(&looped);
    stand_in.controller = Some(SimulatedController::Bandwidth {
        timing: sampled(0.0),
        bandwidth_hz: vec![10.0; 2],
        damping: 0.8,
        acceleration_feed_forward: true,
    });
    let options = options(&looped);
    for (experiment, options, expected) in [
        (&held_record, &options, None),
        (&instant, &options, Some(NoCommand)),
        (&unreferenced, &options, Some(NoReference)),
        (&held_record, &faster, Some(BetweenSamples)),
        (&held_record, &stand_in, Some(StandIn)),
    ] {
        for method in [Method::IdimLs, Method::Didim] {
            let estimate = estimated(&looped, method, experiment, options);
            let why = estimate.verdict.notes.iter().find_map(|note| match note {
                Note::ControllerUnchecked { why } => Some(*why),
                _ => None,
            });
            assert_eq!(why, expected.filter(|_| method.simulates()), "{method}");
            assert_eq!(estimate.controller_error_per_joint.is_some(), expected.is_none());
        }
    }
}

/// What an integral adds is slow, and passes for noise where nothing slow is among what explains
/// it.
#[test]
fn an_integral_that_is_not_described_is_reported() {
    for (timing, torque_timing) in TIMINGS {
        let looped = Looped::random(84, 2, timing, pid);
        let without = options_with(&looped, |_, law| {
            if let ControlLaw::Pid { kp_per_rad, kd_s_per_rad, k_tau_nm, .. } = *law {
                *law = ControlLaw::Pd { kp_per_rad, kd_s_per_rad, k_tau_nm };
            }
        });
        for noise in [NONE, Noise { torque: 0.03, ..NONE }] {
            let experiment = recorded(&looped, torque_timing, noise);
            let estimate = estimated(&looped, Method::IdimLs, &experiment, &without);
            assert_eq!(
                joints_of_controller(&estimate),
                [1, 2],
                "{:?}",
                estimate.controller_error_per_joint
            );
        }
    }
}
