//! Friction terms that a constant-speed sweep distinguishes.

use nalgebra::DMatrix;

use super::objective::covariance;
use super::prediction::{PREDICTION_HZ, rows};
use super::series::Course;
use super::sweep::{Sweep, SweepPass};
use super::task::Task;
use didim_dynamics::MAX_JOINTS;
use didim_dynamics::dynamics::Workspace;
use didim_dynamics::robot::{FrictionLaw, FrictionTerms, JointIndex, ParameterKind, Robot};

/// Smallest singular value of the non-friction columns, relative to the largest; smaller ones are
/// rounding errors.
const RANK_TOLERANCE: f64 = 1e-9;
/// Number of usual friction terms: fc, fv and off.
const USUAL_TERMS: usize = 3;

/// Accuracy with which a sweep identifies one friction term of a joint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrictionTermPrediction {
    /// Kind of the parameter.
    pub kind: ParameterKind,
    /// Standard deviation of the largest torque of the term along the sweep \[N·m or N\], if the
    /// joint has this term in addition to the usual ones. `None` if the term cannot be
    /// distinguished from the usual ones.
    pub separate_deviation: Option<f64>,
    /// Standard deviation of the largest torque of the term, if the joint has all terms at once.
    /// `None` if the term cannot be distinguished from the previous terms.
    pub joint_deviation: Option<f64>,
}

/// Friction terms of a joint that a sweep identifies.
#[derive(Clone, Debug, PartialEq)]
pub struct SweptJoint {
    /// The joint.
    pub joint: JointIndex,
    /// Speed of the Stribeck term: the third slowest of the joint's speeds \[rad/s or m/s\].
    pub stribeck_speed: f64,
    /// Usual terms and all further friction laws.
    pub terms: Vec<FrictionTermPrediction>,
}

/// Predicts how accurately a sweep identifies the friction of each joint that it moves. The
/// prediction uses the torques of a joint while this joint moves. Gravity and inertia are treated
/// as unknown.
pub fn predict_terms(task: &Task, robot: &Robot, sweep: &Sweep) -> Vec<SweptJoint> {
    let mut joints: Vec<usize> = sweep.passes.iter().map(|pass| pass.joint.position()).collect();
    joints.dedup();
    let columns: Vec<usize> = task
        .columns
        .iter()
        .filter(|column: &&usize| {
            let kind = robot.parameters().parameters()[**column].kind;
            ParameterKind::LINK.contains(&kind) || kind == ParameterKind::Ia
        })
        .copied()
        .collect();
    let count = columns.len();
    let before = DMatrix::zeros(count, count);
    let moving = vec![true; robot.joints()];
    let duration_s = sweep.duration_s();
    let other_task = Task {
        columns,
        prior_information: before,
        duration_s,
        moving_joints: moving,
        ..task.clone()
    };
    let other_rows = rows(&other_task, sweep);
    joints.into_iter().map(|joint| predict_joint(task, robot, sweep, joint, &other_rows)).collect()
}

fn predict_joint(
    task: &Task,
    robot: &Robot,
    sweep: &Sweep,
    joint: usize,
    auxiliary: &DMatrix<f64>,
) -> SweptJoint {
    let n = robot.joints();
    let samples = auxiliary.nrows() / n;
    let speed = |pass: &SweepPass| (pass.joint == JointIndex::new(joint)).then_some(pass.speed);
    let stribeck = sweep.passes.iter().filter_map(speed).nth(2).unwrap_or(0.0);
    let sign = robot.own_friction()[joint].sign;
    let usual = robot.friction();
    let (kinds, laws) = laws_to_predict(task, stribeck, usual);
    // Row index and friction terms of each sample in which this joint moves.
    let mut workspace = Workspace::new();
    let samples_moving: Vec<(usize, Vec<f64>)> = (0..samples)
        .filter_map(|i: usize| {
            let time_s = sweep.duration_s() * i as f64 / samples as f64;
            let state = sweep.state(time_s);
            let v = state.velocity[joint];
            (v != 0.0).then(|| {
                let still = [0.0; MAX_JOINTS];
                let mut torque = [0.0; MAX_JOINTS];
                if let Some(parameters) = &task.bounds.parameters {
                    let (q, still) = (&state.position[..n], &still[..n]);
                    let (ws, torque) = (&mut workspace, &mut torque[..n]);
                    task.model.inverse_dynamics(ws, parameters, q, still, still, torque);
                }
                let of_law = |law: &FrictionLaw| match law {
                    FrictionLaw::Load => law.value(v, sign) * torque[joint].abs(),
                    _ => law.value(v, sign),
                };
                let mut terms = vec![sign.value(v), v, 1.0];
                terms.extend(laws.iter().map(of_law));
                (i * n + joint, terms)
            })
        })
        .collect();
    let weight = (task.noise.rows_per_s / PREDICTION_HZ).sqrt() / task.noise.deviations[joint];
    let mut friction = DMatrix::from_fn(samples_moving.len(), kinds.len(), |row, k| {
        weight * samples_moving[row].1[k]
    });
    let largest: Vec<f64> = friction.column_iter().map(|of| of.amax() / weight).collect();
    let others = auxiliary.select_rows(samples_moving.iter().map(|(row, _)| row));
    remove_others(&mut friction, &others);
    let information = friction.transpose() * &friction;
    let covariance_of =
        |own: &[usize]| covariance(&information.select_rows(own).select_columns(own));
    // Terms are added one by one. A term is unidentifiable if it is a linear combination of the
    // previous ones.
    let identifiable = |wanted: &[usize]| {
        wanted.iter().fold(Vec::new(), |own, &k| {
            let extended: Vec<usize> = own.iter().copied().chain([k]).collect();
            if largest[k] > 0.0 && covariance_of(&extended).is_some() { extended } else { own }
        })
    };
    let deviation = |wanted: &[usize], k: usize| {
        let chosen = identifiable(wanted);
        let place = chosen.iter().position(|of| *of == k)?;
        Some(covariance_of(&chosen)?[(place, place)].sqrt() * largest[k])
    };
    let indices: Vec<usize> = (0..kinds.len()).collect();
    let term = |k: usize| {
        let others: Vec<usize> = (0..USUAL_TERMS).filter(|usual| *usual != k).chain([k]).collect();
        FrictionTermPrediction {
            kind: kinds[k],
            separate_deviation: deviation(&others, k),
            joint_deviation: deviation(&indices, k),
        }
    };
    SweptJoint {
        joint: JointIndex::new(joint),
        stribeck_speed: stribeck,
        terms: indices.iter().map(|k| term(*k)).collect(),
    }
}

/// Returns the kinds of the friction terms, the usual ones first, and the further laws.
fn laws_to_predict(
    task: &Task,
    stribeck: f64,
    usual: FrictionTerms,
) -> (Vec<ParameterKind>, Vec<FrictionLaw>) {
    let laws = [
        FrictionLaw::Stribeck { speed_rad_s: stribeck },
        FrictionLaw::Load,
        FrictionLaw::Quadratic,
        FrictionLaw::Asymmetric,
        FrictionLaw::Cubic,
    ];
    let mut kinds =
        Vec::from([ParameterKind::Fc, ParameterKind::Fv, ParameterKind::Off] as [_; USUAL_TERMS]);
    let has = |law: &FrictionLaw| match law {
        FrictionLaw::Stribeck { .. } => usual.coulomb,
        FrictionLaw::Load => usual.coulomb && task.bounds.parameters.is_some(),
        _ => true,
    };
    let laws: Vec<FrictionLaw> = laws.into_iter().filter(has).collect();
    kinds.extend(laws.iter().map(|law| law.kind()));
    (kinds, laws)
}

/// Removes the part of the friction columns that the other columns explain.
fn remove_others(friction: &mut DMatrix<f64>, others: &DMatrix<f64>) {
    let lengths: Vec<f64> = others.column_iter().map(|of| of.norm()).collect();
    let acting: Vec<usize> = (0..lengths.len()).filter(|k| lengths[*k] > 0.0).collect();
    if !acting.is_empty() {
        let mut others = others.select_columns(&acting);
        for (mut column, k) in others.column_iter_mut().zip(&acting) {
            column /= lengths[*k];
        }
        let svd = others.svd(true, false);
        let least = RANK_TOLERANCE * svd.singular_values.max();
        let significant: Vec<usize> =
            (0..svd.singular_values.len()).filter(|k| svd.singular_values[*k] > least).collect();
        if let Some(u) = svd.u {
            let u = u.select_columns(&significant);
            *friction -= &u * (u.transpose() * &*friction);
        }
    }
}
