//! Values that a cell file leaves open because `didim new` could not find them.

use core::fmt;
use std::collections::BTreeMap;

/// Placeholder for a missing value.
pub const MISSING_VALUE: &str = "?";

/// A key with an open value.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct OpenKey {
    /// Key with its section.
    pub key: String,
    /// Line of the key, counted from 1.
    pub line: usize,
    /// Question for the missing value, from the comment above the key.
    pub question: Option<String>,
}

impl fmt::Display for OpenKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "line {}: {}", self.line, self.key)?;
        self.question.iter().try_for_each(|what| write!(f, ": {what}"))
    }
}

/// Returns all open keys, in the order of the file. Returns an empty list if the file is not TOML,
/// because the parser reports that error.
pub(super) fn open_keys(text: &str) -> Vec<OpenKey> {
    let mut keys = Vec::new();
    if let Ok(table) = text.parse::<toml::Table>() {
        collect_open(&toml::Value::Table(table), "", &mut keys);
    }
    let places = list_places(text);
    let mut open_keys_found: Vec<OpenKey> = (keys.into_iter())
        .map(|key| {
            let (line, what) = nearest_place(&places, &key)
                .map_or((1, None), |(_, line, what)| (*line, what.clone()));
            OpenKey { key, line, question: what }
        })
        .collect();
    open_keys_found.sort_by_key(|key| key.line);
    open_keys_found.dedup();
    open_keys_found
}

/// Returns the line of a key. If the key is missing, returns the line of the value or section that
/// would contain it.
pub(super) fn line_of(text: &str, key: &str) -> Option<usize> {
    nearest_place(&list_places(text), key).map(|(_, line, _)| *line)
}

/// Returns the key or section at the given line, or else the nearest one above it.
pub(super) fn key_at(text: &str, line: usize) -> Option<String> {
    let places = list_places(text);
    let above = places.into_iter().filter(|(_, own, _)| *own <= line);
    above.max_by_key(|(_, own, _)| *own).map(|(key, ..)| key)
}

/// Returns the place of a key. If the key is missing, returns the place of the value or section
/// that would contain it. Quotes in keys are ignored.
fn nearest_place<'p>(places: &'p [Place], key: &str) -> Option<&'p Place> {
    let key = key.replace('"', "");
    let is_above =
        |configured: &str| key == configured || key.starts_with(&format!("{configured}."));
    let above =
        places.iter().filter(|(configured_value, ..)| is_above(&configured_value.replace('"', "")));
    above.max_by_key(|(configured_value, ..)| configured_value.len())
}

fn collect_open(value: &toml::Value, key: &str, open: &mut Vec<String>) {
    match value {
        toml::Value::String(text) if text == MISSING_VALUE => open.push(key.to_owned()),
        toml::Value::Table(table) => {
            for (name, value) in table {
                let inner = if key.is_empty() { name.clone() } else { format!("{key}.{name}") };
                collect_open(value, &inner, open);
            }
        }
        toml::Value::Array(values) => {
            for (value, number) in values.iter().zip(1..) {
                match value {
                    toml::Value::Table(_) => collect_open(value, &format!("{key}.{number}"), open),
                    other => collect_open(other, key, open),
                }
            }
        }
        _ => {}
    }
}

/// A section, or a key on a separate line: its name, its line number, and the comment above it.
type Place = (String, usize, Option<String>);

/// Lists every section and every key on a separate line.
fn list_places(text: &str) -> Vec<Place> {
    let mut places = Vec::new();
    let (mut section, mut comment) = (String::new(), None);
    // Number of occurrences so far of each section that may repeat.
    let mut times: BTreeMap<&str, usize> = BTreeMap::new();
    for (line, number) in text.lines().zip(1..) {
        let line = line.trim();
        let question = comment.map(|said: &str| said.trim_start_matches("missing: ").to_owned());
        if let Some(said) = line.strip_prefix('#') {
            comment = Some(said.trim());
            continue;
        }
        if let Some((name, _)) = line.strip_prefix("[[").and_then(|rest| rest.split_once(']')) {
            let times = times.entry(name).or_default();
            *times += 1;
            section = format!("{name}.{times}");
            places.push((section.clone(), number, question));
        } else if let Some((name, _)) = line.strip_prefix('[').and_then(|rest| rest.split_once(']'))
        {
            name.clone_into(&mut section);
            places.push((section.clone(), number, question));
        } else if let Some((key, _)) = line.split_once('=') {
            let key = key.trim();
            let key = if section.is_empty() { key.to_owned() } else { format!("{section}.{key}") };
            places.push((key, number, question));
        }
        comment = None;
    }
    places
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_open_key_is_listed_with_its_line_and_what_is_asked() {
        let text = "name = 'a \"?\" of a cell' # \"?\" is not open here\n[data]\n# missing: how \
            many\nrate_hz = \"?\"\n\
            torque = { unit = '?', sign = 1 } # why\n[[bus.drives]]\n# a sign\n\nsigns = \
            [\n1,\n\"?\"\n]\n";
        let listed: Vec<String> = open_keys(text).iter().map(ToString::to_string).collect();
        assert_eq!(
            listed,
            [
                "line 4: data.rate_hz: how many",
                "line 5: data.torque.unit",
                "line 9: bus.drives.1.signs"
            ]
        );
    }
}
