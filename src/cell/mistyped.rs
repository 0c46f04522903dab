//! Search for all keys that are of the wrong type, unknown or missing. A parser stops at the first
//! one.

use core::fmt;
use core::ops::Range;

use super::file::CellFile;
use super::open::{MISSING_VALUE, key_at};
use super::suggestion::Suggestion;

/// Maximum number of keys to check.
const MAX_CHECKED_KEYS: usize = 100;
/// Example values, one for each type that a key may have.
const EXAMPLE_VALUES: [&str; 6] = ["1.0", "1", "true", "\"x\"", "[1.0]", "[\"x\"]"];

/// A key with an invalid value.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct WrongKey {
    /// Key with its section.
    pub key: String,
    /// Line of the key, counted from 1.
    pub line: usize,
    /// The problem and the expected value.
    pub problem: String,
}

impl fmt::Display for WrongKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "line {}: {}: {}", self.line, self.key, self.problem)
    }
}

/// Finds all wrong keys. Replaces each refused value by one of another type until the parser
/// accepts it and continues.
pub(super) fn wrong_keys(text: &str) -> Vec<WrongKey> {
    let mut wrong = Vec::new();
    let mut text = text.to_owned();
    for _ in 0..MAX_CHECKED_KEYS {
        let Some((span, problem)) = first_error(&text) else { break };
        let Some(value) = text.get(span.clone()) else { break };
        let is_open = value.contains(MISSING_VALUE);
        if !is_open {
            let line = line_at(&text, span.start);
            let key = key_at(&text, line).unwrap_or_default();
            wrong.push(WrongKey { key, line, problem: problem.clone() });
        }
        let Some(next) = with_accepted_value(&text, &span, &problem) else { break };
        text = next;
    }
    wrong.sort_by_key(|key| key.line);
    wrong
}

/// Returns the line that contains a byte, counted from 1.
pub(super) fn line_at(text: &str, byte: usize) -> usize {
    1 + text.bytes().take(byte).filter(|byte| *byte == b'\n').count()
}

fn first_error(text: &str) -> Option<(Range<usize>, String)> {
    let error = toml::from_str::<CellFile>(text).err()?;
    let problem = error.message().replace('\n', " ");
    let problem = format!("{problem}{}", Suggestion::parse(&problem));
    Some((error.span().unwrap_or(text.len()..text.len()), problem))
}

/// Returns the text with an accepted value at the given span. `None` if no value is accepted.
fn with_accepted_value(text: &str, span: &Range<usize>, problem: &str) -> Option<String> {
    if problem.starts_with("unknown field") {
        return without_line(text, span.start);
    }
    let value = text.get(span.clone()).filter(|value| !value.contains('\n'))?;
    // The span of an unknown key, or of a section with a missing key, is not that of a value.
    format!("x = {value}").parse::<toml::Table>().ok()?;
    // The parser's message has the expected words in backticks.
    let named = problem.split('`').skip(1).step_by(2).map(|word| format!("\"{word}\""));
    let candidates = EXAMPLE_VALUES.into_iter().map(str::to_owned).chain(named);
    let mut taken = candidates.map(|candidate| {
        let changed = [&text[..span.start], &candidate, &text[span.end..]].concat();
        // The parser must report no further error at or within the inserted value.
        let inserted = span.start..span.start + candidate.len();
        let is_taken =
            first_error(&changed).is_none_or(|(next, _)| !inserted.contains(&next.start));
        is_taken.then_some(changed)
    });
    taken.find_map(|text| text)
}

/// Empties a line that contains a key with its complete value. The line break stays.
fn without_line(text: &str, byte: usize) -> Option<String> {
    let begin = text.get(..byte)?.rfind('\n').map_or(0, |at| at + 1);
    let end = text.get(byte..)?.find('\n').map_or(text.len(), |at| byte + at);
    if !text[begin..byte].trim().is_empty() {
        return None;
    }
    text[begin..end].parse::<toml::Table>().ok()?;
    Some([&text[..begin], &text[end..]].concat())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_key_of_the_wrong_type_is_listed_next_to_what_is_open() {
        let text = "name = \"arm\"\nrobot = \"?\"\n[data]\nrate_hz = \"fast\"\ntorque_valid = \
            \"?\"\nside = \"left\"\n\
            position.column = \"q{axis}\"\nposition.unit = 7\ntorque.column = \"?\"\ntorque.unit = \
            \"?\"\n\
            [identification]\nmethod = \"idim-ls\"\ndecimation_filter.factor = \
            \"ten\"\nposition_filter.cutoff_hz = \"auto\"\n";
        let listed: Vec<String> = wrong_keys(text).iter().map(ToString::to_string).collect();
        let expected = [
            ("line 4: data.rate_hz: ", "\"fast\""),
            ("line 6: data.side: ", "`left`"),
            ("line 8: data.position.unit: ", "one for all axes, or a list"),
            ("line 13: identification.decimation_filter.factor: ", "\"ten\""),
        ];
        assert_eq!(listed.len(), expected.len(), "{listed:?}");
        for (listed, (key, problem)) in listed.iter().zip(expected) {
            assert!(listed.starts_with(key) && listed.contains(problem), "{listed}");
        }
        // The search continues after an unknown key. A key within a value does not mislead it.
        let text = "name = \"arm\"\nconroller = \"x\"\nrobot = \"?\"\n[data]\nrate_hz = \
            \"?\"\ntorque_valid = \"?\"\nside = \"left\"\n\
            torque = { colum = \"x\", unit = \"Nm\" }\n[identification]\nmethod = 3\n";
        let listed: Vec<String> = wrong_keys(text).iter().map(ToString::to_string).collect();
        assert_eq!(listed.len(), 3, "{listed:?}");
        assert!(listed[0].contains("line 2") && listed[0].ends_with("did you mean `controller`?"));
        assert!(listed[1].starts_with("line 7: data.side") && listed[2].contains("`colum`"));
        // An open value alone is no type error.
        let open_text = "name = \"arm\"\nrobot = \"?\"\n[data]\nrate_hz = \"?\"\ntorque_valid = \
            \"?\"\nside = \"?\"\nbag.joints = \"?\"\n\
            bag.effort = { unit = \"?\", sign = \"?\" }\n[identification]\nmethod = \"?\"\n\
            position_filter.cutoff_hz = \"?\"\ndecimation_filter.factor = \"?\"\n";
        assert_eq!(wrong_keys(open_text), []);
    }
}
