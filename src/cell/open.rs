//! Values that a cell file leaves open: what `didim new` could not find.

use core::fmt;
use std::collections::BTreeMap;

/// Stands where a value has to be put.
pub const OPEN: &str = "?";

/// A key that is open.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct OpenKey {
    /// The key with its section.
    pub key: String,
    /// The line, from 1.
    pub line: usize,
    /// What is asked for, by the comment above it.
    pub what: Option<String>,
}

impl fmt::Display for OpenKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "line {}: {}", self.line, self.key)?;
        self.what.iter().try_for_each(|what| write!(f, ": {what}"))
    }
}

/// All keys that are open, in the order of the file; none where it is no TOML, which is said elsewhere.
pub(super) fn open_keys(text: &str) -> Vec<OpenKey> {
    let mut keys = Vec::new();
    if let Ok(table) = text.parse::<toml::Table>() {
        walk(&toml::Value::Table(table), "", &mut keys);
    }
    let places = places(text);
    let mut open: Vec<OpenKey> = (keys.into_iter())
        .map(|key| {
            let (line, what) =
                nearest(&places, &key).map_or((1, None), |(_, line, what)| (*line, what.clone()));
            OpenKey { key, line, what }
        })
        .collect();
    open.sort_by_key(|key| key.line);
    open.dedup();
    open
}

/// The line of a key, or of the value or the section in which it would stand.
pub(super) fn line_of(text: &str, key: &str) -> Option<usize> {
    nearest(&places(text), key).map(|(_, line, _)| *line)
}

/// The key, or the section, whose line is the nearest above a line.
pub(super) fn key_at(text: &str, line: usize) -> Option<String> {
    let places = places(text);
    let above = places.into_iter().filter(|(_, own, _)| *own <= line);
    above.max_by_key(|(_, own, _)| *own).map(|(key, ..)| key)
}

/// The place of a key, or of the value or the section in which it would stand; quotes in keys count for nothing.
fn nearest<'p>(places: &'p [Place], key: &str) -> Option<&'p Place> {
    let key = key.replace('"', "");
    let is_above = |stated: &str| key == stated || key.starts_with(&format!("{stated}."));
    let above = places.iter().filter(|(stated, ..)| is_above(&stated.replace('"', "")));
    above.max_by_key(|(stated, ..)| stated.len())
}

fn walk(value: &toml::Value, key: &str, open: &mut Vec<String>) {
    match value {
        toml::Value::String(text) if text == OPEN => open.push(key.to_owned()),
        toml::Value::Table(table) => {
            for (name, value) in table {
                let inner = if key.is_empty() { name.clone() } else { format!("{key}.{name}") };
                walk(value, &inner, open);
            }
        }
        toml::Value::Array(values) => {
            for (value, number) in values.iter().zip(1..) {
                match value {
                    toml::Value::Table(_) => walk(value, &format!("{key}.{number}"), open),
                    other => walk(other, key, open),
                }
            }
        }
        _ => {}
    }
}

/// A section or a key with a line of its own, that line, and the comment above it.
type Place = (String, usize, Option<String>);

/// Every section and every key with a line of its own.
fn places(text: &str) -> Vec<Place> {
    let mut found = Vec::new();
    let (mut section, mut comment) = (String::new(), None);
    // How often a section has come that may come several times.
    let mut times: BTreeMap<&str, usize> = BTreeMap::new();
    for (line, number) in text.lines().zip(1..) {
        let line = line.trim();
        let what = comment.map(|said: &str| said.trim_start_matches("missing: ").to_owned());
        if let Some(said) = line.strip_prefix('#') {
            comment = Some(said.trim());
            continue;
        }
        if let Some((name, _)) = line.strip_prefix("[[").and_then(|rest| rest.split_once(']')) {
            let times = times.entry(name).or_default();
            *times += 1;
            section = format!("{name}.{times}");
            found.push((section.clone(), number, what));
        } else if let Some((name, _)) = line.strip_prefix('[').and_then(|rest| rest.split_once(']'))
        {
            name.clone_into(&mut section);
            found.push((section.clone(), number, what));
        } else if let Some((key, _)) = line.split_once('=') {
            let key = key.trim();
            let key = if section.is_empty() { key.to_owned() } else { format!("{section}.{key}") };
            found.push((key, number, what));
        }
        comment = None;
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_open_key_is_listed_with_its_line_and_what_is_asked() {
        let text = "name = 'a \"?\" of a cell' # \"?\" is not open here\n[data]\n# missing: how many\nrate_hz = \"?\"\n\
                    torque = { unit = '?', sign = 1 } # why\n[[bus.drives]]\n# a sign\n\nsigns = [\n1,\n\"?\"\n]\n";
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
