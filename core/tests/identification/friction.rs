//! Friction laws that the data choose: those that the arm has, and none that it has not.

use didim_core::identification::{
    ChosenFriction, Experiment, Method, Options, choose_friction, identify,
};
use didim_core::robot::{FrictionLaw, SignModel};

use crate::common::arm::{Arm, Random, options, signals};

const RATE_HZ: f64 = 400.0;
const SAMPLES: usize = 6000;
/// Noise of each torque \[N·m\].
const NOISE_NM: f64 = 0.2;

/// An arm on a random motion: as it is, as its robot file has it, and what was recorded.
struct Bench {
    arm: Arm,
    stated: Arm,
    experiment: Experiment,
    options: Options,
}

fn bench(seed: u64, has_laws: bool) -> Bench {
    let mut random = Random(seed);
    let stated = Arm::random(&mut random, 3);
    let mut arm = Arm::random(&mut Random(seed), 3);
    if has_laws {
        arm = arm.with_friction_laws(&mut random);
    }
    let motion = arm.motion(&mut random, SAMPLES, RATE_HZ, 2.0);
    let torque = arm.torques(&motion).into_iter();
    let torque = torque
        .map(|torque| torque.iter().map(|tau| tau + NOISE_NM * random.normal()).collect())
        .collect();
    let position = motion.position.column_iter().map(|q| q.iter().copied().collect()).collect();
    let experiment = Experiment::joint_side(signals(RATE_HZ, position, torque)).unwrap();
    let experiment = experiment.with_counted(100..SAMPLES - 100).unwrap();
    let mut options = options(80.0, 0.8, 10);
    // A random arm on a random motion: the laws are judged, not the motion.
    options.limits.condition_number = 1e6;
    Bench { arm, stated, experiment, options }
}

impl Bench {
    fn choose(&self) -> (ChosenFriction, usize) {
        let mut tried = 0;
        let (robot, base) = (&self.stated.robot, &self.stated.base);
        let chosen =
            choose_friction(robot, base, &self.experiment, &self.options, || tried += 1).unwrap();
        (chosen, tried)
    }

    /// Relative error of pieces that were held out, with the arm's own laws.
    fn held_out(&self) -> f64 {
        let (robot, base) = (&self.arm.robot, &self.arm.base);
        let found = identify(Method::IdimLs, robot, base, &self.experiment, &self.options).unwrap();
        found.estimate.held_out.relative_error.unwrap()
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
        assert!(chosen.after.elsewhere <= chosen.before.elsewhere + 0.001 * chosen.trials as f64);
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
        assert_eq!(chosen.friction, bench.stated.robot.own_friction());
        assert_eq!(chosen.before, chosen.after);
    }
}
