//! Misassigned signals and gravity: the model fits far better with the signals of two drives
//! swapped, or with gravity from another side.

use didim_dynamics::robot::MotorIndex;
use nalgebra::DVector;

use super::reasons::{Note, Reason};
use super::refit::{INSPECTED, Refit};
use super::screening_fit::ScreeningFit;
use super::verdict::UNEXPLAINED;
use crate::identification::observation::Motion;
use crate::identification::problem::Context;

/// Largest share of the configured setup's residual squares that a hypothesis may leave to count as
/// found.
const LEAVES: f64 = 0.5;

/// Largest share of them that a swap may leave to be reported. On real arms no swap left less than
/// 0.9.
const LEAST_CERTAINTY: f64 = 0.8;

/// Largest share of them that a swap may leave in the screening fit to be examined.
const LIKELY: f64 = 0.8;

/// Smallest range of a motor whose signals may be another's \[rad or m\].
const MOVES: f64 = 0.01;

/// Largest share of the torques, in squares, that a model leaves with the correct gravity. If only
/// another direction makes some parameters identifiable, the configured direction has to leave at
/// least this share.
const PLOT_LEFT: f64 = 0.01;

/// Strength of the evidence.
pub(super) enum Misassignment {
    /// Strong enough that the result is unusable.
    For(Reason),
    /// A little.
    Perhaps(Note),
}

/// Returns the far better hypothesis, if at least one joint is not explained. Candidates are a swap
/// of two motors and gravity along another axis of the base. One of the swapped motors drives the
/// joint with the largest residual torque. `errors` are the relative errors of all joints. Most of
/// the residual of unfiltered rows is noise. `measured` are the torques of the fitted rows along a
/// motion (r).
pub(super) fn misassignment(
    context: &Context<'_>,
    motion: &Motion,
    measured: &DVector<f64>,
    errors: &[f64],
) -> Option<Misassignment> {
    let recorded = (0..errors.len()).filter(|joint| context.has_torque(*joint));
    let worst = recorded.max_by(|&a, &b| errors[a].total_cmp(&errors[b]));
    let is_asked = |worst: &usize| errors[*worst] > UNEXPLAINED && !context.decimation.is_none();
    let worst = worst.filter(is_asked)?;
    let screening_fit = ScreeningFit::along(context, motion, measured);
    swapped(context, &screening_fit, worst)
        .or_else(|| gravity(context, &screening_fit).map(Misassignment::For))
}

/// Returns two swapped motors, one of which drives the joint with the largest residual.
fn swapped(context: &Context<'_>, glance: &ScreeningFit, worst: usize) -> Option<Misassignment> {
    let (columns, transmission) = (context.selection.columns(), context.robot.transmission());
    let as_stated = glance.remaining(context, columns)?.of_joints;
    let ranges = glance.ranges(transmission);
    let is_asked = |motors: &[usize; 2]| {
        motors.iter().all(|motor| ranges[*motor] > MOVES && context.has_motor_torque(*motor))
            && motors.iter().any(|motor| transmission.row(*motor)[worst] != 0.0)
    };
    let all = 0..ranges.len();
    let pairs = all.flat_map(|other| (0..other).map(move |one| [one, other])).filter(is_asked);
    // A swap without a solution does not fit better.
    let likely = pairs.filter_map(|motors| {
        let exchanged = glance.with_exchanged_motors(transmission, motors);
        Some((exchanged.remaining(context, columns)?.of_joints / as_stated, motors))
    });
    let (left, motors) = likely.min_by(|(one, _), (other, _)| one.total_cmp(other))?;
    let configured = (left < LIKELY).then(|| context.experiment.first_samples(INSPECTED))?;
    let exchanged = configured.with_exchanged_motors(transmission, motors);
    let [stated, exchanged] =
        [&configured, &exchanged].map(|of| Some(Refit::new(context, of).ok()?.remaining));
    let (left, motors) = (exchanged? / stated?, motors.map(MotorIndex::new));
    if left < LEAVES {
        return Some(Misassignment::For(Reason::Swapped { motors }));
    }
    (left < LEAST_CERTAINTY)
        .then_some(Misassignment::Perhaps(Note::PerhapsSwapped { motors, remaining_share: left }))
}

/// Returns another direction of gravity.
fn gravity(context: &Context<'_>, glance: &ScreeningFit) -> Option<Reason> {
    let columns = columns(context);
    let as_stated = glance.remaining(context, &columns)?.of_all;
    let stated = context.robot.gravity_m_s2();
    let others = other_directions(stated).filter_map(|gravity_m_s2| {
        let model = context.model.clone().with_gravity(gravity_m_s2);
        let left = glance.remaining(&context.with_model(model), &columns)?.of_all;
        Some((left, gravity_m_s2))
    });
    let (left, gravity_m_s2) = others.min_by(|(one, _), (other, _)| one.total_cmp(other))?;
    // The opposite direction makes no other parameters identifiable.
    let is_opposite = cosine(stated, gravity_m_s2) < -0.9;
    let is_better =
        left < PLOT_LEFT.min(LEAVES * as_stated) && (is_opposite || as_stated > PLOT_LEFT);
    is_better.then_some(Reason::Gravity { gravity_m_s2, setting: None })
}

/// Returns the identified columns, and the unidentifiable ones that another gravity direction may
/// make identifiable.
fn columns(context: &Context<'_>) -> Vec<usize> {
    let find = |name: &String| context.robot.parameters().find(name);
    let hidden = context.base.without_effect().iter().filter_map(find);
    context.selection.columns().iter().copied().chain(hidden).collect()
}

/// Returns gravity of the same size along every axis of the base, in both senses, except the
/// configured direction.
fn other_directions(stated: [f64; 3]) -> impl Iterator<Item = [f64; 3]> {
    let size = stated.iter().map(|own| own * own).sum::<f64>().sqrt();
    let along = move |axis: usize, sign: f64| {
        let mut gravity = [0.0; 3];
        gravity[axis] = sign * size;
        gravity
    };
    let all = (0..3).flat_map(move |axis| [along(axis, 1.0), along(axis, -1.0)]);
    // A nearly equal direction is no other direction.
    all.filter(move |other| cosine(stated, *other) < 0.9)
}

/// Returns the cosine of the angle between two vectors.
fn cosine(one: [f64; 3], other: [f64; 3]) -> f64 {
    let with = |a: [f64; 3], b: [f64; 3]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    with(one, other) / (with(one, one) * with(other, other)).sqrt()
}
