//! Several recordings as one experiment, and the same recording several times.

use didim_identification::identification::{
    Estimate, Experiment, ExperimentError, Method, Options, identify,
};

use crate::common::arm::{Arm, Random, options, signals};

const RATE_HZ: f64 = 400.0;
const SAMPLES: usize = 4000;

/// A random arm, and recordings of it with noise on the torques.
struct Bench {
    arm: Arm,
    recordings: Vec<Experiment>,
    options: Options,
}

fn bench(seed: u64, recordings: usize) -> Bench {
    let mut random = Random(seed);
    let arm = Arm::random(&mut random, 3);
    let recordings = (0..recordings)
        .map(|_| {
            let motion = arm.motion(&mut random, SAMPLES, RATE_HZ, 2.0);
            let mut torques = arm.torques(&motion);
            torques.iter_mut().flatten().for_each(|torque| *torque += 0.5 * random.normal());
            let positions = motion.position.column_iter().map(|q| q.iter().copied().collect());
            let signals = signals(RATE_HZ, positions.collect(), torques);
            let experiment = Experiment::joint_side(&signals).unwrap();
            experiment.with_counted(103..SAMPLES - 100).unwrap()
        })
        .collect();
    let mut options = options(80.0, 0.8, 10);
    options.limits.condition_number = 1e6;
    Bench { arm, recordings, options }
}

impl Bench {
    fn identify(&self, recordings: &[Experiment]) -> Estimate {
        let joined = Experiment::join(recordings).unwrap();
        let (robot, base) = (&self.arm.robot, &self.arm.base);
        identify(Method::IdimLs, robot, base, &joined, &self.options).unwrap().estimate
    }
}

#[test]
fn one_recording_is_itself() {
    let bench = bench(1, 1);
    assert_eq!(Experiment::join(&bench.recordings).unwrap(), bench.recordings[0]);
    assert_eq!(Experiment::join(&[]), Err(ExperimentError::Empty));
}

/// The filters end with each recording: rows and parameters do not depend on what comes before, and
/// recordings together tell more than each by itself.
#[test]
fn recordings_are_independent_rows_of_one_equation() {
    let bench = bench(2, 3);
    let alone: Vec<Estimate> =
        bench.recordings.iter().map(|of| bench.identify(std::slice::from_ref(of))).collect();
    let together = bench.identify(&bench.recordings);
    assert_eq!(together.rows, alone.iter().map(|of| of.rows).sum::<usize>());
    assert_eq!(together.relative_error_per_recording.len(), 3);
    let mut rotated = bench.recordings.clone();
    rotated.rotate_left(1);
    let rotated_recording = bench.identify(&rotated);
    for (k, parameter) in together.parameters.iter().enumerate() {
        let deviation = parameter.standard_deviation;
        assert!((rotated_recording.parameters[k].value - parameter.value).abs() < 1e-6 * deviation);
        assert!(alone.iter().all(|of| of.parameters[k].standard_deviation > deviation));
    }
    let errors = &together.relative_error_per_recording;
    let rotated_recording = &rotated_recording.relative_error_per_recording;
    assert!(
        (0..3).all(|k| (errors[(k + 1) % 3] - rotated_recording[k]).abs() < 1e-9),
        "{errors:?} {rotated_recording:?}"
    );
    // Three recordings are held out each by itself.
    let truth = bench.arm.true_base();
    for (parameter, truth) in together.parameters.iter().zip(truth) {
        let off = (parameter.value - truth).abs();
        assert!(off < 4.0 * parameter.combined_standard_deviation, "{parameter:?} {truth}");
    }
    assert!(together.held_out.relative_error.unwrap() < 1.5 * together.relative_error);
}

/// A recording repeated tells nothing new: neither parameters nor what the result is good for
/// change.
#[test]
fn repeats_make_nothing_better_and_nothing_worse() {
    for seed in [3, 4] {
        let bench = bench(seed, 1);
        let once = bench.identify(&bench.recordings);
        let parts = |times: usize| vec![bench.recordings[0].clone(); times];
        for times in [2, 5] {
            let again = bench.identify(&parts(times));
            let uses = [&once.verdict.uses, &again.verdict.uses];
            for of in didim_identification::identification::Use::ALL {
                let [once, again] = uses.map(|uses| uses.get(of));
                assert_eq!(once.applicable, again.applicable, "{times} times, {of}: {again:?}");
            }
            let extrapolation = [&once, &again].map(|of| of.extrapolation.relative_error);
            assert!(
                (extrapolation[1] / extrapolation[0] - 1.0).abs() < 0.1,
                "{times}: {extrapolation:?}"
            );
            let held_out = [&once, &again].map(|of| of.held_out.relative_error.unwrap());
            assert!((held_out[1] / held_out[0] - 1.0).abs() < 0.1, "{times}: {held_out:?}");
            for (once, again) in once.parameters.iter().zip(&again.parameters) {
                assert!((once.value - again.value).abs() < 1e-6 * once.standard_deviation);
                let [once, again] = [once, again].map(|of| of.combined_standard_deviation);
                assert!((again / once - 1.0).abs() < 0.2, "{times}: {once} {again}");
            }
        }
    }
}

#[test]
fn recordings_that_do_not_go_together_are_refused() {
    let first = &bench(5, 1).recordings[0];
    let positions = vec![vec![0.0; 100]; 3];
    let other = Experiment::joint_side(signals(500.0, positions.clone(), positions)).unwrap();
    let refused = Experiment::join(&[first.clone(), other]).unwrap_err();
    assert_eq!(refused, ExperimentError::Different { recording: 2, what: "sample rate" });
}
