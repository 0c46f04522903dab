//! The friction laws that the data chose, as a table for people and lines for the robot file.

use didim_dynamics::robot::{FrictionLaw, JointIndex, Robot, SignModel};
use didim_identification::identification::{ChosenFriction, FrictionChange, FrictionScore};

use super::percent_text;
use crate::cell::Cell;
use crate::text::align_table;

/// Formats the chosen changes with their gain, and the lines for the files of the cell. `cell`
/// already has the chosen laws. `added` are the new parameters of these laws, if the cell lists its
/// parameters.
pub fn friction_text(chosen: &ChosenFriction, cell: &Cell, added: &[String]) -> String {
    let rows: Vec<Vec<String>> = gains_text(chosen, &cell.robot).map(Vec::from).collect();
    let mut text = if rows.is_empty() {
        "No other friction law predicts better than the ones of the robot file\n".to_owned()
    } else {
        align_table(&["joint", "friction", "held-out error", "with it"], &rows)
    };
    text += &format!("{}\n", effect_sentence(chosen));
    if !rows.is_empty() {
        text += "\nin the robot file, of these [[joint]]s:\n";
        let changed = |joint: JointIndex| chosen.gains.iter().any(|gain| gain.joint == joint);
        for joint in (0..chosen.friction.len()).map(JointIndex::new) {
            // A sign law of friction in the cell applies to all joints, so unchanged joints need a
            // line as well.
            if cell.overrides_sign || changed(joint) {
                text += &format!("{} # {joint}\n", cell.robot.own_friction_toml(joint.position()));
            }
        }
        if cell.overrides_sign {
            text += "in the cell file: remove `sign` from [identification]\n";
        }
        if !added.is_empty() {
            text += &format!("in the cell file: add to `parameters`: {}\n", added.join(", "));
        }
    }
    text
}

/// Returns the joint, the change, and the joint's held-out error before and after the change, for
/// each change.
pub(super) fn gains_text<'a>(
    chosen: &'a ChosenFriction,
    robot: &'a Robot,
) -> impl Iterator<Item = [String; 4]> + 'a {
    chosen.gains.iter().map(|gain| {
        let change = match gain.change {
            FrictionChange::Sign(sign) => sign_text(sign),
            FrictionChange::Law(law) => law_text(law),
        };
        let [before, after] = gain.held_out.map(percent_text);
        [robot.joint_label(gain.joint), change, before, after]
    })
}

/// Describes the law for the sign of the speed in friction.
pub(super) fn sign_text(sign: SignModel) -> String {
    match sign {
        SignModel::Sign => "sign of the speed".to_owned(),
        SignModel::DeadBand { threshold_rad_s } => {
            format!("sign of the speed from {threshold_rad_s} rad/s on, none below")
        }
        SignModel::Tanh { width_rad_s } => {
            format!("sign of the speed as tanh(speed / {width_rad_s} rad/s)")
        }
    }
}

/// Describes a term of friction beyond viscous and Coulomb friction.
pub(super) fn law_text(law: FrictionLaw) -> String {
    match law {
        FrictionLaw::Quadratic => "viscous friction with the square of the speed".to_owned(),
        FrictionLaw::Cubic => "viscous friction with the cube of the speed".to_owned(),
        FrictionLaw::Asymmetric => "viscous friction that differs by direction".to_owned(),
        FrictionLaw::Load => "Coulomb friction that grows with the load".to_owned(),
        FrictionLaw::Stribeck { speed_rad_s } => {
            format!("Stribeck friction below about {speed_rad_s} rad/s")
        }
        FrictionLaw::Hysteresis { way_rad } => {
            format!("hysteresis over {way_rad} rad after a reversal")
        }
    }
}

/// Summarises the effect of all changes in one sentence.
pub(super) fn effect_sentence(chosen: &ChosenFriction) -> String {
    let change_of = |score: fn(&FrictionScore) -> f64| {
        format!("{} → {}", percent_text(score(&chosen.before)), percent_text(score(&chosen.after)))
    };
    format!(
        "Chosen in {} identifications: held-out error {}, uncertainty outside the motion {}",
        chosen.trials,
        change_of(|score| score.held_out),
        change_of(|score| score.extrapolation)
    )
}
