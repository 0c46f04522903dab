//! Which friction terms a sweep tells apart.

use nalgebra::DMatrix;

use super::objective::covariance;
use super::series::Course;
use super::sweep::{Pass, Sweep};
use super::task::Task;
use super::told::{TOLD_HZ, rows};
use crate::MAX_JOINTS;
use crate::dynamics::Workspace;
use crate::robot::{FrictionLaw, ParameterKind, Robot};

/// A singular value of the columns beside friction that is smaller than this part of the largest is rounding.
const ROUNDING: f64 = 1e-9;
/// fc, fv and off.
const USUAL: usize = 3;

/// How well a sweep tells a friction term of a joint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Term {
    /// Which.
    pub kind: ParameterKind,
    /// Standard deviation of its largest torque along the sweep where the joint has it beside the usual terms \[N·m or N\]; nothing
    /// where it acts like those together.
    pub alone: Option<f64>,
    /// The same where the joint has all terms at once; nothing where it acts like those before it together.
    pub beside_all: Option<f64>,
}

/// What a sweep tells of the friction of a joint.
#[derive(Clone, Debug, PartialEq)]
pub struct SweptJoint {
    /// Counted from 0.
    pub joint: usize,
    /// The speed of Stribeck friction that is meant: the third of the joint's, counted from the slowest \[rad/s or m/s\].
    pub stribeck: f64,
    /// The usual terms and all laws.
    pub terms: Vec<Term>,
}

/// What a sweep tells of the friction of each joint that it moves, by the torques of that joint while it moves; of gravity and
/// inertia nothing is taken for known.
pub fn terms(task: &Task, robot: &Robot, sweep: &Sweep) -> Vec<SweptJoint> {
    let mut joints: Vec<usize> = sweep.passes.iter().map(|pass| pass.joint).collect();
    joints.dedup();
    let is_inertia = |column: &&usize| {
        let kind = robot.parameters().parameters()[**column].kind;
        ParameterKind::LINK.contains(&kind) || kind == ParameterKind::Ia
    };
    let columns: Vec<usize> = task.columns.iter().filter(is_inertia).copied().collect();
    let count = columns.len();
    let before = DMatrix::zeros(count, count);
    let moving = vec![true; robot.joints()];
    let duration_s = sweep.duration_s();
    let beside = Task { columns, before, duration_s, moving, ..task.clone() };
    let beside = rows(&beside, sweep);
    joints.into_iter().map(|joint| told(task, robot, sweep, joint, &beside)).collect()
}

fn told(
    task: &Task,
    robot: &Robot,
    sweep: &Sweep,
    joint: usize,
    beside: &DMatrix<f64>,
) -> SweptJoint {
    let n = robot.joints();
    let samples = beside.nrows() / n;
    let speed = |pass: &Pass| (pass.joint == joint).then_some(pass.speed);
    let stribeck = sweep.passes.iter().filter_map(speed).nth(2).unwrap_or(0.0);
    let sign = robot.own_friction()[joint].sign;
    let usual = robot.friction();
    let laws = [
        FrictionLaw::Stribeck { speed_rad_s: stribeck },
        FrictionLaw::Load,
        FrictionLaw::Quadratic,
        FrictionLaw::Asymmetric,
        FrictionLaw::Cubic,
    ];
    let mut kinds =
        Vec::from([ParameterKind::Fc, ParameterKind::Fv, ParameterKind::Off] as [_; USUAL]);
    let has = |law: &FrictionLaw| match law {
        FrictionLaw::Stribeck { .. } => usual.coulomb,
        FrictionLaw::Load => usual.coulomb && task.bounds.parameters.is_some(),
        _ => true,
    };
    let laws: Vec<FrictionLaw> = laws.into_iter().filter(has).collect();
    kinds.extend(laws.iter().map(|law| law.kind()));
    // Where this joint moves: the place of the sample, and the terms.
    let mut workspace = Workspace::new();
    let at = |i: usize| {
        let time_s = sweep.duration_s() * i as f64 / samples as f64;
        let state = sweep.state(time_s);
        let v = state.velocity[joint];
        (v != 0.0).then(|| {
            let still = [0.0; MAX_JOINTS];
            let mut torque = [0.0; MAX_JOINTS];
            if let Some(parameters) = &task.bounds.parameters {
                let (q, still) = (&state.position[..n], &still[..n]);
                task.model.inverse_dynamics(
                    &mut workspace,
                    parameters,
                    q,
                    still,
                    still,
                    &mut torque[..n],
                );
            }
            let of_law = |law: &FrictionLaw| match law {
                FrictionLaw::Load => law.value(v, sign) * torque[joint].abs(),
                _ => law.value(v, sign),
            };
            let mut terms = vec![sign.value(v), v, 1.0];
            terms.extend(laws.iter().map(of_law));
            (i * n + joint, terms)
        })
    };
    let moved: Vec<(usize, Vec<f64>)> = (0..samples).filter_map(at).collect();
    let weight = (task.noise.rows_per_s / TOLD_HZ).sqrt() / task.noise.levels[joint];
    let mut friction =
        DMatrix::from_fn(moved.len(), kinds.len(), |row, k| weight * moved[row].1[k]);
    let largest: Vec<f64> = friction.column_iter().map(|of| of.amax() / weight).collect();
    let beside = beside.select_rows(moved.iter().map(|(row, _)| row));
    let lengths: Vec<f64> = beside.column_iter().map(|of| of.norm()).collect();
    let acting: Vec<usize> = (0..lengths.len()).filter(|k| lengths[*k] > 0.0).collect();
    if !acting.is_empty() {
        let mut beside = beside.select_columns(&acting);
        for (mut column, k) in beside.column_iter_mut().zip(&acting) {
            column /= lengths[*k];
        }
        let svd = beside.svd(true, false);
        let least = ROUNDING * svd.singular_values.max();
        let kept: Vec<usize> =
            (0..svd.singular_values.len()).filter(|k| svd.singular_values[*k] > least).collect();
        if let Some(u) = svd.u {
            let u = u.select_columns(&kept);
            friction -= &u * (u.transpose() * &friction);
        }
    }
    let information = friction.transpose() * &friction;
    let of = |own: &[usize]| covariance(&information.select_rows(own).select_columns(own));
    // One after the other: what acts like those before it together is not told.
    let told = |wanted: &[usize]| {
        wanted.iter().fold(Vec::new(), |own, &k| {
            let with: Vec<usize> = own.iter().copied().chain([k]).collect();
            if largest[k] > 0.0 && of(&with).is_some() { with } else { own }
        })
    };
    let deviation = |wanted: &[usize], k: usize| {
        let own = told(wanted);
        let place = own.iter().position(|of| *of == k)?;
        Some(of(&own)?[(place, place)].sqrt() * largest[k])
    };
    let all: Vec<usize> = (0..kinds.len()).collect();
    let term = |k: usize| {
        let beside: Vec<usize> = (0..USUAL).filter(|usual| *usual != k).chain([k]).collect();
        Term { kind: kinds[k], alone: deviation(&beside, k), beside_all: deviation(&all, k) }
    };
    SweptJoint { joint, stribeck, terms: all.iter().map(|k| term(*k)).collect() }
}
