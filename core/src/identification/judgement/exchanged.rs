//! Drives that are taken for each other: the model fits far better with their signals exchanged.

use super::reasons::Reason;
use super::refitted::{LOOKED_AT, Refitted};
use super::verdict::UNEXPLAINED;
use crate::identification::given::Context;

/// What the exchange leaves at most of the squares that are left as stated, to speak for it.
const LEAVES: f64 = 0.5;

/// A motor that goes no further has nothing that could be another's \[rad or m\].
const MOVES: f64 = 0.01;

/// The two motors that fit best in each other's place, of which one drives the joint that leaves most of its torque, where that is much.
/// `errors` are the relative errors of all joints; of rows that no filter has passed, noise is most of what is left.
pub(super) fn exchanged(context: &Context<'_>, errors: &[f64]) -> Option<Reason> {
    let joints = 0..errors.len();
    let worst = joints.clone().max_by(|&a, &b| errors[a].total_cmp(&errors[b]));
    let is_asked = |worst: &usize| errors[*worst] > UNEXPLAINED && !context.decimation.is_none();
    let worst = worst.filter(is_asked)?;
    let (stated, transmission) =
        (context.experiment.beginning(LOOKED_AT), context.robot.transmission());
    let positions = stated.motor_position(transmission);
    let moves: Vec<bool> =
        positions.column_iter().map(|own| own.max() - own.min() > MOVES).collect();
    let asked = |motor: &usize| transmission.row(*motor)[worst] != 0.0;
    let pairs = joints.flat_map(|other| (0..other).map(move |one| [one, other]));
    let pairs = pairs.filter(|[one, other]| moves[*one] && moves[*other]);
    let mut best = (LEAVES * Refitted::new(context, &stated).ok()?.left, None);
    for motors in pairs.filter(|motors| motors.iter().any(asked)) {
        // Where they have no solution, they do not fit better.
        let exchanged = stated.with_exchanged_motors(transmission, motors);
        let Ok(Refitted { left, .. }) = Refitted::new(context, &exchanged) else { continue };
        if left < best.0 {
            best = (left, Some(Reason::Exchanged { motors: motors.map(|motor| motor + 1) }));
        }
    }
    best.1
}
