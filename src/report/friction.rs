//! The friction laws that the data chose, as a table for people and lines for the robot file.

use didim_dynamics::robot::JointIndex;
use didim_identification::identification::{ChosenFriction, FrictionChange, FrictionScore};

use super::percent_text;
use crate::cell::Cell;
use crate::text::align_table;

/// Formats the chosen changes with their gain, and the lines for the files of the cell. `cell`
/// already has the chosen laws. `added` are the new parameters of these laws, if the cell lists its
/// parameters.
pub fn friction_text(chosen: &ChosenFriction, cell: &Cell, added: &[String]) -> String {
    let rows: Vec<Vec<String>> = gains_text(chosen).map(Vec::from).collect();
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
pub(super) fn gains_text(chosen: &ChosenFriction) -> impl Iterator<Item = [String; 4]> {
    chosen.gains.iter().map(|gain| {
        let change = match gain.change {
            FrictionChange::Sign(sign) => format!("sign = {sign}"),
            FrictionChange::Law(law) => law.to_string(),
        };
        let [before, after] = gain.held_out.map(percent_text);
        [gain.joint.to_string(), change, before, after]
    })
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
