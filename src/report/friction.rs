//! The friction laws that the data chose, as a table for people and lines for the robot file.

use didim_core::identification::{ChosenFriction, FrictionChange, FrictionScore};

use crate::text::{aligned, significant};

/// What was changed and what each change gained, and the laws as the robot file states them.
pub fn choice(chosen: &ChosenFriction) -> String {
    let rows: Vec<Vec<String>> = gains(chosen).map(Vec::from).collect();
    let mut text = if rows.is_empty() {
        "no other friction law predicts better than those of the robot file\n".to_owned()
    } else {
        aligned(&["joint", "friction", "held-out error", "with it"], &rows)
    };
    text += &format!("{}\n", effect(chosen));
    if !rows.is_empty() {
        text += "\nin the robot file, of these [[joint]]s:\n";
        let changed = |joint: &usize| chosen.gains.iter().any(|gain| gain.joint == *joint);
        for (joint, friction) in (1..).zip(&chosen.friction).filter(|(joint, _)| changed(joint)) {
            text += &format!("friction = {friction} # {joint}\n");
        }
    }
    text
}

/// Joint, change, the joint's held-out error before and after.
pub(super) fn gains(chosen: &ChosenFriction) -> impl Iterator<Item = [String; 4]> {
    chosen.gains.iter().map(|gain| {
        let change = match gain.change {
            FrictionChange::Sign(sign) => format!("sign = {sign}"),
            FrictionChange::Law(law) => law.to_string(),
        };
        let [before, after] = gain.held_out.map(percent);
        [gain.joint.to_string(), change, before, after]
    })
}

/// What all of it did, in a sentence.
pub(super) fn effect(chosen: &ChosenFriction) -> String {
    let of = |score: fn(&FrictionScore) -> f64| {
        format!("{} → {}", percent(score(&chosen.before)), percent(score(&chosen.after)))
    };
    format!(
        "friction laws chosen in {} identifications: held-out error {}, uncertainty elsewhere {}",
        chosen.trials,
        of(|score| score.held_out),
        of(|score| score.elsewhere)
    )
}

fn percent(share: f64) -> String {
    format!("{} %", significant(100.0 * share, 3))
}
