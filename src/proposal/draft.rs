//! The entries of a proposed cell file, and its text.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;

use super::evidence::ProposalError;
use super::value::{Guess, ValueOrigin, list_text, parse_value, quote_text, text_list};
use crate::cell::{CURRENT_UNITS, MISSING_VALUE};

/// Values by key, as TOML. A bare word is read as text.
pub type Answers = BTreeMap<String, String>;

/// A key with its value.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    section: String,
    name: String,
    /// Value as TOML.
    pub value: String,
    /// Source of the value.
    pub origin: ValueOrigin,
    /// Reason for the value, or question about it.
    pub explanation: String,
}

impl Entry {
    /// Returns the key with its section.
    pub fn key(&self) -> String {
        let Self { section, name, .. } = self;
        if section.is_empty() { name.clone() } else { format!("{section}.{name}") }
    }
}

/// A cell file, with the source of each value.
#[derive(Clone, Debug, PartialEq)]
pub struct Proposal {
    /// Entries in the order of the file.
    pub entries: Vec<Entry>,
    /// Number of joints of the arm.
    joints: usize,
}

/// A unit that every quantity may have.
const ANY_UNIT: &str = "{ name = \"any\", si = 1.0 }";

/// Valid values of open keys of a table, with which the other values are checked. The rate is the
/// highest one, which allows every cut-off.
const VALID_VALUES: [(&str, &str); 13] = [
    ("data.position.column", "\"q{axis}\""),
    ("data.position.unit", ANY_UNIT),
    ("data.rate_hz", "20000.0"),
    ("data.reference.unit", ANY_UNIT),
    ("data.side", "\"joint\""),
    ("data.time.column", "\"t\""),
    ("data.time.unit", "\"s\""),
    ("data.torque.column", "\"tau{axis}\""),
    ("data.torque.per_ampere", "1.0"),
    ("data.torque.sign", "1.0"),
    ("data.torque.unit", ANY_UNIT),
    ("identification.decimation_filter.factor", "10"),
    ("urdf.drive_inertia", "false"),
];

/// Sections in the order of the file; those of the drives are sorted by axis.
const SECTION_ORDER: [&str; 10] = [
    "",
    "urdf",
    "data",
    "data.bag",
    "bus",
    "bus.layout",
    "bus.layout.nodes",
    "bus.drives",
    "window",
    "identification",
];
/// Beginnings of keys in the order of the questions: an answer may settle those that follow.
const QUESTION_ORDER: [&str; 10] = [
    "data.time",
    "data.position.column",
    "data.torque.column",
    "data.side",
    "data.position",
    "data.torque",
    "data",
    "bus",
    "urdf",
    "identification",
];
/// Sections that occur once per axis.
const AXIS_SECTIONS: [&str; 2] = ["bus.layout.nodes", "bus.drives"];

/// Splits the section of an axis into the list's name and the axis number.
fn split_axis_section(section: &str) -> Option<(&str, &str)> {
    section.rsplit_once('.').filter(|(list, _)| AXIS_SECTIONS.contains(list))
}

/// Returns the key that answers a key of an axis for all axes: `bus.drives.position.sign` for
/// `bus.drives.2.position.sign`.
fn key_of_all_axes(key: &str) -> Option<String> {
    let (section, rest) =
        AXIS_SECTIONS.iter().find_map(|list| Some((list, key.strip_prefix(list)?)))?;
    let (axis, name) = rest.strip_prefix('.')?.split_once('.')?;
    axis.parse::<usize>().ok().map(|_| format!("{section}.{name}"))
}

pub(super) struct Draft<'a> {
    answers: &'a Answers,
    asked_keys: BTreeSet<String>,
    /// Values that the files themselves contain, so that the cell file needs no key for them.
    stated_values: Vec<(&'static str, String)>,
    entries: Vec<Entry>,
}

impl<'a> Draft<'a> {
    pub(super) fn new(answers: &'a Answers) -> Self {
        Self {
            answers,
            asked_keys: BTreeSet::new(),
            stated_values: Vec::new(),
            entries: Vec::new(),
        }
    }

    /// Adds an entry with the answer, or else with the guess.
    pub(super) fn add_entry(&mut self, section: &str, name: &str, guess: Guess) {
        let Guess { value, origin: standing, explanation: why } = guess;
        let (section, name) = (section.to_owned(), name.to_owned());
        let mut entry = Entry { section, name, value, origin: standing, explanation: why };
        self.asked_keys.insert(entry.key());
        let key = entry.key();
        let for_all = key_of_all_axes(&key);
        self.asked_keys.extend(for_all.clone());
        let answer = self.answers.get(&key).or_else(|| self.answers.get(&for_all?));
        if let Some(answer) = answer.filter(|answer| answer.trim_matches('"') != MISSING_VALUE) {
            let (value, standing) = (as_toml(answer), ValueOrigin::Configured);
            entry = Entry { value, origin: standing, explanation: String::new(), ..entry };
        }
        self.entries.push(entry);
    }

    /// Adds an entry for a key that is optional, if it is answered.
    pub(super) fn add_optional_entry(&mut self, section: &str, name: &str) {
        let key = format!("{section}.{name}");
        self.asked_keys.insert(key.clone());
        if self.answers.contains_key(&key) {
            self.add_entry(section, name, Guess::without_value(""));
        }
    }

    /// Adds a value that needs no entry.
    pub(super) fn add_stated_value(&mut self, key: &'static str, value: String) {
        self.stated_values.push((key, value));
    }

    /// Returns true if a key has this text.
    pub(super) fn has_text(&self, key: &str, text: &str) -> bool {
        self.text(key).as_deref() == Some(text)
    }

    /// Returns true if a key has this text for at least one axis.
    pub(super) fn has_text_for_any(&self, key: &str, text: &str) -> bool {
        match self.value(key) {
            Some(toml::Value::Array(values)) => values.iter().any(|own| own.as_str() == Some(text)),
            _ => self.has_text(key, text),
        }
    }

    /// Returns true if a key has the unit of a current, for all axes or one of them.
    pub(super) fn has_current(&self, key: &str) -> bool {
        CURRENT_UNITS.iter().any(|(unit, _)| self.has_text_for_any(key, unit))
    }

    /// Returns the text of a key that is not open.
    pub(super) fn text(&self, key: &str) -> Option<String> {
        match self.value(key)? {
            toml::Value::String(text) if text != MISSING_VALUE => Some(text),
            _ => None,
        }
    }

    /// Returns the number of a key that is not open.
    pub(super) fn number(&self, key: &str) -> Option<f64> {
        match self.value(key)? {
            toml::Value::Float(number) => Some(number),
            toml::Value::Integer(number) => i32::try_from(number).ok().map(f64::from),
            _ => None,
        }
    }

    /// Returns the value of a key.
    pub(super) fn value(&self, key: &str) -> Option<toml::Value> {
        let entry = self.entries.iter().find(|entry| entry.key() == key);
        let answer = self.stated_values.iter().find(|(own, _)| *own == key).map(|(_, value)| value);
        parse_value(entry.map(|entry| &entry.value).or(answer)?)
    }

    /// Returns the answer that is given for a key.
    pub(super) fn answer(&self, key: &str) -> Option<toml::Value> {
        parse_value(&as_toml(self.answers.get(key)?))
    }

    /// Returns the answer that is given for a key, if it is text.
    pub(super) fn answered_text(&self, key: &str) -> Option<String> {
        self.answer(key)?.as_str().map(str::to_owned)
    }

    /// Returns the names of columns that are given for a key; numbers of columns as text.
    pub(super) fn answered_columns(&self, key: &str) -> Option<Vec<String>> {
        let text = |value: &toml::Value| match value {
            toml::Value::String(name) => Some(name.clone()),
            toml::Value::Integer(number) => Some(number.to_string()),
            _ => None,
        };
        self.answer(key)?.as_array()?.iter().map(text).collect()
    }

    /// Returns the numbers that are given for a key: one for all axes, or a list.
    pub(super) fn answered_numbers(&self, key: &str, axes: usize) -> Option<Vec<f64>> {
        let number = |value: &toml::Value| match value {
            toml::Value::Float(number) => Some(*number),
            toml::Value::Integer(number) => i32::try_from(*number).ok().map(f64::from),
            _ => None,
        };
        match self.answer(key)? {
            toml::Value::Array(values) => values.iter().map(number).collect(),
            value => Some(vec![number(&value)?; axes]),
        }
    }

    /// Returns the answer that is given for a key, if it is a list of texts.
    pub(super) fn answered_texts(&self, key: &str) -> Option<Vec<String>> {
        self.answer(key)?.as_array().map(|values| text_list(values))
    }

    pub(super) fn finish(self, joints: usize) -> Result<Proposal, ProposalError> {
        let to_nothing = self.answers.keys().find(|key| !self.asked_keys.contains(*key));
        if let Some(key) = to_nothing {
            let keys = self.asked_keys.into_iter().collect::<Vec<_>>().join(" ");
            return Err(ProposalError::NotAsked { key: key.clone(), available: keys });
        }
        let mut entries = self.entries;
        // Order of the file: the cell itself, its data or bus, and their identification.
        let place = |section: &str| {
            let (section, axis) = split_axis_section(section)
                .map_or((section, 0), |(list, axis)| (list, axis.parse().unwrap_or(0)));
            (SECTION_ORDER.iter().position(|own| *own == section), axis)
        };
        entries.sort_by_key(|entry| -> (Option<usize>, usize) { place(&entry.section) });
        Ok(Proposal { entries, joints })
    }
}

/// Converts an answer to TOML; a bare word becomes text.
fn as_toml(answer: &str) -> String {
    if parse_value(answer).is_some() { answer.to_owned() } else { quote_text(answer) }
}

impl Proposal {
    /// Returns the entries without a value, in the order in which they are asked: an answer may
    /// settle those that follow.
    pub fn missing(&self) -> Vec<&Entry> {
        let place = |key: String| QUESTION_ORDER.iter().position(|begin| key.starts_with(begin));
        let missing = self.entries.iter().filter(|entry| entry.origin == ValueOrigin::Missing);
        let mut missing: Vec<&Entry> = missing.collect();
        missing.sort_by_key(|entry| place(entry.key()).unwrap_or(QUESTION_ORDER.len()));
        missing
    }

    /// Returns the text of the cell file with valid values for all open ones, so that its other
    /// values can be checked. `None` if an open one has no such value.
    pub fn text_for_check(&self) -> Option<String> {
        let valid = |entry: &Entry| match entry.key().as_str() {
            "urdf.gear_ratios" => Some(list_text(&vec!["1.0"; self.joints])),
            key => VALID_VALUES.iter().find(|(own, _)| *own == key).map(|of| of.1.to_owned()),
        };
        let mut filled = self.clone();
        for entry in filled.entries.iter_mut().filter(|of| of.origin == ValueOrigin::Missing) {
            entry.value = valid(entry)?;
        }
        Some(filled.text())
    }

    /// Returns the text of the cell file.
    pub fn text(&self) -> String {
        let mut text = format!(
            "# The comment above a value names its source: stated by you, found in the files, \
                assumed because it is\n# usual (please check), or missing. Replace {} by the \
                missing values; `didim check` lists what is left.\n\n",
            quote_text(MISSING_VALUE)
        );
        let mut section = "";
        for entry in &self.entries {
            if entry.section != section {
                section = &entry.section;
                // Writing to a String cannot fail.
                let _ = match split_axis_section(section) {
                    Some((list, axis)) => writeln!(text, "\n[[{list}]] # {axis}"),
                    None => writeln!(text, "\n[{section}]"),
                };
            }
            // A name in the explanation may have several lines, but a comment has only one line.
            let why = entry.explanation.replace(char::is_control, " ");
            let why = if why.is_empty() { why } else { format!(": {why}") };
            let _ = writeln!(text, "# {}{why}", entry.origin.as_str());
            let _ = writeln!(text, "{} = {}", entry.name, entry.value);
        }
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn valid_values_are_not_open() {
        for (key, value) in VALID_VALUES {
            let value = parse_value(value).unwrap_or_else(|| panic!("{key}: {value}"));
            assert!(!value.to_string().contains(MISSING_VALUE), "{key}: {value}");
        }
    }

    #[test]
    fn a_key_without_an_axis_answers_for_all_drives() {
        let all = |key: &str| key_of_all_axes(key);
        let sign = "bus.drives.position.sign".to_owned();
        assert_eq!(all("bus.drives.2.position.sign"), Some(sign.clone()));
        assert_eq!(all(&sign), None);
        assert_eq!(all("data.position.unit"), None);
        let answers = Answers::from([
            (sign, "-1".to_owned()),
            ("bus.drives.2.position.sign".to_owned(), "1".to_owned()),
        ]);
        let mut draft = Draft::new(&answers);
        for axis in 1..=2 {
            let section = format!("bus.drives.{axis}");
            draft.add_entry(&section, "position.sign", Guess::without_value(""));
        }
        let signs: Vec<f64> = (1..=2)
            .filter_map(|axis| draft.number(&format!("bus.drives.{axis}.position.sign")))
            .collect();
        assert_eq!(signs, [-1.0, 1.0]);
        assert!(draft.finish(2).is_ok());
    }
}
