//! The entries of a cell file that is being written, and its text.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;

use super::evidence::ProposalError;
use super::value::{Guess, Standing, parsed, quoted, texts};
use crate::cell::{CURRENTS, OPEN};

/// Values by key, as TOML; a bare word is a text.
pub type Answers = BTreeMap<String, String>;

/// A key with its value.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    section: String,
    name: String,
    /// As TOML.
    pub value: String,
    /// Where it comes from.
    pub standing: Standing,
    /// Why, or what is asked.
    pub why: String,
}

impl Entry {
    /// The key with its section.
    pub fn key(&self) -> String {
        let Self { section, name, .. } = self;
        if section.is_empty() { name.clone() } else { format!("{section}.{name}") }
    }
}

/// A cell file, and how each of its values came.
#[derive(Clone, Debug, PartialEq)]
pub struct Proposal {
    /// In the order of the file.
    pub entries: Vec<Entry>,
}

/// Of the file, in their order, those of the drives by their axis.
const SECTIONS: [&str; 10] = [
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
/// Those that are there once for each axis.
const EACH: [&str; 2] = ["bus.layout.nodes", "bus.drives"];

/// A section of an axis, in two: its list and the number.
fn of_axis(section: &str) -> Option<(&str, &str)> {
    section.rsplit_once('.').filter(|(list, _)| EACH.contains(list))
}

pub(super) struct Draft<'a> {
    answers: &'a Answers,
    asked: BTreeSet<String>,
    /// What the files say by themselves, so that it is no key.
    known: Vec<(&'static str, String)>,
    entries: Vec<Entry>,
}

impl<'a> Draft<'a> {
    pub(super) fn new(answers: &'a Answers) -> Self {
        Self { answers, asked: BTreeSet::new(), known: Vec::new(), entries: Vec::new() }
    }

    /// Takes the answer, or else the guess.
    pub(super) fn put(&mut self, section: &str, name: &str, guess: Guess) {
        let Guess { value, standing, why } = guess;
        let (section, name) = (section.to_owned(), name.to_owned());
        let mut entry = Entry { section, name, value, standing, why };
        self.asked.insert(entry.key());
        let answer = self.answers.get(&entry.key());
        if let Some(answer) = answer.filter(|answer| answer.trim_matches('"') != OPEN) {
            let (value, standing) = (as_toml(answer), Standing::Stated);
            entry = Entry { value, standing, why: String::new(), ..entry };
        }
        self.entries.push(entry);
    }

    /// Takes what needs no entry.
    pub(super) fn know(&mut self, key: &'static str, value: String) {
        self.known.push((key, value));
    }

    /// Whether a key has this text.
    pub(super) fn is(&self, key: &str, text: &str) -> bool {
        self.text(key).as_deref() == Some(text)
    }

    /// Whether a key has this text, for an axis at least.
    pub(super) fn has(&self, key: &str, text: &str) -> bool {
        match self.value(key) {
            Some(toml::Value::Array(values)) => values.iter().any(|own| own.as_str() == Some(text)),
            _ => self.is(key, text),
        }
    }

    /// Whether it is the unit of a current, for all axes or one of them.
    pub(super) fn has_current(&self, key: &str) -> bool {
        CURRENTS.iter().any(|(unit, _)| self.has(key, unit))
    }

    /// The text of a key that is not open.
    pub(super) fn text(&self, key: &str) -> Option<String> {
        match self.value(key)? {
            toml::Value::String(text) if text != OPEN => Some(text),
            _ => None,
        }
    }

    /// The number of a key that is not open.
    pub(super) fn number(&self, key: &str) -> Option<f64> {
        match self.value(key)? {
            toml::Value::Float(number) => Some(number),
            toml::Value::Integer(number) => i32::try_from(number).ok().map(f64::from),
            _ => None,
        }
    }

    /// The value of a key.
    pub(super) fn value(&self, key: &str) -> Option<toml::Value> {
        let entry = self.entries.iter().find(|entry| entry.key() == key);
        let known = self.known.iter().find(|(own, _)| *own == key).map(|(_, value)| value);
        parsed(entry.map(|entry| &entry.value).or(known)?)
    }

    /// The answer to what is not asked yet.
    pub(super) fn answer(&self, key: &str) -> Option<toml::Value> {
        parsed(&as_toml(self.answers.get(key)?))
    }

    /// The text that answers what is not asked yet.
    pub(super) fn answered_text(&self, key: &str) -> Option<String> {
        self.answer(key)?.as_str().map(str::to_owned)
    }

    /// The list of texts that answers what is not asked yet.
    pub(super) fn answered_texts(&self, key: &str) -> Option<Vec<String>> {
        self.answer(key)?.as_array().map(|values| texts(values))
    }

    pub(super) fn finish(self) -> Result<Proposal, ProposalError> {
        let to_nothing = self.answers.keys().find(|key| !self.asked.contains(*key));
        if let Some(key) = to_nothing {
            let known = self.asked.into_iter().collect::<Vec<_>>().join(" ");
            return Err(ProposalError::NotAsked { key: key.clone(), known });
        }
        let mut entries = self.entries;
        // The file's order: what the cell is, its data or bus, how they are identified.
        let place = |section: &str| {
            let (section, axis) = of_axis(section)
                .map_or((section, 0), |(list, axis)| (list, axis.parse().unwrap_or(0)));
            (SECTIONS.iter().position(|own| *own == section), axis)
        };
        entries.sort_by_key(|entry| -> (Option<usize>, usize) { place(&entry.section) });
        Ok(Proposal { entries })
    }
}

/// As TOML, a bare word as a text.
fn as_toml(answer: &str) -> String {
    if parsed(answer).is_some() { answer.to_owned() } else { quoted(answer) }
}

impl Proposal {
    /// What is open.
    pub fn missing(&self) -> impl Iterator<Item = &Entry> {
        self.entries.iter().filter(|entry| entry.standing == Standing::Missing)
    }

    /// The cell file.
    pub fn text(&self) -> String {
        let mut text = format!(
            "# Above each value stands where it comes from: stated by you, found in the files, assumed because it is\n\
             # usual (have a look), or missing. Put what is missing in place of {}; `didim check` lists what is left.\n\n",
            quoted(OPEN)
        );
        let mut section = "";
        for entry in &self.entries {
            if entry.section != section {
                section = &entry.section;
                // Writing to a String cannot fail.
                let _ = match of_axis(section) {
                    Some((list, axis)) => writeln!(text, "\n[[{list}]] # {axis}"),
                    None => writeln!(text, "\n[{section}]"),
                };
            }
            // A name within may have more than one line, a comment has not.
            let why = entry.why.replace(char::is_control, " ");
            let why = if why.is_empty() { why } else { format!(": {why}") };
            let _ = writeln!(text, "# {}{why}", entry.standing.as_str());
            let _ = writeln!(text, "{} = {}", entry.name, entry.value);
        }
        text
    }
}
