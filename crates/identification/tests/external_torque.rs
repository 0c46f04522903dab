//! The momentum observer on arms whose external torque is known.

use std::f64::consts::{PI, TAU};

use didim_dynamics::robot::{JointIndex, ParameterKind};
use didim_dynamics::{MAX_JOINTS, SignalTiming};
use didim_identification::external_torque::{
    ExternalTorque, ExternalTorqueObserver, ObserverError, ObserverOptions, ObserverSignals,
    ObserverState,
};
use didim_identification::identification::{
    KnownArm, KnownModel, Motion, ParameterCovariance, ReachedRange, SignalDelays,
};
use nalgebra::DMatrix;

use crate::common::arm::{Arm, Random};

const BANDWIDTH_HZ: f64 = 8.0;
const GAIN: f64 = TAU * BANDWIDTH_HZ;

/// An observer under test: an arm with the values and the covariance of its parameters.
struct Setup {
    arm: Arm,
    values: Vec<f64>,
    covariance: DMatrix<f64>,
    signals: ObserverSignals,
    options: ObserverOptions,
}

impl Setup {
    fn exact(arm: Arm, sample_rate_hz: f64) -> Self {
        let values = arm.true_base();
        Self {
            covariance: DMatrix::zeros(values.len(), values.len()),
            values,
            arm,
            signals: ObserverSignals {
                sample_rate_hz,
                transmission: None,
                torque_timing: SignalTiming::INSTANTANEOUS,
                delays: SignalDelays::default(),
            },
            options: ObserverOptions {
                bandwidth_hz: BANDWIDTH_HZ,
                noise: Vec::new(),
                reached: Vec::new(),
            },
        }
    }

    fn observer(&self) -> Result<ExternalTorqueObserver, ObserverError> {
        let names = self.arm.base.names().iter().map(String::as_str);
        let parameters: Vec<(&str, f64)> = names.zip(self.values.iter().copied()).collect();
        let model =
            KnownModel { parameters: &parameters, fixed_parameters: &[], uncertainty: None };
        let covariance = ParameterCovariance::from_symmetric(&self.covariance);
        let known_arm = KnownArm { model, covariance: Some(&covariance) };
        let (signals, options) = (self.signals.clone(), self.options.clone());
        ExternalTorqueObserver::new(&self.arm.robot, &self.arm.base, &known_arm, signals, options)
    }

    /// Estimates along a record, one per sample from the first.
    fn estimates(&self, record: &Record) -> Vec<Option<ExternalTorque>> {
        let mut observer = self.observer().unwrap();
        (0..record.position.len())
            .map(|k| observer.step(k as u64, &record.position[k], &record.torque[k]).copied())
            .collect()
    }
}

/// Positions and torques by sample.
struct Record {
    position: Vec<Vec<f64>>,
    torque: Vec<Vec<f64>>,
}

impl Record {
    /// The arm follows a motion while the environment exerts `external(joint, t)`.
    fn new(arm: &Arm, motion: &Motion, rate_hz: f64, external: impl Fn(usize, f64) -> f64) -> Self {
        let torques = arm.torques(motion);
        let samples = motion.position.nrows();
        let by_sample = |value: &dyn Fn(usize, usize) -> f64| {
            (0..samples)
                .map(|k| (0..torques.len()).map(|joint| value(k, joint)).collect())
                .collect::<Vec<Vec<f64>>>()
        };
        Self {
            position: by_sample(&|k, joint| motion.position[(k, joint)]),
            torque: by_sample(&|k, joint| torques[joint][k] - external(joint, k as f64 / rate_hz)),
        }
    }
}

/// Size and frequency \[Hz\] of the torque from outside on a joint.
fn wave(joint: usize) -> (f64, f64) {
    (2.0 + joint as f64, 1.5 + 0.7 * joint as f64)
}

/// The wave behind the observer: a first-order low-pass with this gain \[1/s\], and a mean over
/// `mean_s` around the time.
fn filtered_wave(joint: usize, t: f64, gain: f64, mean_s: f64) -> f64 {
    let (size, hz) = wave(joint);
    let (omega, phase) = (TAU * hz, (TAU * hz / gain).atan());
    let half_turn = 0.5 * omega * mean_s;
    size * phase.cos() * half_turn.sin() / half_turn * (omega * t - phase).sin()
}

/// Returns the largest error of an observer whose bandwidth and sample rate are scaled together.
fn largest_error(arm: &Arm, scale: u8, seed: u64) -> f64 {
    let (rate_hz, gain) = (1000.0 * f64::from(scale), GAIN * f64::from(scale));
    let samples = 3000 * usize::from(scale);
    let motion = arm.motion(&mut Random(seed), samples, rate_hz, 0.8);
    let record = Record::new(arm, &motion, rate_hz, |joint, t| {
        let (size, hz) = wave(joint);
        size * (TAU * hz * t).sin()
    });
    let mut setup = Setup::exact(arm.clone(), rate_hz);
    setup.options.bandwidth_hz *= f64::from(scale);
    let estimates = setup.estimates(&record);
    // A speed is the difference of two positions half a time constant apart.
    let difference = (0.5 * rate_hz / gain).round();
    // Twenty time constants.
    let settled = 400 * usize::from(scale);
    let mut largest: f64 = 0.0;
    for (k, estimate) in estimates.iter().enumerate().skip(settled) {
        let t = (k as f64 - 0.5 * difference) / rate_hz;
        for joint in 0..arm.robot.joints() {
            let expected = filtered_wave(joint, t, gain, difference / rate_hz);
            let error = estimate.unwrap().torque[joint] - expected;
            largest = largest.max(error.abs());
        }
    }
    largest
}

/// The estimate is the torque from outside behind a first-order low-pass and a mean, with an error
/// that falls at least with their length: for links, drives, couplings, springs and friction.
#[test]
fn the_estimate_is_the_low_passed_torque_from_outside() {
    for (seed, joints) in (0..8).zip([2, 3, 4, 5].into_iter().cycle()) {
        let random = &mut Random(seed);
        let arm = Arm::random(random, joints);
        let arm = match seed % 4 {
            1 => arm.with_known_torques(),
            2 => arm.with_friction_laws(random),
            3 => arm.with_load_friction(random),
            _ => arm,
        };
        let [coarse, fine] = [1, 4].map(|scale| largest_error(&arm, scale, seed));
        assert!(fine < 0.05, "arm {seed}: {fine} N·m");
        assert!(fine < coarse / 4.0, "arm {seed}: {coarse} and {fine} N·m");
    }
}

/// Errors of the parameters spread the estimate as much as its standard deviation says.
#[test]
fn the_standard_deviation_is_that_of_drawn_parameters() {
    let random = &mut Random(11);
    let mut arm = Arm::random(random, 3);
    // Coulomb friction has a term of its own.
    for (value, parameter) in arm.truth.iter_mut().zip(arm.robot.parameters().parameters()) {
        if matches!(parameter.kind, ParameterKind::Fc | ParameterKind::FcMotor) {
            *value = 0.0;
        }
    }
    let rate_hz = 1000.0;
    let motion = arm.motion(&mut Random(12), 1000, rate_hz, 1.0);
    let record = Record::new(&arm, &motion, rate_hz, |_, _| 0.0);
    let mut setup = Setup::exact(arm, rate_hz);
    let truth = setup.values.clone();
    let count = truth.len();
    let factor = DMatrix::from_fn(count, count, |row, column| match row {
        _ if row < column => 0.0,
        _ => 0.02 * random.normal() / (1.0 + (row - column) as f64),
    });
    // The value of Coulomb friction also scales its own term, so it stays exact.
    let is_coulomb = |row: usize| setup.arm.base.names()[row].starts_with("fc");
    let factor =
        DMatrix::from_fn(
            count,
            count,
            |row, column| {
                if is_coulomb(row) { 0.0 } else { factor[(row, column)] }
            },
        );
    setup.covariance = &factor * factor.transpose();
    let (mut squares, draws) = (vec![0.0; 3], 300);
    for _ in 0..draws {
        let drawn = &factor * nalgebra::DVector::from_fn(count, |_, _| random.normal());
        setup.values = truth.iter().zip(drawn.iter()).map(|(value, error)| value + error).collect();
        let last = setup.estimates(&record).pop().unwrap().unwrap();
        for (joint, square) in squares.iter_mut().enumerate() {
            *square += (last.torque[joint] / last.standard_deviation[joint]).powi(2);
        }
    }
    for square in squares {
        // The relative standard deviation of a mean of 300 squares is 8 %.
        let mean = square / f64::from(draws);
        assert!((mean - 1.0).abs() < 0.3, "{mean}");
    }
}

#[test]
fn a_new_result_takes_effect_at_once() {
    let arm = Arm::random(&mut Random(21), 4);
    let rate_hz = 1000.0;
    let motion = arm.motion(&mut Random(22), 1200, rate_hz, 1.0);
    let record = Record::new(&arm, &motion, rate_hz, |_, _| 0.0);
    let exact = Setup::exact(arm.clone(), rate_hz);
    let mut wrong = Setup::exact(arm, rate_hz);
    wrong.values.iter_mut().for_each(|value| *value *= 1.3);
    let mut observer = wrong.observer().unwrap();
    let mut before = 0.0_f64;
    for k in 0..1000 {
        let (q, tau) = (&record.position[k], &record.torque[k]);
        if let Some(estimate) = observer.step(k as u64, q, tau) {
            before = estimate.torque.iter().fold(0.0, |most, torque| torque.abs().max(most));
        }
    }
    assert!(before > 1.0, "{before}");
    let mut next = exact.observer().unwrap();
    assert!(next.continue_from(&mut observer));
    let estimate = *next.step(1000, &record.position[1000], &record.torque[1000]).unwrap();
    assert_eq!(estimate.state, ObserverState::Settled);
    assert!(estimate.torque.iter().all(|torque| torque.abs() < 0.01), "{:?}", estimate.torque);
    // An observer of another bandwidth begins anew.
    let mut other = Setup::exact(exact.arm.clone(), rate_hz);
    other.options.bandwidth_hz = 1.0;
    let mut other = other.observer().unwrap();
    assert!(!other.continue_from(&mut next));
    assert_eq!(other.step(1001, &record.position[1001], &record.torque[1001]), None);
}

/// Friction at rest is anywhere between its limits, and σ says so; so it is for a time after a
/// reversal.
#[test]
fn friction_at_rest_and_at_reversals_is_uncertain() {
    let arm = Arm::random(&mut Random(31), 2);
    let column = |name: &str| arm.robot.parameters().find(name).unwrap();
    let (fc1, fc2) = (arm.truth[column("fc1")], arm.truth[column("fc_m2")]);
    let rate_hz = 1000.0;
    // Rest for 0.5 s, then a motion in one direction, then a reversal.
    let position = |k: usize| match k as f64 / rate_hz {
        t if t < 0.5 => 0.0,
        t if t < 1.5 => t - 0.5,
        t => 2.5 - t,
    };
    let position: Vec<Vec<f64>> = (0..2000).map(|k| vec![position(k), 0.0]).collect();
    let torque = vec![vec![0.0; 2]; position.len()];
    let mut setup = Setup::exact(arm, rate_hz);
    setup.options.noise = vec![0.01, 0.01];
    let estimates = setup.estimates(&Record { position, torque });
    let deviation = |k: usize| estimates[k].unwrap().standard_deviation[0];
    // Motor 2 also turns with joint 1, on which its friction then acts.
    let largest = fc1.hypot(fc2) / 3.0_f64.sqrt();
    assert!((deviation(450) / largest - 1.0).abs() < 0.01, "{} {largest}", deviation(450));
    assert!(deviation(1400) < 0.02, "{}", deviation(1400));
    assert!(deviation(1510) > 0.5 * largest, "{}", deviation(1510));
    assert!(deviation(1900) < 0.02, "{}", deviation(1900));
}

#[test]
fn a_gap_starts_the_observer_anew_and_another_motion_is_named() {
    let arm = Arm::random(&mut Random(41), 2);
    let rate_hz = 500.0;
    let motion = arm.motion(&mut Random(42), 2000, rate_hz, 0.5);
    let record = Record::new(&arm, &motion, rate_hz, |_, _| 0.0);
    let mut setup = Setup::exact(arm, rate_hz);
    let wide = ReachedRange {
        position: [-10.0, 10.0],
        velocity: [-20.0, 20.0],
        acceleration: [-1e3, 1e3],
    };
    setup.options.reached = vec![wide, ReachedRange { velocity: [-0.2, 0.1], ..wide }];
    let mut observer = setup.observer().unwrap();
    // Half of a time constant of 9.95 samples, and three of them.
    let (first, settling) = (5, 30);
    let (mut outside, mut settled) = (0, 0);
    for (k, sample) in (0..2000_u64).zip(0_usize..) {
        // Ten samples are lost after the first thousand.
        let sequence = if k < 1000 { k } else { k + 10 };
        let estimate = observer.step(sequence, &record.position[sample], &record.torque[sample]);
        let since = if k < 1000 { k } else { k - 1000 };
        match estimate.map(|of| of.state) {
            None => assert!(since < first, "{k}"),
            Some(ObserverState::Settling) => {
                assert!((first..first + settling).contains(&since), "{k}");
            }
            Some(ObserverState::OutsideMotion(joint)) => {
                assert_eq!(joint, JointIndex::new(1));
                outside += 1;
            }
            Some(ObserverState::Settled) => settled += 1,
        }
    }
    assert!(outside > 100 && settled > 100, "{outside} {settled}");
}

/// Positions of motors with a delay of their own, and held torques, give what joint-side signals
/// without delays do.
#[test]
fn motor_side_signals_with_delays_give_the_same() {
    let arm = Arm::random(&mut Random(51), 3);
    let rate_hz = 1000.0;
    let motion = arm.motion(&mut Random(52), 1500, rate_hz, 0.8);
    let external = |joint: usize, t: f64| (2.0 + joint as f64) * (PI * t).sin();
    let record = Record::new(&arm, &motion, rate_hz, external);
    let plain = Setup::exact(arm.clone(), rate_hz).estimates(&record);

    let transmission = arm.robot.transmission();
    let inverse = |joint: &[f64]| {
        // Rows of R⁻ᵀ: the torque of the motors for that of the joints.
        let rows = transmission.rows();
        let r = DMatrix::from_fn(3, 3, |row, column| rows[row][column]);
        let tau = nalgebra::DVector::from_column_slice(joint);
        r.transpose().lu().solve(&tau).unwrap().as_slice().to_vec()
    };
    // Motor 1 is logged two samples late. Torques act over the period after their stamp.
    let late = |axis: usize| if axis == 0 { 2 } else { 0 };
    let motors: Vec<Vec<f64>> = record
        .position
        .iter()
        .map(|joint| {
            let mut motor = vec![0.0; 3];
            transmission.motor_position(joint, &mut motor);
            motor
        })
        .collect();
    let position = (2..1499).map(|k| (0..3).map(|axis| motors[k - late(axis)][axis]).collect());
    let torque = (2..1499).map(|k| {
        let mean = |joint: usize| 0.5 * (record.torque[k][joint] + record.torque[k + 1][joint]);
        inverse(&[mean(0), mean(1), mean(2)])
    });
    let late_record = Record { position: position.collect(), torque: torque.collect() };
    let mut setup = Setup::exact(arm.clone(), rate_hz);
    setup.signals.transmission = Some(transmission.clone());
    setup.signals.torque_timing = SignalTiming { hold_s: 1.0 / rate_hz, delay_s: 0.0 };
    setup.signals.delays.position_s = vec![-2.0 / rate_hz, 0.0, 0.0];
    let delayed = setup.estimates(&late_record);
    for k in 1200..1490 {
        let (a, b) = (plain[k].unwrap().torque, delayed[k].unwrap().torque);
        for joint in 0..3 {
            assert!((a[joint] - b[joint]).abs() < 1e-9, "{k} {joint}: {} {}", a[joint], b[joint]);
        }
    }
}

#[test]
fn what_gives_no_observer_is_named() {
    let setup = || Setup::exact(Arm::random(&mut Random(61), 2), 1000.0);
    let refused = |change: fn(&mut Setup)| {
        let mut setup = setup();
        change(&mut setup);
        setup.observer().unwrap_err()
    };
    let bad = |error: ObserverError| match error {
        ObserverError::BadValue { what, .. } | ObserverError::Length { what, .. } => what,
        other => panic!("{other}"),
    };
    assert_eq!(bad(refused(|of| of.options.bandwidth_hz = 500.0)), "bandwidth");
    assert_eq!(bad(refused(|of| of.options.bandwidth_hz = f64::NAN)), "bandwidth");
    assert_eq!(bad(refused(|of| of.options.noise = vec![1.0])), "noise");
    assert_eq!(bad(refused(|of| of.signals.sample_rate_hz = 0.0)), "sample rate");
    assert_eq!(bad(refused(|of| of.signals.delays.torque_s = vec![0.0])), "torque delays");
    let delay = refused(|of| of.signals.delays.torque_s = vec![2.0, 0.0]);
    assert_eq!(bad(delay), "delay of a signal");
    let covariance = refused(|of| of.covariance = DMatrix::zeros(1, 1));
    assert!(matches!(covariance, ObserverError::NoCovariance));
    let few = setup();
    assert!(few.observer().unwrap().time_constant_s() * GAIN > 0.999);
    assert!(MAX_JOINTS > few.arm.robot.joints());
}
