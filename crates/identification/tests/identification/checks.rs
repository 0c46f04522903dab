//! Errors put in on purpose: each is found under its own name, and nothing is found where none is.

use didim_dynamics::SignalTiming;
use didim_dynamics::robot::{JointIndex, MotorIndex};
use didim_identification::identification::{
    Estimate, Experiment, FindingCode, Method, Note, NuisanceParameter, Options, Reason, Subject,
    identify,
};
use nalgebra::DMatrix;

use crate::common::arm::{Arm, Random, options, signals};

const RATE_HZ: f64 = 400.0;
const SAMPLES: usize = 6000;
/// Noise of each torque \[N·m\].
const NOISE_NM: f64 = 0.2;

/// Samples of the true motion per sample of the record, so that a torque can act in between.
const FINE: usize = 10;

/// A random arm on a random motion, with noise on its torques.
struct Bench {
    arm: Arm,
    position: Vec<Vec<f64>>,
    velocity: Vec<Vec<f64>>,
    torque: Vec<Vec<f64>>,
    options: Options,
}

/// What is logged as the torque of each joint acts later by so many tenths of a sample.
fn bench_with_delays(seed: u64, tenths: [isize; 3]) -> Bench {
    bench_of(seed, tenths, &[])
}

/// The same of an arm that has these values of parameters.
fn bench_of(seed: u64, tenths: [isize; 3], values: &[(&str, f64)]) -> Bench {
    let mut random = Random(seed);
    let mut arm = Arm::random(&mut random, 3);
    for (name, value) in values {
        let column = arm.robot.parameters().find(name).unwrap();
        arm.truth[column] = *value;
    }
    let motion = arm.motion(&mut random, SAMPLES * FINE, RATE_HZ * FINE as f64, 2.0);
    let every_tenth = |signal: &[f64], shift: isize| -> Vec<f64> {
        let last = signal.len() as isize - 1;
        let shifted_index = |k: usize| (k * FINE) as isize + shift;
        (0..SAMPLES).map(|k| signal[shifted_index(k).clamp(0, last) as usize]).collect()
    };
    let columns = |m: &DMatrix<f64>| -> Vec<Vec<f64>> {
        m.column_iter().map(|column| every_tenth(column.into_owned().as_slice(), 0)).collect()
    };
    let torques = arm.torques(&motion);
    let torque = torques.iter().zip(tenths).map(|(torque, shift)| {
        every_tenth(torque, shift).iter().map(|tau| tau + NOISE_NM * random.normal()).collect()
    });
    let torque = torque.collect();
    let mut options = options(80.0, 0.8, 10);
    // A random arm on a random motion: the model is judged, not the motion.
    options.limits.condition_number = 1e6;
    let [position, velocity, _] = motion.matrices().each_ref().map(columns);
    Bench { arm, position, velocity, torque, options }
}

fn bench(seed: u64) -> Bench {
    bench_with_delays(seed, [0; 3])
}

impl Bench {
    fn identify(&self) -> Estimate {
        let signals = signals(RATE_HZ, self.position.clone(), self.torque.clone());
        let experiment = Experiment::joint_side(&signals).unwrap();
        let experiment = experiment.with_counted(100..SAMPLES - 100).unwrap();
        identify(Method::IdimLs, &self.arm.robot, &self.arm.base, &experiment, &self.options)
            .unwrap()
            .estimate
    }
}

/// Returns the findings about configured values that the data contradict, with their subjects.
fn contradicted(estimate: &Estimate) -> Vec<(FindingCode, Option<Subject>)> {
    use FindingCode::{Geometry, KnownTorque, TorqueDelay, TorqueGain};

    let findings = estimate.verdict.findings().into_iter();
    findings
        .filter(|of| [TorqueGain, TorqueDelay, KnownTorque, Geometry].contains(&of.code))
        .map(|of| (of.code, of.subject))
        .collect()
}

/// What the data want most, and by how much of a joint's torque.
fn most_wanted(estimate: &Estimate) -> (NuisanceParameter, f64) {
    (estimate.nuisance_parameters[0].nuisance, estimate.nuisance_parameters[0].relative_torque)
}

#[test]
fn a_right_model_passes() {
    let (mut parameters, mut covered) = (0, 0);
    for seed in 0..40 {
        let bench = bench(seed);
        let estimate = bench.identify();
        assert_eq!(contradicted(&estimate), [], "seed {seed}");
        let monitoring = &estimate.verdict.uses.monitoring;
        assert_eq!(monitoring.applicable, Some(true), "seed {seed}: {:?}", monitoring.reasons);
        let (nuisance, torque) = most_wanted(&estimate);
        assert!(torque < 0.02, "seed {seed}: {nuisance} {torque}");
        for (parameter, truth) in estimate.parameters.iter().zip(bench.arm.true_base()) {
            assert!(parameter.combined_standard_deviation >= parameter.standard_deviation);
            parameters += 1;
            let off = (parameter.value - truth).abs();
            covered += usize::from(off <= 2.0 * parameter.combined_standard_deviation);
        }
    }
    assert!(parameters > 800 && covered >= parameters * 97 / 100, "{covered} of {parameters}");
}

/// Friction of so many standard deviations below zero is a reason from three on.
#[test]
fn friction_is_negative_beyond_three_standard_deviations() {
    let estimate_of = |value: f64| bench_of(0, [0; 3], &[("fv1", value)]).identify();
    let fv1 = |of: &Estimate| of.parameters.iter().find(|p| p.name == "fv1").unwrap().clone();
    let at_zero = fv1(&estimate_of(0.0));
    for (deviations, expected) in [(1.5, false), (4.5, true)] {
        let value = -at_zero.value - deviations * at_zero.combined_standard_deviation;
        let estimate = estimate_of(value);
        let found = estimate.verdict.uses.physical_values.reasons.iter();
        let is_negative =
            |of: &Reason| matches!(of, Reason::Negative { name, .. } if name == "fv1");
        let (value, sigma) = (fv1(&estimate).value, fv1(&estimate).combined_standard_deviation);
        assert_eq!(found.filter(|of| is_negative(of)).count() == 1, expected, "{}", value / sigma);
    }
}

/// A drive inertia that takes the mass matrix below zero: the posture that shows it is one that the
/// arm can take.
#[test]
fn an_indefinite_mass_matrix_is_shown_in_a_posture_of_the_arm() {
    let bench = bench_of(0, [0; 3], &[("ia2", -5.0)]);
    let estimate = bench.identify();
    let reasons = &estimate.verdict.uses.rigid_body.reasons;
    let posture = reasons.iter().find_map(|reason| match reason {
        Reason::Indefinite { posture, .. } => Some(posture),
        _ => None,
    });
    let posture = posture.unwrap_or_else(|| panic!("{reasons:?}"));
    let inside = bench.arm.robot.limits().zip(posture);
    let outside = inside.filter(|(limit, q)| **q < limit.position_min || **q > limit.position_max);
    assert_eq!(outside.count(), 0, "{posture:?}");
}

/// Delays of parts of a sample, later and earlier. The root mean square of 60 deviations has a
/// standard error of 0.09, more because those of one arm are correlated.
#[test]
fn a_torque_delay_is_estimated_per_joint_with_its_deviation() {
    let mut squares = 0.0;
    for seed in 0..20 {
        let tenths = [3, 0, -6];
        let estimate = bench_with_delays(seed, tenths).identify();
        for (delay, tenths) in estimate.torque_delay_per_joint.iter().zip(tenths) {
            let delay = delay.unwrap();
            let truth = tenths as f64 / (RATE_HZ * FINE as f64);
            squares += ((delay.delay_s - truth) / delay.standard_deviation_s).powi(2) / 60.0;
            assert!(delay.standard_deviation_s < 0.5 / RATE_HZ, "{delay:?}");
        }
    }
    let rms = f64::sqrt(squares);
    assert!((0.7..1.3).contains(&rms), "{rms}");
}

/// What is estimated is what is missing in the timing: stated in addition, it is gone.
#[test]
fn the_estimated_delay_belongs_to_the_stated_one() {
    let bench = bench_with_delays(3, [7, 7, 7]);
    let signals = signals(RATE_HZ, bench.position.clone(), bench.torque.clone());
    let experiment = Experiment::joint_side(&signals).unwrap();
    let experiment = experiment.with_counted(100..SAMPLES - 100).unwrap();
    let identify = |delay_s: f64| -> f64 {
        let timing = SignalTiming { hold_s: 0.0, delay_s };
        let experiment = experiment.clone().with_torque_timing(timing).unwrap();
        let robot = &bench.arm.robot;
        let identified =
            identify(Method::IdimLs, robot, &bench.arm.base, &experiment, &bench.options).unwrap();
        let delays = identified.estimate.torque_delay_per_joint.into_iter().flatten();
        delays.map(|delay| delay.delay_s).sum::<f64>() / 3.0
    };
    let missing = identify(0.0);
    let truth = 7.0 / (RATE_HZ * FINE as f64);
    assert!((missing / truth - 1.0).abs() < 0.2, "{missing} instead of {truth}");
    assert!(identify(missing).abs() < 0.1 * truth, "{}", identify(missing));
}

/// The check that fails is the one of the error that was made, and it tells its size.
#[test]
fn a_late_torque_is_named() {
    let estimate = bench_with_delays(1, [20, 20, 20]).identify();
    let contradictions = contradicted(&estimate);
    assert!(
        matches!(contradictions.first(), Some((FindingCode::TorqueDelay, _))),
        "{contradictions:?}"
    );
}

#[test]
fn a_friction_law_that_is_not_the_model_s_is_named_with_its_joint() {
    for joint in 0..3 {
        let mut bench = bench(10 + joint as u64);
        // Stribeck: twice the Coulomb friction where the joint hardly moves.
        let fc = bench.arm.true_base()[bench.arm.base.find(&format!("fc{}", joint + 1)).unwrap()];
        for (tau, v) in bench.torque[joint].iter_mut().zip(&bench.velocity[joint]) {
            *tau += fc * (-(v / 0.5).powi(2)).exp() * (v / 0.05).tanh();
        }
        let estimate = bench.identify();
        let (nuisance, torque) = most_wanted(&estimate);
        // Motor 3 is also geared to joint 2.
        let expected = [
            NuisanceParameter::JointFriction(JointIndex::new(joint)),
            NuisanceParameter::MotorFriction(MotorIndex::new(2)),
        ];
        let named = &expected[..if joint == 0 { 1 } else { 2 }];
        assert!(named.contains(&nuisance), "{joint}: {nuisance} {torque}");
    }
}

/// A factor on one torque shows against the others; a factor on all of them is in every parameter,
/// and no data can show it.
#[test]
fn a_gain_is_reported_against_the_others_only() {
    let mut scaled_one = bench(20);
    scaled_one.torque[1].iter_mut().for_each(|tau| *tau *= 1.05);
    let estimate = scaled_one.identify();
    let second = Some(Subject::Joints(vec![JointIndex::new(1)]));
    assert!(
        contradicted(&estimate).contains(&(FindingCode::TorqueGain, second)),
        "{:?}",
        estimate.nuisance_parameters
    );

    let mut scaled_all = bench(20);
    scaled_all.torque.iter_mut().flatten().for_each(|tau| *tau *= 1.05);
    let (scaled, right) = (scaled_all.identify(), bench(20).identify());
    assert_eq!(contradicted(&scaled), []);
    for (scaled, right) in scaled.parameters.iter().zip(&right.parameters) {
        assert!((scaled.value - 1.05 * right.value).abs() <= 1e-9 * right.value.abs());
    }
}

#[test]
fn a_parameter_that_is_left_out_is_missed() {
    let mut bench = bench(30);
    let names = bench.arm.base.names().to_vec();
    bench.options.parameters = Some(names.iter().filter(|n| *n != "fv2").cloned().collect());
    let estimate = bench.identify();
    assert_eq!(most_wanted(&estimate).0, NuisanceParameter::LeftOutParameters);
}

/// A filter so narrow that it changes the motion, and one that does not.
#[test]
fn a_position_filter_that_is_too_narrow_is_named() {
    for (cutoff_hz, expected) in [(4.0, true), (40.0, false)] {
        let mut bench = bench(40);
        bench.options.position_filter.cutoff_hz = cutoff_hz;
        let estimate = bench.identify();
        let notes = &estimate.verdict.notes;
        let named = |note: &Note| matches!(note, Note::PositionBias { bias } if bias.by_filter);
        assert_eq!(notes.iter().any(named), expected, "{cutoff_hz} Hz: {notes:?}");
        let of_the_bias = estimate.position_bias.as_ref().unwrap();
        let parameter =
            estimate.parameters.iter().find(|p| p.name == of_the_bias.parameter).unwrap();
        let bias = of_the_bias.deviations.abs() * parameter.standard_deviation;
        assert!(parameter.combined_standard_deviation >= bias, "{of_the_bias:?} {parameter:?}");
    }
}

/// A window so short that σ is no small part of the parameters: the torque that they predict is
/// uncertain, and the verdict says of which joint.
#[test]
fn a_window_that_shows_too_little_is_named() {
    let mut bench = bench(50);
    let mut random = Random(50);
    for torque in &mut bench.torque {
        torque.iter_mut().for_each(|tau| *tau += 100.0 * random.normal());
    }
    bench.options.limits.relative_error = 1.0;
    bench.options.limits.relative_error_per_joint = 1.0;
    let estimate = bench.identify();
    let largest =
        estimate.relative_prediction_deviation_per_joint.iter().copied().fold(0.0, f64::max);
    let has_reason = (estimate.verdict.reasons.iter())
        .any(|reason| matches!(reason, Reason::PredictionDeviation { .. }));
    assert_eq!(has_reason, largest > 0.1, "{largest}: {:?}", estimate.verdict.reasons);
    assert!(has_reason, "{:?}", estimate.relative_prediction_deviation_per_joint);
}
