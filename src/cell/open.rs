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

/// All keys that are open, in the order of the file.
pub(super) fn open_keys(text: &str) -> Vec<OpenKey> {
    let mut found = Vec::new();
    let (mut section, mut comment) = (String::new(), None);
    // How often a section has come that may come several times.
    let mut times: BTreeMap<&str, usize> = BTreeMap::new();
    for (line, number) in text.lines().zip(1..) {
        let line = line.trim();
        if let Some(said) = line.strip_prefix('#') {
            comment = Some(said.trim());
            continue;
        }
        if let Some((name, _)) = line.strip_prefix("[[").and_then(|rest| rest.split_once(']')) {
            let times = times.entry(name).or_default();
            *times += 1;
            section = format!("{name}.{times}");
        } else if let Some((name, _)) = line.strip_prefix('[').and_then(|rest| rest.split_once(']'))
        {
            name.clone_into(&mut section);
        } else if let Some((key, value)) = line.split_once('=')
            && without_comment(value).contains(&format!("\"{OPEN}\""))
        {
            let key = key.trim();
            let key = if section.is_empty() { key.to_owned() } else { format!("{section}.{key}") };
            let what = comment.map(|said| said.trim_start_matches("missing: ").to_owned());
            found.push(OpenKey { key, line: number, what });
        }
        comment = None;
    }
    found
}

/// A value without what is said behind it.
fn without_comment(value: &str) -> &str {
    let mut quoted = false;
    let end = value.char_indices().find(|(_, c)| {
        quoted ^= *c == '"';
        *c == '#' && !quoted
    });
    end.map_or(value, |(end, _)| &value[..end])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_open_key_is_listed_with_its_line_and_what_is_asked() {
        let text = "name = \"x\" # \"?\" is not open here\n[data]\n# missing: how many\nrate_hz = \"?\"\n\
                    torque = { unit = \"?\" } # why\n[[bus.drives]]\n# a sign\n\nsigns = [1, \"?\"]\n";
        let listed: Vec<String> = open_keys(text).iter().map(ToString::to_string).collect();
        assert_eq!(
            listed,
            ["line 4: data.rate_hz: how many", "line 5: data.torque", "line 9: bus.drives.1.signs"]
        );
    }
}
