//! Friction sweeps, executed: the predicted terms are identifiable, and the others are not.

use didim_dynamics::robot::{FrictionLaw, JointIndex, ParameterKind};
use didim_identification::excitation::{
    Bounds, Course, FrictionTermPrediction, Margins, Noise, SweptJoint, Task, predict_terms, sweep,
};
use didim_identification::identification::{Experiment, Method, Motion, choose_friction, identify};
use nalgebra::DMatrix;

use super::task_within;
use crate::common::arm::{Arm, Random, options, signals};

const RATE_HZ: f64 = 100.0;
const NOISE_NM: f64 = 0.1;
const DURATION_S: f64 = 25.0;

/// The sweep of an arm's only joint, and the predicted deviations of its friction.
fn swept(arm: &Arm) -> (Motion, SweptJoint) {
    let truth = Some(arm.truth.clone());
    let bounds = Bounds::new(&arm.robot, Margins::default(), Some(&[10.0]), truth).unwrap();
    // The rows that are counted have less noise than samples, and are fewer: together they tell as
    // much.
    let noise = Noise { deviations: vec![NOISE_NM], rows_per_s: RATE_HZ };
    let task = Task { noise, ..task_within(&arm.robot, DURATION_S, bounds) };
    let swept = sweep(&task, &[0]).unwrap();
    let swept_joint = predict_terms(&task, &arm.robot, &swept.sweep).remove(0);
    let times = (0..).map(|k| f64::from(k) / RATE_HZ);
    let times = times.take_while(|time_s| *time_s < swept.sweep.duration_s());
    let states: Vec<_> = times.map(|time_s| swept.sweep.state(time_s)).collect();
    let matrix = |of: &dyn Fn(usize) -> f64| DMatrix::from_fn(states.len(), 1, |k, _| of(k));
    let motion = Motion::from_matrices(
        matrix(&|k| states[k].position[0]),
        matrix(&|k| states[k].velocity[0]),
        matrix(&|k| states[k].acceleration[0]),
    );
    (motion, swept_joint)
}

/// The largest torque of a law along a motion, per unit of its coefficient.
fn largest(arm: &Arm, law: FrictionLaw, motion: &Motion) -> f64 {
    let (mut with, column) =
        (arm.truth.clone(), arm.robot.parameters().column(law.kind(), JointIndex::new(0)));
    with[column.unwrap()] += 1.0;
    let [of_arm, of_more] = [&arm.truth, &with].map(|of| arm.torques_of(of, motion).remove(0));
    of_arm.iter().zip(of_more).map(|(own, more)| (more - own).abs()).fold(0.0, f64::max)
}

/// Of 40 recordings of a sweep, identified with the law stated; and the law is the one that the
/// data choose.
#[test]
fn laws_that_a_sweep_shows_are_found_with_the_deviation_that_it_predicts() {
    let plain = Arm::random(&mut Random(70), 1);
    let SweptJoint { stribeck_speed: stribeck, .. } = swept(&plain).1;
    for (law, size) in [
        (FrictionLaw::Load, 0.3),
        (FrictionLaw::Stribeck { speed_rad_s: stribeck }, 0.5),
        (FrictionLaw::Asymmetric, 0.3),
    ] {
        let arm = plain.clone().with_law(0, law, size);
        let (motion, reported) = swept(&arm);
        let term = reported.terms.iter().find(|of| of.kind == law.kind()).unwrap();
        let predicted = term.separate_deviation.unwrap() / largest(&arm, law, &motion);
        let torque = arm.torques(&motion).remove(0);
        let position: Vec<f64> = motion.position.iter().copied().collect();
        let mut random = Random(71);
        let mut recorded = || {
            let torque = torque.iter().map(|tau| tau + NOISE_NM * random.normal()).collect();
            let signals = signals(RATE_HZ, vec![position.clone()], vec![torque]);
            let counted = 20..position.len() - 20;
            Experiment::joint_side(signals).unwrap().with_counted(counted).unwrap()
        };
        let options = options(20.0, 0.8, 4);
        let (mut scatter, mut said) = (0.0, 0.0);
        for _ in 0..40 {
            let identified = identify(Method::IdimLs, &arm.robot, &arm.base, &recorded(), &options);
            let parameters = identified.unwrap().estimate.parameters;
            let parameter =
                parameters.into_iter().find(|own| own.name == format!("{}1", law.kind().symbol()));
            let parameter = parameter.unwrap();
            scatter += (parameter.value - size).powi(2) / 40.0;
            said += parameter.standard_deviation.powi(2) / 40.0;
        }
        for (what, square) in [("scatter", scatter), ("said", said)] {
            let ratio = f64::sqrt(square) / predicted;
            println!("{law:?}: {what} {ratio:.2} times the prediction");
            assert!((1.0 / 1.35..1.35).contains(&ratio), "{law:?}: {what} {ratio}");
        }
        let chosen = choose_friction(&plain.robot, &plain.base, &recorded(), &options, || ());
        let chosen = chosen.unwrap().friction.remove(0).laws;
        assert!(chosen.iter().any(|of| of.kind() == law.kind()), "{law:?}: {chosen:?}");
    }
}

/// The load of a joint that lifts straight up is always its weight, and that of an upright axis
/// nothing: friction by the load is Coulomb friction there, or none.
#[test]
fn what_a_sweep_does_not_show_is_other_friction() {
    for (kind, weight) in [("prismatic", 2.0 * 9.81), ("revolute", 0.0)] {
        let limits = match kind {
            "prismatic" => {
                "position_min_m = -2\nposition_max_m = 2\nvelocity_max_m_s = 2\nforce_max_n = 200"
            }
            _ => {
                "position_min_deg = -150\nposition_max_deg = 150\nvelocity_max_rad_s = \
                2\ntorque_max_nm = 200"
            }
        };
        let arm = Arm::nominal(&format!(
            "name = \"one\"\ngravity_m_s2 = [0, 0, -9.81]\n[[joint]]\ntype = \"{kind}\"\n\
             alpha_deg = 0\nd_m = 0\ntheta_deg = 0\nr_m = 0\ndrive_inertia = true\n{limits}\n\
             [transmission]\nrows = [[1]]\n[friction]\nviscous = true\ncoulomb = true\n\
             offset = true\nload = true\nsign = {{ model = \"tanh\", width_rad_s = 0.01 }}\n\
             [nominal]\nm1 = 2\nxx1 = 0.1\nyy1 = 0.1\nzz1 = 0.1\nia1 = 0.2\nfv1 = 3\nfc1 = 4\nfcl1 \
             = 0.1\n"
        ));
        let (motion, reported) = swept(&arm);
        let is_identifiable = |term: &FrictionTermPrediction| {
            (term.separate_deviation.is_some(), term.joint_deviation.is_some())
        };
        for term in &reported.terms {
            let expected = term.kind != ParameterKind::FcLoad;
            assert_eq!(is_identifiable(term), (expected, expected), "{kind}: {term:?}");
        }
        assert!(reported.terms.iter().any(|term| term.kind == ParameterKind::FcLoad));
        let [fc, fcl] = ["fc1", "fcl1"].map(|name| arm.robot.parameters().find(name).unwrap());
        let mut other = arm.truth.clone();
        (other[fc], other[fcl]) = (4.0 + 0.1 * weight, 0.0);
        let [own, other] = [&arm.truth, &other].map(|of| arm.torques_of(of, &motion).remove(0));
        let most = own.iter().zip(other).map(|(own, other)| (own - other).abs());
        assert!(most.fold(0.0, f64::max) < 1e-9, "{kind}");
    }
}
