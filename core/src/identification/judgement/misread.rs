//! What is taken for something else: the model fits far better with the signals of two drives exchanged, or with gravity from
//! another side.

use nalgebra::DVector;

use super::glance::Glance;
use super::reasons::{Note, Reason};
use super::refitted::{LOOKED_AT, Refitted};
use super::verdict::UNEXPLAINED;
use crate::identification::given::Context;
use crate::identification::observation::Motion;

/// What it leaves at most of the squares that are left as stated, to speak for it.
const LEAVES: f64 = 0.5;

/// What an exchange leaves at most of them to be told, of real arms none left less than 0.9.
const TOLD: f64 = 0.8;

/// What an exchange leaves at most of them at a glance, to be looked at.
const LIKELY: f64 = 0.8;

/// A motor that goes no further has nothing that could be another's \[rad or m\].
const MOVES: f64 = 0.01;

/// The share of the torques, in squares, that a model leaves at most with gravity from where it comes; and that it leaves at least as
/// stated, where parameters that only another direction shows are to speak for that.
const LEFT: f64 = 0.01;

/// What speaks for it.
pub(super) enum Misread {
    /// So much that the result is good for nothing.
    For(Reason),
    /// A little.
    Perhaps(Note),
}

/// What fits far better, where one joint at least is not explained: two motors exchanged of which one drives the joint that leaves most of
/// its torque, or gravity along another axis of the base. `errors` are the relative errors of all joints; of rows that no filter has
/// passed, noise is most of what is left. `measured` are the torques of the rows that are fitted along a motion (r).
pub(super) fn misread(
    context: &Context<'_>,
    motion: &Motion,
    measured: &DVector<f64>,
    errors: &[f64],
) -> Option<Misread> {
    let worst = (0..errors.len()).max_by(|&a, &b| errors[a].total_cmp(&errors[b]));
    let is_asked = |worst: &usize| errors[*worst] > UNEXPLAINED && !context.decimation.is_none();
    let worst = worst.filter(is_asked)?;
    let glance = Glance::along(context, motion, measured);
    exchanged(context, &glance, worst).or_else(|| gravity(context, &glance).map(Misread::For))
}

/// Two motors, one of which drives the joint that leaves most.
fn exchanged(context: &Context<'_>, glance: &Glance, worst: usize) -> Option<Misread> {
    let (columns, transmission) = (context.selection.columns(), context.robot.transmission());
    let as_stated = glance.left(context, columns)?.of_joints;
    let ranges = glance.ranges(transmission);
    let is_asked = |motors: &[usize; 2]| {
        motors.iter().all(|motor| ranges[*motor] > MOVES)
            && motors.iter().any(|motor| transmission.row(*motor)[worst] != 0.0)
    };
    let all = 0..ranges.len();
    let pairs = all.flat_map(|other| (0..other).map(move |one| [one, other])).filter(is_asked);
    // Where they have no solution, they do not fit better.
    let likely = pairs.filter_map(|motors| {
        let exchanged = glance.with_exchanged_motors(transmission, motors);
        Some((exchanged.left(context, columns)?.of_joints / as_stated, motors))
    });
    let (left, motors) = likely.min_by(|(one, _), (other, _)| one.total_cmp(other))?;
    let stated = (left < LIKELY).then(|| context.experiment.beginning(LOOKED_AT))?;
    let exchanged = stated.with_exchanged_motors(transmission, motors);
    let [stated, exchanged] =
        [&stated, &exchanged].map(|of| Some(Refitted::new(context, of).ok()?.left));
    let (left, motors) = (exchanged? / stated?, motors.map(|motor| motor + 1));
    if left < LEAVES {
        return Some(Misread::For(Reason::Exchanged { motors }));
    }
    (left < TOLD).then_some(Misread::Perhaps(Note::Exchanged { motors, left }))
}

/// Another direction of gravity.
fn gravity(context: &Context<'_>, glance: &Glance) -> Option<Reason> {
    let columns = columns(context);
    let as_stated = glance.left(context, &columns)?.of_all;
    let stated = context.robot.gravity_m_s2();
    let others = other_directions(stated).filter_map(|gravity_m_s2| {
        let model = context.model.clone().with_gravity(gravity_m_s2);
        let left = glance.left(&context.with_model(model), &columns)?.of_all;
        Some((left, gravity_m_s2))
    });
    let (left, gravity_m_s2) = others.min_by(|(one, _), (other, _)| one.total_cmp(other))?;
    // The opposite one shows no others.
    let is_opposite = cosine(stated, gravity_m_s2) < -0.9;
    let is_better = left < LEFT.min(LEAVES * as_stated) && (is_opposite || as_stated > LEFT);
    is_better.then_some(Reason::Gravity { gravity_m_s2 })
}

/// Those that are identified, and those that nothing shows, which gravity from another side may.
fn columns(context: &Context<'_>) -> Vec<usize> {
    let find = |name: &String| context.robot.parameters().find(name);
    let hidden = context.base.without_effect().iter().filter_map(find);
    context.selection.columns().iter().copied().chain(hidden).collect()
}

/// Gravity of the same size along every axis of the base, either way, but for that which is stated.
fn other_directions(stated: [f64; 3]) -> impl Iterator<Item = [f64; 3]> {
    let size = stated.iter().map(|own| own * own).sum::<f64>().sqrt();
    let along = move |axis: usize, sign: f64| {
        let mut gravity = [0.0; 3];
        gravity[axis] = sign * size;
        gravity
    };
    let all = (0..3).flat_map(move |axis| [along(axis, 1.0), along(axis, -1.0)]);
    // Nearly the same is no other.
    all.filter(move |other| cosine(stated, *other) < 0.9)
}

/// Of the angle between two vectors.
fn cosine(one: [f64; 3], other: [f64; 3]) -> f64 {
    let with = |a: [f64; 3], b: [f64; 3]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    with(one, other) / (with(one, one) * with(other, other)).sqrt()
}
