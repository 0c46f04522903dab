//! What is taken for something else: the model fits far better with the signals of two drives exchanged, or with gravity from
//! another side.

use super::glance::Glance;
use super::reasons::Reason;
use super::refitted::{LOOKED_AT, Refitted};
use super::verdict::UNEXPLAINED;
use crate::identification::given::Context;

/// What it leaves at most of the squares that are left as stated, to speak for it.
const LEAVES: f64 = 0.5;

/// What an exchange leaves at most of them at a glance, to be looked at.
const LIKELY: f64 = 0.8;

/// A motor that goes no further has nothing that could be another's \[rad or m\].
const MOVES: f64 = 0.01;

/// What fits best so, where one joint at least is not explained: two motors of which one drives the joint that leaves most of its torque, or
/// gravity along an axis of the base. `errors` are the relative errors of all joints; of rows that no filter has passed,
/// noise is most of what is left.
pub(super) fn misread(context: &Context<'_>, errors: &[f64]) -> Option<Reason> {
    let joints = 0..errors.len();
    let worst = joints.clone().max_by(|&a, &b| errors[a].total_cmp(&errors[b]));
    let is_asked = |worst: &usize| errors[*worst] > UNEXPLAINED && !context.decimation.is_none();
    let worst = worst.filter(is_asked)?;
    let (stated, transmission) =
        (context.experiment.beginning(LOOKED_AT), context.robot.transmission());
    let glance = Glance::at(context, &stated).ok()?;
    let columns = columns(context);
    let as_stated = glance.left(context, &context.model, &columns)?;

    let positions = stated.motor_position(transmission);
    let moves: Vec<bool> =
        positions.column_iter().map(|own| own.max() - own.min() > MOVES).collect();
    let is_asked = |[one, other]: &[usize; 2]| {
        moves[*one]
            && moves[*other]
            && [*one, *other].iter().any(|motor| transmission.row(*motor)[worst] != 0.0)
    };
    let pairs = joints.flat_map(|other| (0..other).map(move |one| [one, other])).filter(is_asked);
    // Where they have no solution, they do not fit better.
    let likely = pairs.filter_map(|motors| {
        let exchanged = glance.with_exchanged_motors(transmission, motors);
        let left = exchanged.left(context, &context.model, &columns)?;
        Some((left.relative / as_stated.relative, motors))
    });
    let likely = likely.min_by(|(one, _), (other, _)| one.total_cmp(other));
    let exchanged = likely.filter(|(left, _)| *left < LIKELY).and_then(|(_, motors)| {
        let exchanged = stated.with_exchanged_motors(transmission, motors);
        let [stated, exchanged] =
            [&stated, &exchanged].map(|of| Some(Refitted::new(context, of).ok()?.left));
        Some((exchanged? / stated?, Reason::Exchanged { motors: motors.map(|motor| motor + 1) }))
    });
    let others = other_directions(context.robot.gravity_m_s2()).filter_map(|gravity_m_s2| {
        let model = context.model.clone().with_gravity(gravity_m_s2);
        // It acts on the joints with the largest torques.
        let left = glance.left(context, &model, &columns)?;
        Some((left.absolute / as_stated.absolute, Reason::Gravity { gravity_m_s2 }))
    });
    let best =
        exchanged.into_iter().chain(others).min_by(|(one, _), (other, _)| one.total_cmp(other));
    best.filter(|(left, _)| *left < LEAVES).map(|(_, reason)| reason)
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
    all.filter(move |other| {
        let with: f64 = stated.iter().zip(other).map(|(own, other)| own * other).sum();
        with < 0.9 * size * size
    })
}
