//! Friction laws that the data choose: those that the arm has, and none that it has not.

use didim_dynamics::robot::{FrictionLaw, ParameterKind, SignModel};
use didim_identification::excitation::{Bounds, Course, Margins, predict_terms, sweep};
use didim_identification::identification::{
    ChosenFriction, Experiment, FrictionChange, Method, Motion, Options, choose_friction,
    filtered_motion, identify,
};
use nalgebra::DMatrix;

use crate::common::arm::{Arm, Random, options, signals};
use crate::excitation::task_within;

const RATE_HZ: f64 = 400.0;
const SAMPLES: usize = 6000;
/// Noise of each torque \[N·m\].
const NOISE_NM: f64 = 0.2;

/// An arm on a random motion: as it is, as its robot file has it, and what was recorded.
struct Bench {
    arm: Arm,
    configured: Arm,
    experiment: Experiment,
    options: Options,
}

fn bench(seed: u64, has_laws: bool) -> Bench {
    let mut random = Random(seed);
    let configured = Arm::random(&mut random, 3);
    let mut arm = Arm::random(&mut Random(seed), 3);
    if has_laws {
        arm = arm.with_friction_laws(&mut random);
    }
    let motion = arm.motion(&mut random, SAMPLES, RATE_HZ, 2.0);
    let experiment = recorded(&arm, &motion, &mut random);
    Bench { arm, configured, experiment, options: options_of_bench() }
}

fn options_of_bench() -> Options {
    let mut options = options(80.0, 0.8, 10);
    // A random arm on a random motion: the laws are judged, not the motion.
    options.limits.condition_number = 1e6;
    options
}

fn recorded(arm: &Arm, motion: &Motion, random: &mut Random) -> Experiment {
    let torque = arm.torques(motion).into_iter();
    let torque = torque
        .map(|torque| torque.iter().map(|tau| tau + NOISE_NM * random.normal()).collect())
        .collect();
    let position = motion.position.column_iter().map(|q| q.iter().copied().collect()).collect();
    let experiment = Experiment::joint_side(signals(RATE_HZ, position, torque)).unwrap();
    experiment.with_counted(100..motion.position.nrows() - 100).unwrap()
}

impl Bench {
    fn choose(&self) -> (ChosenFriction, usize) {
        let mut tried = 0;
        let (robot, base) = (&self.configured.robot, &self.configured.base);
        let chosen =
            choose_friction(robot, base, &self.experiment, &self.options, || tried += 1).unwrap();
        (chosen, tried)
    }

    /// Relative error of pieces that were held out, with the arm's own laws.
    fn held_out(&self) -> f64 {
        let (robot, base) = (&self.arm.robot, &self.arm.base);
        let identified =
            identify(Method::IdimLs, robot, base, &self.experiment, &self.options).unwrap();
        identified.estimate.held_out.relative_error.unwrap()
    }
}

#[test]
fn the_laws_of_the_arm_are_found() {
    for seed in 40..43 {
        let bench = bench(seed, true);
        let (chosen, tried) = bench.choose();
        assert_eq!(tried, chosen.trials);
        let truth = bench.held_out();
        // No worse than with the truth, but for what a shape of three digits costs.
        assert!(chosen.after.held_out < 1.05 * truth, "{seed}: {chosen:?}, {truth}");
        assert!(chosen.before.held_out > 1.5 * truth, "{seed}: {chosen:?}, {truth}");
        assert!(
            chosen.after.extrapolation
                <= chosen.before.extrapolation + 0.001 * chosen.trials as f64
        );
        for (joint, has) in [(0, FrictionLaw::Quadratic), (2, FrictionLaw::Asymmetric)] {
            let laws = &chosen.friction[joint].laws;
            assert!(laws.contains(&has), "{seed}, joint {}: {laws:?}", joint + 1);
        }
        let SignModel::Tanh { width_rad_s } = chosen.friction[0].sign else { panic!("{chosen:?}") };
        assert!((0.15..0.27).contains(&width_rad_s), "{seed}: {width_rad_s} instead of 0.2");
        assert!(chosen.gains.iter().all(|gain| gain.held_out[1] < gain.held_out[0]));
    }
}

#[test]
fn an_arm_without_further_laws_gets_none() {
    for seed in 50..53 {
        let bench = bench(seed, false);
        let (chosen, _) = bench.choose();
        assert_eq!(chosen.gains, [], "{seed}");
        assert_eq!(chosen.friction, bench.configured.robot.own_friction());
        assert_eq!(chosen.before, chosen.after);
    }
}

/// A way that is stated wrong is in the combined uncertainties of what hangs on it.
#[test]
fn a_wrong_way_of_friction_that_slides_is_in_the_uncertainty() {
    const PRESLIDING: f64 = 0.2;
    for (share, is_far) in [(0.3, true), (0.5, false), (2.0, false), (3.0, true)] {
        let mut random = Random(71);
        let plain = Arm::random(&mut random, 3);
        fn arm_with(way_rad: f64, plain: &Arm) -> Arm {
            let law = FrictionLaw::Hysteresis { way_rad };
            (0..3).fold(plain.clone(), |arm, joint| arm.with_law(joint, law, 1.0))
        }
        let (arm, configured) =
            (arm_with(PRESLIDING, &plain), arm_with(share * PRESLIDING, &plain));
        let silent = plain.positions(&mut random, SAMPLES, RATE_HZ, 1.0);
        let silent = Experiment::joint_side(signals(RATE_HZ, silent.clone(), silent)).unwrap();
        let options = options_of_bench();
        let motion = filtered_motion(&arm.robot, &silent, &options.position_filter).unwrap();
        let experiment = recorded(&arm, &motion, &mut random);
        let (robot, base) = (&configured.robot, &configured.base);
        let identified = identify(Method::IdimLs, robot, base, &experiment, &options).unwrap();
        let parameters = identified.estimate.parameters.iter().zip(arm.true_base());
        let [mut within, mut beyond_noise] = [0, 0];
        for (own, truth) in parameters.clone() {
            let off = (own.value - truth).abs();
            within += usize::from(off <= 2.0 * own.combined_standard_deviation);
            beyond_noise += usize::from(off > 4.0 * own.standard_deviation);
        }
        let count = parameters.count();
        assert!(100 * within >= 95 * count, "{share}: {within} of {count}");
        assert!(!is_far || beyond_noise > 0, "{share}: noise alone would do");
        let wanted = &identified.estimate.nuisance_parameters[0];
        assert!(wanted.nuisance.to_string().starts_with("friction law"), "{share}: {wanted:?}");
    }
}

/// The way over which friction turns after a reversal is found from one that is twice as long.
#[test]
fn the_way_of_friction_that_slides_is_refined() {
    const JOINT: usize = 1;
    const PRESLIDING: f64 = 0.2;
    let law = |way_rad| FrictionLaw::Hysteresis { way_rad };
    let mut random = Random(70);
    let plain = Arm::random(&mut random, 3);
    let arm = plain.clone().with_law(JOINT, law(PRESLIDING), 1.0);
    // Half of what this joint has lags.
    let silent = plain.positions(&mut random, SAMPLES, RATE_HZ, 1.0);
    let silent = Experiment::joint_side(signals(RATE_HZ, silent.clone(), silent)).unwrap();
    let options = options_of_bench();
    let motion = filtered_motion(&arm.robot, &silent, &options.position_filter).unwrap();
    let experiment = recorded(&arm, &motion, &mut random);
    fn held_out(arm: &Arm, experiment: &Experiment, options: &Options) -> f64 {
        let identified =
            identify(Method::IdimLs, &arm.robot, &arm.base, experiment, options).unwrap();
        identified.estimate.held_out.relative_error_per_joint[JOINT]
    }
    let configured = plain.clone().with_law(JOINT, law(2.0 * PRESLIDING), 1.0);
    let chosen =
        choose_friction(&configured.robot, &configured.base, &experiment, &options, || {}).unwrap();
    let width_rad = chosen.friction[JOINT].laws.iter().find_map(|law| match law {
        FrictionLaw::Hysteresis { way_rad } => Some(*way_rad),
        _ => None,
    });
    let width_rad = width_rad.unwrap();
    assert!(chosen.gains.iter().any(|gain| gain.change == FrictionChange::Law(law(width_rad))));
    assert_eq!(chosen.friction[JOINT].sign, configured.robot.own_friction()[JOINT].sign);
    assert!(
        (width_rad / PRESLIDING - 1.0).abs() < 0.15,
        "{width_rad} instead of {PRESLIDING}: {chosen:?}"
    );
    let without = choose_friction(&plain.robot, &plain.base, &experiment, &options, || {}).unwrap();
    assert!(
        held_out(&arm, &experiment, &options) < 0.8 * held_out(&plain, &experiment, &options),
        "{} {}",
        held_out(&arm, &experiment, &options),
        held_out(&plain, &experiment, &options)
    );
    assert!(chosen.after.held_out < without.after.held_out, "{chosen:?} {without:?}");
}

/// Constant speeds identify friction that falls as motion begins. A motion that is always fast does
/// not.
#[test]
fn a_sweep_shows_the_law_that_a_fast_motion_hides() {
    const JOINT: usize = 1;
    const SPEED: f64 = 0.15;
    let mut random = Random(60);
    let configured = Arm::random(&mut random, 3);
    let arm = configured.clone().with_law(JOINT, FrictionLaw::Stribeck { speed_rad_s: SPEED }, 0.2);
    let fast = arm.motion(&mut random, SAMPLES, RATE_HZ, 2.0);
    let fast = recorded(&arm, &fast, &mut random);

    let bounds =
        Bounds::new(&configured.robot, Margins::default(), Some(&[10.0; 3]), None).unwrap();
    let task = task_within(&configured.robot, 25.0, bounds);
    let swept = sweep(&task, &[JOINT]).unwrap();
    assert!(swept.used.iter().all(|used| used.used_share <= 1.0), "{:?}", swept.used);
    assert_eq!(swept.sweep.passes.len(), 6);
    let terms_found = predict_terms(&task, &configured.robot, &swept.sweep);
    let stribeck = terms_found[0].terms.iter().find(|of| of.kind == ParameterKind::Fs).unwrap();
    assert!(
        stribeck.separate_deviation.is_some_and(|of| of < 0.3)
            && stribeck.separate_deviation < stribeck.joint_deviation,
        "{terms_found:?}"
    );
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "some seconds")]
    let samples = (swept.sweep.duration_s() * RATE_HZ) as usize;
    assert!(samples as f64 <= 25.0 * RATE_HZ);
    let states: Vec<_> = (0..samples).map(|k| swept.sweep.state(k as f64 / RATE_HZ)).collect();
    let matrix = |of: &dyn Fn(usize, usize) -> f64| DMatrix::from_fn(samples, 3, of);
    let motion = Motion::from_matrices(
        matrix(&|k, joint| states[k].position[joint]),
        matrix(&|k, joint| states[k].velocity[joint]),
        matrix(&|k, joint| states[k].acceleration[joint]),
    );
    let slow = recorded(&arm, &motion, &mut random);

    let options = options_of_bench();
    fn chosen(
        experiment: &Experiment,
        options: &Options,
        configured_robot: &didim_dynamics::robot::Robot,
        configured_base: &didim_dynamics::dynamics::BaseParameters,
    ) -> Vec<Vec<FrictionLaw>> {
        let (robot, base) = (configured_robot, configured_base);
        let chosen = choose_friction(robot, base, experiment, options, || ()).unwrap();
        chosen.friction.into_iter().map(|own| own.laws).collect::<Vec<_>>()
    }
    assert_eq!(chosen(&fast, &options, &configured.robot, &configured.base), [[], [], []]);
    let laws = chosen(
        &Experiment::join(&[fast, slow]).unwrap(),
        &options,
        &configured.robot,
        &configured.base,
    );
    let [FrictionLaw::Stribeck { speed_rad_s }] = laws[JOINT][..] else { panic!("{laws:?}") };
    assert!((speed_rad_s / SPEED - 1.0).abs() < 0.25, "{speed_rad_s} rad/s instead of {SPEED}");
    assert!(laws[0].is_empty() && laws[2].is_empty(), "{laws:?}");
}

/// A gear that locks itself would be none of an arm: what takes more than half of the load is
/// something else.
#[test]
fn friction_takes_no_more_of_the_load_than_a_gear_can() {
    const JOINT: usize = 1;
    for (share, is_taken) in [(0.2, true), (0.9, false)] {
        let mut random = Random(61);
        let configured = Arm::random(&mut random, 3);
        let arm = configured.clone().with_law(JOINT, FrictionLaw::Load, share);
        let motion = arm.motion(&mut random, SAMPLES, RATE_HZ, 2.0);
        let bench = Bench {
            experiment: recorded(&arm, &motion, &mut random),
            arm,
            configured,
            options: options_of_bench(),
        };
        let (chosen, _) = bench.choose();
        let laws = &chosen.friction[JOINT].laws;
        assert_eq!(laws.contains(&FrictionLaw::Load), is_taken, "{share}: {chosen:?}");
    }
}
