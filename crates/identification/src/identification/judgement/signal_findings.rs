//! Findings about recorded signals: clipped, constant, frozen, without a sign.

use didim_dynamics::robot::MotorIndex;

use super::clipped_signal::ClippedSignal;
use super::frozen_signal::FrozenSignal;
use super::reasons::{Note, Reason};
use super::verdict::UNEXPLAINED;
use crate::identification::problem::Context;

/// Findings about the signals of a record.
pub(super) struct SignalFindings {
    /// Signals that were not measured, which make a result useless.
    pub(super) blocking: Vec<Reason>,
    /// Frozen signals that may explain a large error.
    pub(super) frozen: Vec<Reason>,
    /// Clipped torques that may explain a large error.
    pub(super) clipped: Vec<Reason>,
    /// Findings about signals whose errors are small.
    pub(super) notes: Vec<Note>,
}

impl SignalFindings {
    /// Searches the record. `unsigned` are the motors whose torque has no sign, and `errors` the
    /// relative error of each joint.
    pub(super) fn new(context: &Context<'_>, unsigned: Vec<MotorIndex>, errors: &[f64]) -> Self {
        let transmission = context.robot.transmission();
        // The error of a joint may follow from the signals of its motors.
        let is_unexplained = |motor: MotorIndex| {
            let mut joints = errors.iter().zip(transmission.row(motor.position()));
            joints.any(|(error, ratio)| *error > UNEXPLAINED && *ratio != 0.0)
        };
        let (constant, clipped): (Vec<_>, Vec<_>) =
            ClippedSignal::all(context).into_iter().partition(ClippedSignal::is_constant);
        let (clipped, hardly_clipped): (Vec<_>, Vec<_>) =
            clipped.into_iter().partition(|found| is_unexplained(found.motor));
        let (frozen, hardly_frozen): (Vec<_>, Vec<_>) =
            FrozenSignal::all(context).into_iter().partition(|found| {
                found.is_much() && found.motors.iter().any(|motor| is_unexplained(*motor))
            });
        let unsigned =
            (!unsigned.is_empty()).then_some(Reason::UnsignedTorque { motors: unsigned });
        let clipped_torque = |found| Reason::ClippedTorque { found };
        let mut notes: Vec<Note> =
            hardly_clipped.into_iter().map(|found| Note::ClippedTorque { found }).collect();
        notes.extend(hardly_frozen.into_iter().map(|found| Note::FrozenSignal { found }));
        Self {
            blocking: unsigned
                .into_iter()
                .chain(constant.into_iter().map(clipped_torque))
                .collect(),
            frozen: frozen.into_iter().map(|found| Reason::FrozenSignal { found }).collect(),
            clipped: clipped.into_iter().map(clipped_torque).collect(),
            notes,
        }
    }
}
