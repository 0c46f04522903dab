//! `[data]` of a table: which columns, in which unit.

use std::path::PathBuf;

use didim_formats::{AxisColumns, Columns, Side, TableError, TableNames, read_rows};

use super::draft::Draft;
use super::evidence::{Evidence, ProposalError};
use super::names::{Group, Meaning, counted_otherwise, groups, meaning, unit, words};
use super::plausible::{Look, torque_valid};
use super::time::Time;
use super::value::{Guess, WHICH_POSITION, WHICH_SIDE, WHICH_SIGN, WHICH_TORQUE, list, quoted};
use crate::cell::{CURRENTS, OPEN};

const SECTION: &str = "data";
/// Words at the end of a name that say its unit.
const TURNS: &[(&str, &str)] = &[
    ("rad", "rad"),
    ("deg", "deg"),
    ("degree", "deg"),
    ("degrees", "deg"),
    ("°", "deg"),
    ("mm", "mm"),
];
const TORQUES: &[(&str, &str)] = &[
    ("nm", "Nm"),
    ("mnm", "mNm"),
    ("a", "A"),
    ("ma", "mA"),
    ("amp", "A"),
    ("ampere", "A"),
    ("n", "N"),
];
/// Names that say what was measured, where there are several of a kind.
const MEASURED: &[&str] = &["actual", "measured", "meas", "act", "fbk", "feedback", "ist", "msr"];

pub(super) fn propose(
    draft: &mut Draft<'_>,
    evidence: &Evidence,
    (file, names): &(PathBuf, TableNames),
) -> Result<(), ProposalError> {
    let joints: Vec<String> = evidence.robot.joint_names().map(str::to_owned).collect();
    let table = Table { file, names, robot: &evidence.robot.robot, joints };
    table.propose(draft)
}

struct Table<'a> {
    file: &'a PathBuf,
    names: &'a TableNames,
    robot: &'a didim_core::robot::Robot,
    joints: Vec<String>,
}

impl Table<'_> {
    fn propose(&self, draft: &mut Draft<'_>) -> Result<(), ProposalError> {
        let time = Time::find(draft, self.file, self.names)?;
        let rate_hz = match &time {
            Some(Time { rate_hz: Some(rate_hz), is_stated, .. }) => {
                let guess = if *is_stated { Guess::found } else { Guess::assumed };
                guess(format!("{rate_hz:?}"), "the mean distance of the times")
            }
            Some(_) => Guess::open("samples a second; the unit of the time tells it"),
            None => Guess::open("samples a second; the table has no times"),
        };
        draft.put(SECTION, "rate_hz", rate_hz);
        match self.names.own {
            None => self.of_others(draft, time.as_ref()),
            Some((side, _)) => {
                let side = if side == Side::Joint { "joint" } else { "motor" };
                draft.know("data.side", quoted(side));
                draft.put(SECTION, "torque_valid", torque_valid(false));
                Ok(())
            }
        }
    }

    /// Positions and torques as they stand.
    fn columns(&self, position: &Group, torque: &Group) -> Result<[Vec<Vec<f64>>; 3], TableError> {
        let axes = self.robot.joints();
        let of = |group: &Group| AxisColumns { names: group.names(), scales: vec![1.0; axes] };
        let columns = Columns {
            side: Side::Joint,
            axes,
            time: None,
            position: of(position),
            torque: of(torque),
            reference: None,
        };
        Ok(read_rows(self.file, Some(&columns))?.signals)
    }

    fn of_others(&self, draft: &mut Draft<'_>, time: Option<&Time>) -> Result<(), ProposalError> {
        if let Some(time) = time {
            time.put(draft, SECTION);
        }
        let axes = self.robot.joints();
        if self.names.columns.len() < 2 * axes {
            let (file, columns) = (self.file.clone(), self.names.columns.join(" "));
            return Err(ProposalError::NoTable { file, columns, axes });
        }
        let groups = groups(&self.names.columns, axes, &self.joints);
        let otherwise = counted_otherwise(&self.names.columns, axes);
        let position = chosen(&groups, Meaning::Position);
        let (torque, is_command) = torques(&groups);
        draft.put(SECTION, "torque_valid", torque_valid(is_command));
        let hint = |which: String| match otherwise.is_empty() {
            true => which,
            false => format!("{which}; of {axes} joints there are {}", otherwise.join(", ")),
        };
        let (position, torque) = (position.map_err(hint), torque.map_err(hint));
        let (position, torque) =
            (self.answered(draft, "position", position), self.answered(draft, "torque", torque));
        let look = match (&position, &torque) {
            (Ok(position), Ok(torque)) => {
                let [position, torque, _] = self.columns(position, torque)?;
                Some(Look { robot: self.robot, position, torque })
            }
            _ => None,
        };
        let named = position.as_ref().ok().and_then(|group| unit(group.name(), TURNS));
        let position_unit = match (draft.answer("data.position.unit"), &named, &look) {
            (Some(answered), ..) => Guess::found(answered.to_string(), ""),
            (None, Some(Ok(named)), _) => Guess::found(quoted(named), "the columns' names"),
            (None, Some(Err(unknown)), _) => {
                Guess::open(&format!("{WHICH_POSITION}; the columns' names say {unknown}"))
            }
            (None, None, Some(look)) => look.position_unit(),
            (None, None, None) => Guess::open(WHICH_POSITION),
        };
        let in_si = look.as_ref().and_then(|look| look.in_si(&position_unit.value));
        draft.put(SECTION, "side", self.side(&[&position, &torque], look.as_ref(), in_si.as_ref()));
        let of_joints = draft.is("data.side", "joint");
        // Of motors the robot knows no limits, and gravity's torque is another.
        let in_si = in_si.filter(|_| of_joints);
        put_columns(draft, "position", &position);
        let certain = of_joints || matches!(named, Some(Ok(_)));
        let guess = if certain { position_unit } else { Guess::open(WHICH_POSITION) };
        draft.put(SECTION, "position.unit", guess);
        put_columns(draft, "torque", &torque);
        let is_current =
            torque.as_ref().is_ok_and(|group| meaning(group.name()) == Some(Meaning::Current));
        let named = torque.as_ref().ok().and_then(|group| unit(group.name(), TORQUES));
        let of_current = |own: &str| CURRENTS.iter().any(|(unit, _)| *unit == own);
        let newton_metres = match &named {
            Some(Ok(unit)) if !of_current(unit) => {
                Some((*unit, if *unit == "mNm" { 1e3 } else { 1.0 }))
            }
            _ => None,
        };
        let [mut unit, sign] = match &in_si {
            Some(look) => look.torque(newton_metres),
            None => [
                newton_metres.map_or_else(
                    || Guess::open(WHICH_TORQUE),
                    |(unit, _)| Guess::found(quoted(unit), "the columns' names"),
                ),
                Guess::open(WHICH_SIGN),
            ],
        };
        match named {
            Some(Err(unknown)) => {
                unit = Guess::open(&format!("{WHICH_TORQUE}; the columns' names say {unknown}"));
            }
            Some(Ok(own)) if of_current(own) => {
                unit = Guess::found(quoted(own), "the columns' names");
            }
            None if is_current => {
                unit = Guess::assumed(quoted("A"), "the columns are named as currents");
            }
            _ => {}
        }
        draft.put(SECTION, "torque.unit", unit);
        if draft.has_current("data.torque.unit") {
            draft.put(SECTION, "torque.per_ampere", Guess::open("torque of one ampere, on the same side as the positions, for all or a list [N·m/A]"));
        }
        draft.put(SECTION, "torque.sign", sign);
        if let Ok(reference) = chosen(&groups, Meaning::Reference) {
            put_columns(draft, "reference", &Ok(reference));
            let unit = draft.text("data.position.unit").unwrap_or_else(|| OPEN.to_owned());
            let guess = if unit == OPEN {
                Guess::open("the unit of the reference")
            } else {
                Guess::assumed(quoted(&unit), "as of the positions")
            };
            draft.put(SECTION, "reference.unit", guess);
        }
        Ok(())
    }

    /// The columns that were answered, or those found.
    fn answered(
        &self,
        draft: &Draft<'_>,
        what: &str,
        found: Result<Group, String>,
    ) -> Result<Group, String> {
        if let Some(pattern) = draft.answered_text(&format!("data.{what}.column")) {
            return Ok(Group::Numbered(pattern));
        }
        if let Some(names) = draft.answered_texts(&format!("data.{what}.columns")) {
            let (count, axes) = (names.len(), self.robot.joints());
            let wrong = || format!("`columns` has {count} names for {axes} axes");
            return if count == axes { Ok(Group::Named(names)) } else { Err(wrong()) };
        }
        found
    }

    fn side(
        &self,
        groups: &[&Result<Group, String>],
        look: Option<&Look<'_>>,
        in_si: Option<&Look<'_>>,
    ) -> Guess {
        // Both: angles of joints beside currents of motors are common. "joint" says nothing, it numbers axes, of motors too.
        let of_motors = groups.iter().all(|group| {
            let words = group.as_ref().map(|group| words(group.name()));
            words.is_ok_and(|words| words.iter().any(|own| own == "motor"))
        });
        match () {
            () if of_motors => Guess::found(quoted("motor"), "the columns' names"),
            () if in_si.is_some_and(Look::is_of_joints) => {
                Guess::found(quoted("joint"), "gravity of the nominal masses explains the torques")
            }
            () => match look.map(Look::may_be_of_joints) {
                Some(false) => Guess::open(&format!(
                    "{WHICH_SIDE}; some positions are beyond the joints' limits"
                )),
                Some(true) => Guess::open(&format!(
                    "{WHICH_SIDE}; all positions are within the joints' limits"
                )),
                None => Guess::open(WHICH_SIDE),
            },
        }
    }
}

/// The one group of a meaning; that of what was measured where there are several. Else those that there are.
pub(super) fn chosen(groups: &[Group], wanted: Meaning) -> Result<Group, String> {
    let fitting: Vec<&Group> =
        groups.iter().filter(|group| meaning(group.name()) == Some(wanted)).collect();
    let mut of_measured = fitting.iter().filter(|group| is_measured(group.name()));
    match (fitting.as_slice(), of_measured.next(), of_measured.next()) {
        ([one], ..) => Ok((*one).clone()),
        (_, Some(one), None) => Ok((*one).clone()),
        ([], ..) if groups.is_empty() => Err("nothing is there once for each axis".to_owned()),
        ([], ..) => {
            let all: Vec<String> =
                groups.iter().map(|group| format!("`{}`", group.name())).collect();
            Err(format!("once for each axis there are {}", all.join(" ")))
        }
        (several, ..) => {
            let all: Vec<String> =
                several.iter().map(|group| format!("`{}`", group.name())).collect();
            Err(format!("one of {}", all.join(" ")))
        }
    }
}

/// The torques or the currents; what is asked for, where nothing is measured. Whether it is that.
pub(super) fn torques(groups: &[Group]) -> (Result<Group, String>, bool) {
    let is = |wanted: &Meaning| groups.iter().any(|group| meaning(group.name()) == Some(*wanted));
    let wanted = [Meaning::Torque, Meaning::Current, Meaning::Command].into_iter().find(is);
    let found = chosen(groups, wanted.unwrap_or(Meaning::Torque));
    let is_command = wanted == Some(Meaning::Command) && found.is_ok();
    (found, is_command)
}

/// Whether a name says that it was measured.
pub(super) fn is_measured(name: &str) -> bool {
    words(name).iter().any(|word| MEASURED.contains(&word.as_str()))
}

fn put_columns(draft: &mut Draft<'_>, what: &str, group: &Result<Group, String>) {
    let why = "by their names";
    let (key, guess) = match group {
        Ok(Group::Numbered(pattern)) => ("column", Guess::found(quoted(pattern), why)),
        Ok(Group::Named(names)) => {
            let names: Vec<String> = names.iter().map(|name| quoted(name)).collect();
            ("columns", Guess::found(list(&names), why))
        }
        Err(which) => (
            "column",
            Guess::open(&format!(
                "the columns of the {what}, with {{axis}} in place of the number; {which}"
            )),
        ),
    };
    draft.put(SECTION, &format!("{what}.{key}"), guess);
}
