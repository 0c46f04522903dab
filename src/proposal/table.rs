//! `[data]` of a table: which columns, in which unit.

use std::path::PathBuf;

use didim_formats::{AxisColumns, Columns, Side, TableNames, read_rows};

use super::draft::Draft;
use super::evidence::{Evidence, ProposalError};
use super::names::{Group, Meaning, groups, meaning, unit};
use super::plausible::{Look, RATES_HZ, rounded, torque_valid};
use super::value::{Guess, list, quoted};
use crate::cell::OPEN;

const SECTION: &str = "data";
const WHICH_POSITION: &str =
    "the unit: \"rad\" or \"deg\"; of a prismatic joint \"m\" or \"mm\"; a list where they differ";
/// Words at the end of a name that say its unit.
const TURNS: &[(&str, &str)] =
    &[("rad", "rad"), ("deg", "deg"), ("degree", "deg"), ("degrees", "deg"), ("mm", "mm")];
const TORQUES: &[(&str, &str)] = &[("nm", "Nm"), ("mnm", "mNm")];
/// Names that say what was measured, where there are several of a kind.
const MEASURED: &[&str] = &["actual", "measured", "meas", "act", "fbk", "feedback"];
const TIMES: [(&str, f64); 4] = [("s", 1.0), ("ms", 1e-3), ("us", 1e-6), ("ns", 1e-9)];

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
        let time = self.time()?;
        let rate_hz = match &time {
            Some((_, _, rate_hz)) => {
                Guess::found(format!("{rate_hz:?}"), "the median of the times' distances")
            }
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

    /// Name, unit and rate of the column of the time.
    fn time(&self) -> Result<Option<(String, &'static str, f64)>, ProposalError> {
        let name = match self.names.own {
            Some((_, true)) => Some("time_s"),
            Some((_, false)) => None,
            None => {
                let mut times =
                    self.names.columns.iter().filter(|name| meaning(name) == Some(Meaning::Time));
                times.next().filter(|_| times.next().is_none()).map(String::as_str)
            }
        };
        let Some(name) = name else { return Ok(None) };
        // Read as if it were a position: nothing else of the table is known yet.
        let [rows, ..] = self.columns(vec![name.to_owned()], vec![name.to_owned()])?;
        let mut steps: Vec<f64> = rows
            .first()
            .map_or(Vec::new(), |times| times.windows(2).map(|pair| pair[1] - pair[0]).collect());
        steps.sort_unstable_by(f64::total_cmp);
        let Some(step) = steps.get(steps.len() / 2).filter(|step| **step > 0.0) else {
            return Ok(None);
        };
        let fits = TIMES.iter().find(|(_, second)| RATES_HZ.contains(&(1.0 / (step * second))));
        Ok(fits.map(|(unit, second)| (name.to_owned(), *unit, rounded(1.0 / (step * second)))))
    }

    /// Two quantities as they stand.
    fn columns(
        &self,
        position: Vec<String>,
        torque: Vec<String>,
    ) -> Result<[Vec<Vec<f64>>; 3], ProposalError> {
        let axes = if position == torque { 1 } else { self.robot.joints() };
        let of = |names: Vec<String>| AxisColumns { names, scales: vec![1.0; axes] };
        let same = position == torque;
        let columns = Columns {
            side: Side::Joint,
            axes,
            time: None,
            position: of(position),
            torque: of(if same { Vec::new() } else { torque }),
            reference: None,
        };
        Ok(read_rows(self.file, Some(&columns))?.signals)
    }

    fn of_others(
        &self,
        draft: &mut Draft<'_>,
        time: Option<&(String, &'static str, f64)>,
    ) -> Result<(), ProposalError> {
        if let Some((name, unit, rate_hz)) = time {
            draft.put(SECTION, "time.column", Guess::found(quoted(name), "by its name"));
            let why = format!("the rows are then {rate_hz} a second");
            draft.put(SECTION, "time.unit", Guess::found(quoted(unit), &why));
        }
        let groups = groups(&self.names.columns, self.robot.joints(), &self.joints);
        let position = chosen(&groups, Meaning::Position);
        let (torque, is_command) = torques(&groups);
        draft.put(SECTION, "torque_valid", torque_valid(is_command));
        let (position, torque) =
            (self.answered(draft, "position", position), self.answered(draft, "torque", torque));
        let look = match (&position, &torque) {
            (Ok(position), Ok(torque)) => {
                let [position, torque, _] = self.columns(position.names(), torque.names())?;
                Some(Look { robot: self.robot, position, torque })
            }
            _ => None,
        };
        let named = position.as_ref().ok().and_then(|group| unit(group.name(), TURNS));
        let position_unit = match (draft.answer("data.position.unit"), named, &look) {
            (Some(answered), ..) => Guess::found(answered.to_string(), ""),
            (None, Some(named), _) => Guess::found(quoted(named), "the columns' names"),
            (None, None, Some(look)) => look.position_unit(),
            (None, None, None) => Guess::open(WHICH_POSITION),
        };
        let in_si = look.as_ref().and_then(|look| look.in_si(&position_unit.value));
        draft.put(SECTION, "side", self.side(&[&position, &torque], look.as_ref(), in_si.as_ref()));
        let of_joints = draft.is("data.side", "joint");
        // Of motors the robot knows no limits, and gravity's torque is another.
        let in_si = in_si.filter(|_| of_joints);
        put_columns(draft, "position", &position);
        let certain = of_joints || named.is_some();
        let guess = if certain { position_unit } else { Guess::open(WHICH_POSITION) };
        draft.put(SECTION, "position.unit", guess);
        put_columns(draft, "torque", &torque);
        let is_current =
            torque.as_ref().is_ok_and(|group| meaning(group.name()) == Some(Meaning::Current));
        let named = torque.as_ref().ok().and_then(|group| unit(group.name(), TORQUES));
        let [unit, sign] = match &in_si {
            Some(look) => look.torque(named),
            None => [
                named.map_or_else(
                    || {
                        Guess::open(
                            "the unit: \"Nm\" or \"mNm\"; \"A\" with per_ampere for currents",
                        )
                    },
                    |named| Guess::found(quoted(named), "the columns' names"),
                ),
                Guess::open(
                    "1 where torques drive the joints as the robot's axes point, -1 where they do not; a list where they differ",
                ),
            ],
        };
        if is_current {
            draft.put(
                SECTION,
                "torque.unit",
                Guess::assumed(quoted("A"), "the columns are named as currents"),
            );
            draft.put(SECTION, "torque.per_ampere", Guess::open("torque of one ampere, on the same side as the positions, for all or a list [N·m/A]"));
        } else {
            draft.put(SECTION, "torque.unit", unit);
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
        let named = |key: &str| draft.answer(&format!("data.{what}.{key}"));
        if let Some(pattern) = named("column").and_then(|value| value.as_str().map(str::to_owned)) {
            return Ok(Group::Numbered(pattern));
        }
        if let Some(toml::Value::Array(names)) = named("columns") {
            let names = names.iter().filter_map(|name| name.as_str().map(str::to_owned));
            return Ok(Group::Named(names.collect()));
        }
        found
    }

    fn side(
        &self,
        groups: &[&Result<Group, String>],
        look: Option<&Look<'_>>,
        in_si: Option<&Look<'_>>,
    ) -> Guess {
        let names: Vec<String> = groups
            .iter()
            .flat_map(|group| {
                group.as_ref().map(|group| super::names::words(group.name())).unwrap_or_default()
            })
            .collect();
        let has = |word: &str| names.iter().any(|name| name == word);
        let what = "\"motor\" where angles and torques are the motors', \"joint\" where they are the joints'";
        match (has("motor"), has("joint") || has("link")) {
            (true, false) => Guess::found(quoted("motor"), "the columns' names"),
            _ if in_si.is_some_and(Look::is_of_joints) => {
                Guess::found(quoted("joint"), "gravity of the nominal masses explains the torques")
            }
            (false, true) if look.is_none_or(Look::may_be_of_joints) => {
                Guess::assumed(quoted("joint"), "the columns' names")
            }
            _ => match look.map(Look::may_be_of_joints) {
                Some(false) => {
                    Guess::open(&format!("{what}; some positions are beyond the joints' limits"))
                }
                Some(true) => {
                    Guess::open(&format!("{what}; all positions are within the joints' limits"))
                }
                None => Guess::open(what),
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
    super::names::words(name).iter().any(|word| MEASURED.contains(&word.as_str()))
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
