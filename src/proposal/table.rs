//! `[data]` of a table: the columns and their units.

use std::path::PathBuf;

use didim_dynamics::robot::JointKind;
use didim_formats::{AxisColumns, Columns, Side, TableError, TableNames, list_names, read_rows};

use super::draft::Draft;
use super::evidence::{Evidence, ProposalError};
use super::names::{
    ColumnGroup, ColumnMeaning, axis_name, column_groups, column_meaning, counted_otherwise,
    is_measured, lacks_efforts, related_groups, split_words, unit,
};
use super::plausible::{SignalSurvey, propose_torque_timing};
use super::time::{TableRows, TableTime, column_text};
use super::value::{
    Guess, POSITION_UNIT_QUESTION, SIDE_QUESTION, TORQUE_SIGN_QUESTION, TORQUE_UNIT_QUESTION,
    list_text, quote_text,
};
use crate::cell::{CURRENT_UNITS, MISSING_VALUE, TORQUE_UNITS};
use crate::text::significant_digits;

const SECTION_NAME: &str = "data";
/// Largest plausible current of a joint's drive \[A\]. Convention: far above the peak current of
/// any servo drive of an arm, and far below a thousand times that of a small one.
const MAX_CURRENT_A: f64 = 500.0;
/// Last words of a name that denote its unit.
const POSITION_UNIT_WORDS: &[(&str, &str)] = &[
    ("rad", "rad"),
    ("deg", "deg"),
    ("degree", "deg"),
    ("degrees", "deg"),
    ("°", "deg"),
    ("rev", "rev"),
    ("revs", "rev"),
    ("turn", "rev"),
    ("turns", "rev"),
    ("mrad", "mrad"),
    ("mdeg", "mdeg"),
    ("mm", "mm"),
    ("um", "um"),
    ("µm", "um"),
];
const TORQUE_UNIT_WORDS: &[(&str, &str)] = &[
    ("nm", "Nm"),
    ("mnm", "mNm"),
    ("ncm", "Ncm"),
    ("knm", "kNm"),
    ("a", "A"),
    ("ma", "mA"),
    ("amp", "A"),
    ("ampere", "A"),
    ("n", "N"),
    ("kn", "kN"),
];
pub(super) fn propose(
    draft: &mut Draft<'_>,
    evidence: &Evidence,
    (file, names): &(PathBuf, TableNames),
) -> Result<(), ProposalError> {
    let joints: Vec<String> = evidence.robot.joint_names().map(str::to_owned).collect();
    let table = TableProposal { file, names, robot: &evidence.robot.robot, joints };
    table.propose(draft)
}

fn add_rate(draft: &mut Draft<'_>, time: Option<&TableTime>) {
    let rate_hz = time.map_or_else(
        || Guess::without_value("samples a second; the table has no times"),
        TableTime::rate_guess,
    );
    draft.add_entry(SECTION_NAME, "rate_hz", rate_hz);
}

/// Columns of positions and torques, or the questions for them.
struct SignalChoice {
    position: Result<ColumnGroup, String>,
    torque: Result<ColumnGroup, String>,
    /// True if the torques are commands.
    is_command: bool,
}

struct TableProposal<'a> {
    file: &'a PathBuf,
    names: &'a TableNames,
    robot: &'a didim_dynamics::robot::Robot,
    joints: Vec<String>,
}

impl TableProposal<'_> {
    fn propose(&self, draft: &mut Draft<'_>) -> Result<(), ProposalError> {
        if let Some((side, _)) = self.names.own_format {
            let rows = TableRows { file: self.file, names: self.names, signals: None };
            add_rate(draft, TableTime::find_time(draft, rows)?.as_ref());
            let side = if side == Side::Joint { "joint" } else { "motor" };
            draft.add_stated_value("data.side", quote_text(side));
            draft.add_entry(SECTION_NAME, "torque_valid", propose_torque_timing(false));
            return Ok(());
        }
        let axes = self.robot.joints();
        if self.names.columns.len() < 2 * axes {
            let (file, columns) = (self.file.clone(), self.names.columns.join(" "));
            return Err(ProposalError::NoTable { file, columns, axes });
        }
        let columns = self.names.columns.iter().zip(&self.names.first_row);
        let texts: Vec<String> = (columns.zip(&self.names.has_text))
            .filter(|(_, has_text)| **has_text)
            .map(|((column, text), _)| format!("`{column}` ({text:?})"))
            .collect();
        if self.names.columns.len() < 2 * axes + texts.len() {
            let (file, texts) = (self.file.clone(), texts.join(", "));
            return Err(ProposalError::Texts { file, texts, axes });
        }
        let is_answered = |key: &str| draft.answer(&format!("data.torque.{key}")).is_some();
        if !["column", "columns"].into_iter().any(is_answered)
            && lacks_efforts(self.names, &self.joints)
        {
            return Err(ProposalError::NoEfforts { file: self.file.clone() });
        }
        let groups = column_groups(self.names, axes, &self.joints);
        let choice = self.choose_signals(draft, &groups)?;
        let signals = match (&choice.position, &choice.torque) {
            (Ok(position), Ok(torque)) => Some(self.columns_of(draft, position, torque)),
            _ => None,
        };
        let rows = TableRows { file: self.file, names: self.names, signals: signals.as_ref() };
        let time = TableTime::find_time(draft, rows)?;
        add_rate(draft, time.as_ref());
        if let Some(time) = time {
            time.add_entries(draft, SECTION_NAME);
        }
        self.add_signals(draft, &groups, choice, signals.as_ref())
    }

    /// Returns the columns of positions and torques in their own units.
    fn columns_of(
        &self,
        draft: &Draft<'_>,
        position: &ColumnGroup,
        torque: &ColumnGroup,
    ) -> Columns {
        let axes = self.robot.joints();
        let zeros = draft.answered_numbers("data.position.zero", axes).unwrap_or_default();
        let columns_of = |group: &ColumnGroup, zeros: Vec<f64>| AxisColumns {
            names: group.names(),
            scales: vec![1.0; axes],
            zeros,
            wraps: Vec::new(),
        };
        Columns {
            side: Side::Joint,
            axes,
            time: None,
            position: columns_of(position, zeros),
            torque: columns_of(torque, Vec::new()),
            reference: None,
        }
    }

    /// Chooses the columns of positions and torques.
    fn choose_signals(
        &self,
        draft: &Draft<'_>,
        groups: &[ColumnGroup],
    ) -> Result<SignalChoice, ProposalError> {
        let axes = self.robot.joints();
        let otherwise = counted_otherwise(&self.names.columns, axes);
        let position = choose_group(groups, ColumnMeaning::Position);
        let (torque, is_command) = choose_torque_group(groups);
        let hint = |which: String| match (self.names.has_header, otherwise.is_empty()) {
            (false, _) => {
                let count = self.names.columns.len();
                format!("the table has {count} columns and no header")
            }
            (true, true) => which,
            (true, false) => {
                format!("{which}; of {axes} joints there are {}", otherwise.join(", "))
            }
        };
        Ok(SignalChoice {
            position: self.answer_or_found(draft, "position", position.map_err(hint))?,
            torque: self.answer_or_found(draft, "torque", torque.map_err(hint))?,
            is_command,
        })
    }

    /// Returns true unless the table lacks one of these columns.
    fn is_read_with(&self, group: &ColumnGroup) -> bool {
        let axis_columns =
            |names| AxisColumns { names, scales: Vec::new(), zeros: Vec::new(), wraps: Vec::new() };
        let columns = Columns {
            side: Side::Joint,
            axes: self.robot.joints(),
            time: None,
            position: axis_columns(group.names()),
            torque: axis_columns(Vec::new()),
            reference: None,
        };
        !matches!(
            read_rows(self.file, Some(&columns)),
            Err(TableError::NoSuchColumn { .. } | TableError::NoHeader { .. })
        )
    }

    /// Checks that the table has the columns of an answer, by their names or numbers.
    fn check_columns(&self, group: ColumnGroup) -> Result<ColumnGroup, ProposalError> {
        let columns = &self.names.columns;
        let is_there = |name: &String| {
            let by_number =
                || name.parse().is_ok_and(|number| (1..=columns.len()).contains(&number));
            columns.contains(name) || by_number()
        };
        let names = match &group {
            ColumnGroup::Numbered(pattern) => {
                (0..self.robot.joints()).map(|axis| axis_name(pattern, axis)).collect()
            }
            group => group.names(),
        };
        match names.into_iter().find(|name| !is_there(name)) {
            None => Ok(group),
            // The header may be found only with the wanted names.
            Some(_) if self.is_read_with(&group) => Ok(group),
            Some(column) => {
                let (file, available) = (self.file.clone(), list_names(columns));
                Err(ProposalError::NoColumn { file, column, available })
            }
        }
    }

    /// Returns the unit of a group's columns, from their names or the row of units.
    fn group_unit(
        &self,
        group: &Result<ColumnGroup, String>,
        words: &[(&str, &'static str)],
    ) -> Option<Result<&'static str, String>> {
        let group = group.as_ref().ok()?;
        let first = group.first_name();
        let by_name = self.names.columns.iter().position(|name| *name == first);
        let by_number = || first.parse::<usize>().ok()?.checked_sub(1);
        let in_row = by_name.or_else(by_number).and_then(|at| self.names.units.get(at));
        let in_row = in_row.and_then(|own| unit(&format!("[{own}]"), words));
        in_row.or_else(|| unit(group.name(), words))
    }

    fn add_signals(
        &self,
        draft: &mut Draft<'_>,
        groups: &[ColumnGroup],
        choice: SignalChoice,
        signals: Option<&Columns>,
    ) -> Result<(), ProposalError> {
        let SignalChoice { position, torque, is_command } = choice;
        draft.add_entry(SECTION_NAME, "torque_valid", propose_torque_timing(is_command));
        let survey = match signals {
            Some(columns) => {
                let [position, torque, _] = read_rows(self.file, Some(columns))?.signals;
                Some(SignalSurvey { robot: self.robot, position, torque, has_turns: false })
            }
            None => None,
        };
        let named = self.group_unit(&position, POSITION_UNIT_WORDS);
        let position_unit = position_guess(draft, survey.as_ref(), named.as_ref());
        let torque_unit = draft.answer("data.torque.unit");
        let in_si = survey.as_ref().and_then(|survey_input| {
            survey_input.in_si(&position_unit.value, torque_unit.as_ref())
        });
        let has_turns = in_si.as_ref().is_some_and(|of| of.has_turns);
        draft.add_entry(
            SECTION_NAME,
            "side",
            self.guess_side(&[&position, &torque], survey.as_ref(), in_si.as_ref()),
        );
        let of_joints = draft.has_text("data.side", "joint");
        // The robot file has no motor-side limits, and gravity causes other torques on the motor
        // side.
        let in_si = in_si.filter(|_| of_joints);
        put_columns(draft, "position", &position, groups);
        let certain = of_joints || matches!(named, Some(Ok(_)));
        let guess =
            if certain { position_unit } else { Guess::without_value(POSITION_UNIT_QUESTION) };
        draft.add_entry(SECTION_NAME, "position.unit", guess);
        if has_turns {
            let why = "positions jump by a turn";
            draft.add_entry(SECTION_NAME, "position.wraps", Guess::assumed("true".into(), why));
        }
        let optional = ["position.zero", "position.wraps", "position.factor", "position.sign"];
        for name in optional.into_iter().filter(|name| !has_turns || !name.ends_with("wraps")) {
            draft.add_optional_entry(SECTION_NAME, name);
        }
        put_columns(draft, "torque", &torque, groups);
        let is_current = torque
            .as_ref()
            .is_ok_and(|group| column_meaning(group.name()) == Some(ColumnMeaning::Current));
        let named = self.group_unit(&torque, TORQUE_UNIT_WORDS);
        let current = is_current.then(|| survey.as_ref().map(SignalSurvey::largest_torque));
        let (unit, sign) = torque_guesses(in_si.as_ref(), named, current);
        draft.add_entry(SECTION_NAME, "torque.unit", unit);
        if draft.has_current("data.torque.unit") {
            let question = "torque of one ampere, on the same side as the positions, for all or a \
                list [N·m/A]";
            draft.add_entry(SECTION_NAME, "torque.per_ampere", Guess::without_value(question));
        }
        draft.add_entry(SECTION_NAME, "torque.sign", sign);
        if let Ok(reference) = choose_group(groups, ColumnMeaning::Reference) {
            put_columns(draft, "reference", &Ok(reference), groups);
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
    ) -> Result<Result<ColumnGroup, String>, ProposalError> {
        let key = format!("data.{what}.column");
        if let Some(pattern) = draft.answered_text(&key).filter(|text| text != MISSING_VALUE) {
            return self.check_columns(ColumnGroup::Numbered(pattern)).map(Ok);
        }
        // The number of the column of a single axis.
        if let Some(toml::Value::Integer(number)) = draft.answer(&key) {
            let group = ColumnGroup::ByNumber(what.to_owned(), vec![number.to_string()]);
            return self.check_columns(group).map(Ok);
        }
        if let Some(names) = draft.answered_columns(&format!("data.{what}.columns")) {
            let (count, axes) = (names.len(), self.robot.joints());
            let is_number = |name: &String| name.parse::<u16>().is_ok();
            return match names.iter().all(is_number) {
                _ if count != axes => Err(ProposalError::ColumnCount {
                    key: format!("data.{what}.columns"),
                    count,
                    axes,
                }),
                true => self.check_columns(ColumnGroup::ByNumber(what.to_owned(), names)).map(Ok),
                false => self.check_columns(ColumnGroup::Named(names)).map(Ok),
            };
        }
        Ok(found)
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

/// Proposes the unit and the sign of the torques from the columns' names and the values. `current`
/// is the largest value of columns that are named as currents, if it is known.
fn torque_guesses(
    in_si: Option<&SignalSurvey<'_>>,
    named: Option<Result<&str, String>>,
    current: Option<Option<f64>>,
) -> (Guess, Guess) {
    let of_current = |own: &str| CURRENT_UNITS.iter().any(|(unit, _)| *unit == own);
    let newton_metres = match &named {
        Some(Ok(unit)) if !of_current(unit) => {
            let kinds = [JointKind::Revolute, JointKind::Prismatic].into_iter();
            let mut sizes = kinds.filter_map(|kind| TORQUE_UNITS.size(unit, kind));
            Some((*unit, 1.0 / sizes.next().unwrap_or(1.0)))
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
        None if current.flatten().is_some_and(|largest| largest > MAX_CURRENT_A) => {
            let largest = current.flatten().unwrap_or(0.0);
            unit = Guess::without_value(&format!(
                "{TORQUE_UNIT_QUESTION}; the columns are named as currents, and their values reach \
                {}, too much for ampere",
                significant_digits(largest, 3)
            ));
        }
        None if current.is_some() => {
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

fn put_columns(
    draft: &mut Draft<'_>,
    what: &str,
    group: &Result<ColumnGroup, String>,
    groups: &[ColumnGroup],
) {
    let others = group.as_ref().map(|group| related_groups(groups, group)).unwrap_or_default();
    let why = match others.as_slice() {
        [] => "by their names".to_owned(),
        others => format!("by their names; not {}", others.join(" ")),
    };
    let (key, guess) = match group {
        Ok(ColumnGroup::Numbered(pattern)) => {
            ("column", Guess::from_file(quote_text(pattern), &why))
        }
        Ok(ColumnGroup::Named(names)) => {
            let names: Vec<String> = names.iter().map(|name| quote_text(name)).collect();
            ("columns", Guess::from_file(list_text(&names), &why))
        }
        Ok(ColumnGroup::ByNumber(name, numbers)) => {
            let numbers: Vec<String> = numbers.iter().map(|number| column_text(number)).collect();
            let why = format!("numbers of the columns, from 1, of the {name}s in the usual order");
            ("columns", Guess::assumed(list_text(&numbers), &why))
        }
        Err(which) => (
            "column",
            Guess::without_value(&format!(
                "the columns of the {what}, with {{axis}} in place of the number, or `columns` \
                with a list of their names or numbers, from 1; {which}"
            )),
        ),
    };
    draft.add_entry(SECTION_NAME, &format!("{what}.{key}"), guess);
}
