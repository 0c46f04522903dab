//! `[data]` of a table: the columns and their units.

use std::path::PathBuf;

use didim_formats::{AxisColumns, Columns, Side, TableError, TableNames, read_rows};

use super::draft::Draft;
use super::evidence::{Evidence, ProposalError};
use super::names::{
    ColumnGroup, ColumnMeaning, column_groups, column_meaning, counted_otherwise, split_words, unit,
};
use super::plausible::{SignalSurvey, propose_torque_timing};
use super::time::TableTime;
use super::value::{
    Guess, POSITION_UNIT_QUESTION, SIDE_QUESTION, TORQUE_SIGN_QUESTION, TORQUE_UNIT_QUESTION,
    list_text, quote_text,
};
use crate::cell::{CURRENT_UNITS, MISSING_VALUE};

const SECTION_NAME: &str = "data";
/// Last words of a name that denote its unit.
const POSITION_UNIT_WORDS: &[(&str, &str)] = &[
    ("rad", "rad"),
    ("deg", "deg"),
    ("degree", "deg"),
    ("degrees", "deg"),
    ("°", "deg"),
    ("mm", "mm"),
];
const TORQUE_UNIT_WORDS: &[(&str, &str)] = &[
    ("nm", "Nm"),
    ("mnm", "mNm"),
    ("a", "A"),
    ("ma", "mA"),
    ("amp", "A"),
    ("ampere", "A"),
    ("n", "N"),
];
/// Words that mark the measured columns. They are used if a quantity has several groups of columns.
const MEASURED_WORDS: &[&str] =
    &["actual", "measured", "meas", "act", "fbk", "feedback", "ist", "msr"];

pub(super) fn propose(
    draft: &mut Draft<'_>,
    evidence: &Evidence,
    (file, names): &(PathBuf, TableNames),
) -> Result<(), ProposalError> {
    let joints: Vec<String> = evidence.robot.joint_names().map(str::to_owned).collect();
    let table = TableProposal { file, names, robot: &evidence.robot.robot, joints };
    table.propose(draft)
}

struct TableProposal<'a> {
    file: &'a PathBuf,
    names: &'a TableNames,
    robot: &'a didim_dynamics::robot::Robot,
    joints: Vec<String>,
}

impl TableProposal<'_> {
    fn propose(&self, draft: &mut Draft<'_>) -> Result<(), ProposalError> {
        let time = TableTime::find_time(draft, self.file, self.names)?;
        let rate_hz = match &time {
            Some(TableTime { rate_hz: Some(rate_hz), is_stated, .. }) => {
                let guess = if *is_stated { Guess::from_file } else { Guess::assumed };
                guess(format!("{rate_hz:?}"), "the mean distance of the times")
            }
            Some(_) => Guess::without_value("samples a second; the unit of the time tells it"),
            None => Guess::without_value("samples a second; the table has no times"),
        };
        draft.add_entry(SECTION_NAME, "rate_hz", rate_hz);
        match self.names.own_format {
            None => self.of_others(draft, time.as_ref()),
            Some((side, _)) => {
                let side = if side == Side::Joint { "joint" } else { "motor" };
                draft.add_stated_value("data.side", quote_text(side));
                draft.add_entry(SECTION_NAME, "torque_valid", propose_torque_timing(false));
                Ok(())
            }
        }
    }

    /// Reads positions and torques in their own units.
    fn group_columns(
        &self,
        position: &ColumnGroup,
        torque: &ColumnGroup,
    ) -> Result<[Vec<Vec<f64>>; 3], TableError> {
        let axes = self.robot.joints();
        let columns_of = |group: &ColumnGroup| AxisColumns {
            names: group.names(),
            scales: vec![1.0; axes],
            zeros: Vec::new(),
            wraps: Vec::new(),
        };
        let columns = Columns {
            side: Side::Joint,
            axes,
            time: None,
            position: columns_of(position),
            torque: columns_of(torque),
            reference: None,
        };
        Ok(read_rows(self.file, Some(&columns))?.signals)
    }

    fn of_others(
        &self,
        draft: &mut Draft<'_>,
        time: Option<&TableTime>,
    ) -> Result<(), ProposalError> {
        if let Some(time) = time {
            time.add_entries(draft, SECTION_NAME);
        }
        let axes = self.robot.joints();
        if self.names.columns.len() < 2 * axes {
            let (file, columns) = (self.file.clone(), self.names.columns.join(" "));
            return Err(ProposalError::NoTable { file, columns, axes });
        }
        let groups = column_groups(&self.names.columns, axes, &self.joints);
        let otherwise = counted_otherwise(&self.names.columns, axes);
        let position = choose_group(&groups, ColumnMeaning::Position);
        let (torque, is_command) = choose_torque_group(&groups);
        draft.add_entry(SECTION_NAME, "torque_valid", propose_torque_timing(is_command));
        let hint = |which: String| match otherwise.is_empty() {
            true => which,
            false => format!("{which}; of {axes} joints there are {}", otherwise.join(", ")),
        };
        let (position, torque) = (position.map_err(hint), torque.map_err(hint));
        let (position, torque) = (
            self.answer_or_found(draft, "position", position),
            self.answer_or_found(draft, "torque", torque),
        );
        let survey = match (&position, &torque) {
            (Ok(position), Ok(torque)) => {
                let [position, torque, _] = self.group_columns(position, torque)?;
                Some(SignalSurvey { robot: self.robot, position, torque })
            }
            _ => None,
        };
        let named =
            position.as_ref().ok().and_then(|group| unit(group.name(), POSITION_UNIT_WORDS));
        let position_unit = position_guess(draft, survey.as_ref(), named.as_ref());
        let in_si =
            survey.as_ref().and_then(|survey_input| survey_input.in_si(&position_unit.value));
        draft.add_entry(
            SECTION_NAME,
            "side",
            self.guess_side(&[&position, &torque], survey.as_ref(), in_si.as_ref()),
        );
        let of_joints = draft.has_text("data.side", "joint");
        // The robot file has no motor-side limits, and gravity causes other torques on the motor
        // side.
        let in_si = in_si.filter(|_| of_joints);
        put_columns(draft, "position", &position);
        let certain = of_joints || matches!(named, Some(Ok(_)));
        let guess =
            if certain { position_unit } else { Guess::without_value(POSITION_UNIT_QUESTION) };
        draft.add_entry(SECTION_NAME, "position.unit", guess);
        put_columns(draft, "torque", &torque);
        let is_current = torque
            .as_ref()
            .is_ok_and(|group| column_meaning(group.name()) == Some(ColumnMeaning::Current));
        let named = torque.as_ref().ok().and_then(|group| unit(group.name(), TORQUE_UNIT_WORDS));
        let (unit, sign) = torque_guesses(in_si.as_ref(), named, is_current);
        draft.add_entry(SECTION_NAME, "torque.unit", unit);
        if draft.has_current("data.torque.unit") {
            let question = "torque of one ampere, on the same side as the positions, for all or a \
                list [N·m/A]";
            draft.add_entry(SECTION_NAME, "torque.per_ampere", Guess::without_value(question));
        }
        draft.add_entry(SECTION_NAME, "torque.sign", sign);
        if let Ok(reference) = choose_group(&groups, ColumnMeaning::Reference) {
            put_columns(draft, "reference", &Ok(reference));
            let unit = draft.text("data.position.unit").unwrap_or_else(|| MISSING_VALUE.to_owned());
            let guess = if unit == MISSING_VALUE {
                Guess::without_value("the unit of the reference")
            } else {
                Guess::assumed(quote_text(&unit), "as of the positions")
            };
            draft.add_entry(SECTION_NAME, "reference.unit", guess);
        }
        Ok(())
    }

    /// Returns the columns of the answer, or else the detected ones.
    fn answer_or_found(
        &self,
        draft: &Draft<'_>,
        what: &str,
        found: Result<ColumnGroup, String>,
    ) -> Result<ColumnGroup, String> {
        if let Some(pattern) = draft.answered_text(&format!("data.{what}.column")) {
            return Ok(ColumnGroup::Numbered(pattern));
        }
        if let Some(names) = draft.answered_texts(&format!("data.{what}.columns")) {
            let (count, axes) = (names.len(), self.robot.joints());
            let wrong = || format!("`columns` has {count} names for {axes} axes");
            return if count == axes { Ok(ColumnGroup::Named(names)) } else { Err(wrong()) };
        }
        found
    }

    fn guess_side(
        &self,
        groups: &[&Result<ColumnGroup, String>],
        survey: Option<&SignalSurvey<'_>>,
        in_si: Option<&SignalSurvey<'_>>,
    ) -> Guess {
        // Both groups must name motors, because joint angles together with motor currents are
        // common. The word "joint" is not conclusive, because it also numbers the axes of motors.
        let of_motors = groups.iter().all(|group| {
            let words = group.as_ref().map(|group| split_words(group.name()));
            words.is_ok_and(|words| words.iter().any(|own| own == "motor"))
        });
        match () {
            () if of_motors => Guess::from_file(quote_text("motor"), "the columns' names"),
            () if in_si.is_some_and(SignalSurvey::is_of_joints) => Guess::from_file(
                quote_text("joint"),
                "gravity of the nominal masses explains the torques",
            ),
            () => match survey.map(SignalSurvey::may_be_of_joints) {
                Some(false) => Guess::without_value(&format!(
                    "{SIDE_QUESTION}; some positions are beyond the joints' limits"
                )),
                Some(true) => Guess::without_value(&format!(
                    "{SIDE_QUESTION}; all positions are within the joints' limits"
                )),
                None => Guess::without_value(SIDE_QUESTION),
            },
        }
    }
}

/// Proposes the unit of the positions from the answer, the columns' names or the values.
fn position_guess(
    draft: &mut Draft<'_>,
    survey: Option<&SignalSurvey<'_>>,
    named: Option<&Result<&str, String>>,
) -> Guess {
    match (draft.answer("data.position.unit"), named, survey) {
        (Some(answered), ..) => Guess::from_file(answered.to_string(), ""),
        (None, Some(Ok(named)), _) => Guess::from_file(quote_text(named), "the columns' names"),
        (None, Some(Err(unknown)), _) => Guess::without_value(&format!(
            "{POSITION_UNIT_QUESTION}; the columns' names say {unknown}"
        )),
        (None, None, Some(survey_input)) => survey_input.position_unit(),
        (None, None, None) => Guess::without_value(POSITION_UNIT_QUESTION),
    }
}

/// Proposes the unit and the sign of the torques from the columns' names and the values.
fn torque_guesses(
    in_si: Option<&SignalSurvey<'_>>,
    named: Option<Result<&str, String>>,
    is_current: bool,
) -> (Guess, Guess) {
    let of_current = |own: &str| CURRENT_UNITS.iter().any(|(unit, _)| *unit == own);
    let newton_metres = match &named {
        Some(Ok(unit)) if !of_current(unit) => {
            Some((*unit, if *unit == "mNm" { 1e3 } else { 1.0 }))
        }
        _ => None,
    };
    let [mut unit, sign] = match in_si {
        Some(survey_input) => survey_input.torque(newton_metres),
        None => [
            newton_metres.map_or_else(
                || Guess::without_value(TORQUE_UNIT_QUESTION),
                |(unit, _)| Guess::from_file(quote_text(unit), "the columns' names"),
            ),
            Guess::without_value(TORQUE_SIGN_QUESTION),
        ],
    };
    match named {
        Some(Err(unknown)) => {
            unit = Guess::without_value(&format!(
                "{TORQUE_UNIT_QUESTION}; the columns' names say {unknown}"
            ));
        }
        Some(Ok(own)) if of_current(own) => {
            unit = Guess::from_file(quote_text(own), "the columns' names");
        }
        None if is_current => {
            unit = Guess::assumed(quote_text("A"), "the columns are named as currents");
        }
        _ => {}
    }
    (unit, sign)
}

/// Returns the only group of a quantity, or the measured group if there are several. The error
/// lists the available groups.
pub(super) fn choose_group(
    groups: &[ColumnGroup],
    wanted: ColumnMeaning,
) -> Result<ColumnGroup, String> {
    let fitting: Vec<&ColumnGroup> =
        groups.iter().filter(|group| column_meaning(group.name()) == Some(wanted)).collect();
    let mut of_measured = fitting.iter().filter(|group| is_measured(group.name()));
    match (fitting.as_slice(), of_measured.next(), of_measured.next()) {
        ([one], ..) => Ok((*one).clone()),
        (_, Some(one), None) => Ok((*one).clone()),
        ([], ..) if groups.is_empty() => {
            Err("no group of columns has one for each axis".to_owned())
        }
        ([], ..) => {
            let names: Vec<String> =
                groups.iter().map(|group| format!("`{}`", group.name())).collect();
            Err(format!("groups with one column for each axis: {}", names.join(" ")))
        }
        (several, ..) => {
            let names: Vec<String> =
                several.iter().map(|group| format!("`{}`", group.name())).collect();
            Err(format!("one of {}", names.join(" ")))
        }
    }
}

/// Returns the group of torques or currents, or the group of commands if nothing was measured. The
/// flag is true for commands.
pub(super) fn choose_torque_group(groups: &[ColumnGroup]) -> (Result<ColumnGroup, String>, bool) {
    let is = |wanted: &ColumnMeaning| {
        groups.iter().any(|group| column_meaning(group.name()) == Some(*wanted))
    };
    let wanted = [ColumnMeaning::Torque, ColumnMeaning::Current, ColumnMeaning::Command]
        .into_iter()
        .find(is);
    let chosen_group = choose_group(groups, wanted.unwrap_or(ColumnMeaning::Torque));
    let is_command = wanted == Some(ColumnMeaning::Command) && chosen_group.is_ok();
    (chosen_group, is_command)
}

/// Returns true if a name marks a measured quantity.
pub(super) fn is_measured(name: &str) -> bool {
    split_words(name).iter().any(|word| MEASURED_WORDS.contains(&word.as_str()))
}

fn put_columns(draft: &mut Draft<'_>, what: &str, group: &Result<ColumnGroup, String>) {
    let why = "by their names";
    let (key, guess) = match group {
        Ok(ColumnGroup::Numbered(pattern)) => {
            ("column", Guess::from_file(quote_text(pattern), why))
        }
        Ok(ColumnGroup::Named(names)) => {
            let names: Vec<String> = names.iter().map(|name| quote_text(name)).collect();
            ("columns", Guess::from_file(list_text(&names), why))
        }
        Err(which) => (
            "column",
            Guess::without_value(&format!(
                "the columns of the {what}, with {{axis}} in place of the number; {which}"
            )),
        ),
    };
    draft.add_entry(SECTION_NAME, &format!("{what}.{key}"), guess);
}
