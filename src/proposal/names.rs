//! Detection of the content of columns from their names.

use didim_formats::{AXIS_PLACEHOLDER, INDEX_PLACEHOLDER};

/// Content of a column.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ColumnMeaning {
    Position,
    Torque,
    Current,
    /// A commanded torque or current.
    Command,
    Reference,
    Time,
}

const TIME_WORDS: &[&str] = &["time", "t", "timestamp", "stamp", "zeit"];
const POSITION_WORDS: &[&str] = &["position", "pos", "q", "angle", "theta", "encoder", "enc"];
const TORQUE_WORDS: &[&str] = &["torque", "tau", "effort", "trq", "moment"];
const CURRENT_WORDS: &[&str] = &["current", "curr", "cur", "amp", "ampere"];
const COMMAND_WORDS: &[&str] = &[
    "reference",
    "ref",
    "target",
    "desired",
    "des",
    "d",
    "cmd",
    "command",
    "commanded",
    "goal",
    "setpoint",
    "demand",
    "soll",
];
/// Words that mark a column as a quantity that is not used.
const OTHER_WORDS: &[&str] = &[
    "velocity",
    "vel",
    "speed",
    "qd",
    "dq",
    "acceleration",
    "acc",
    "qdd",
    "ddq",
    "temperature",
    "temp",
    "external",
    "ext",
    "error",
    "err",
    "gravity",
    "feedforward",
    "ff",
    "friction",
    "limit",
    "status",
    "mode",
    "voltage",
    "secondary",
    "model",
    "residual",
    "estimated",
    "max",
    "min",
    "tcp",
    "cartesian",
    "offset",
];

/// Returns the words of a name in lower case, without its numbers.
pub(super) fn split_words(name: &str) -> Vec<String> {
    let mut words = vec![String::new()];
    let mut before = ' ';
    for c in name.chars() {
        let begins = c.is_uppercase() && before.is_lowercase();
        if !c.is_alphabetic() || begins {
            words.push(String::new());
        }
        if let (true, Some(word)) = (c.is_alphabetic(), words.last_mut()) {
            word.extend(c.to_lowercase());
        }
        before = c;
    }
    words.retain(|word| !word.is_empty());
    words
}

fn has_any_word(words: &[String], any: &[&str]) -> bool {
    words.iter().any(|word| any.contains(&word.as_str()))
}

/// Returns the content of a column. The name of a bus signal begins with the name of its message,
/// which shows if the signal is a command, but not its quantity.
pub(super) fn column_meaning(name: &str) -> Option<ColumnMeaning> {
    let all_words = split_words(name);
    let last_words = name.rsplit_once('.').map(|(_, own)| split_words(own));
    let words = last_words.filter(|own| !own.is_empty()).unwrap_or_else(|| all_words.clone());
    // The unit rad/s indicates a speed.
    if has_any_word(&words, OTHER_WORDS) || name.contains("/s") {
        return None;
    }
    let asked_for = has_any_word(&all_words, COMMAND_WORDS);
    if has_any_word(&words, TORQUE_WORDS) {
        Some(if asked_for { ColumnMeaning::Command } else { ColumnMeaning::Torque })
    } else if has_any_word(&words, CURRENT_WORDS) {
        (!asked_for).then_some(ColumnMeaning::Current)
    } else if has_any_word(&words, POSITION_WORDS) {
        Some(if asked_for { ColumnMeaning::Reference } else { ColumnMeaning::Position })
    } else {
        has_any_word(&words, TIME_WORDS).then_some(ColumnMeaning::Time)
    }
}

/// Last words of the two columns of a stamp: the whole seconds, and the remaining nanoseconds.
const STAMP_PARTS: [&[&str]; 2] =
    [&["sec", "secs", "seconds"], &["nanosec", "nsec", "nanosecs", "nsecs", "nanoseconds"]];

/// Finds pairs of columns that are the two parts of a stamp. Their names differ only in the last
/// word.
pub(super) fn stamp_pairs(columns: &[String]) -> Vec<[&String; 2]> {
    let stem = |name: &'_ String, part: usize| -> Option<String> {
        let digits_at = name.rfind(|c: char| !c.is_alphabetic()).map_or(0, |at| at + 1);
        let (stem, last) = name.split_at_checked(digits_at)?;
        STAMP_PARTS[part].contains(&last.to_lowercase().as_str()).then(|| stem.to_owned())
    };
    let mut pairs = Vec::new();
    for sec in columns {
        let stem_of_name = stem(sec, 0);
        let nanosec =
            columns.iter().find(|other| stem_of_name.is_some() && stem(other, 1) == stem_of_name);
        pairs.extend(nanosec.map(|nanosec| [sec, nanosec]));
    }
    pairs
}

/// Columns of one quantity, one for each axis.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum ColumnGroup {
    /// Name of the columns with a placeholder for the axis number.
    Numbered(String),
    /// Columns named after the joints.
    Named(Vec<String>),
}

impl ColumnGroup {
    pub(super) fn name(&self) -> &str {
        match self {
            Self::Numbered(pattern) => pattern,
            Self::Named(names) => names.first().map_or("", String::as_str),
        }
    }

    pub(super) fn names(&self) -> Vec<String> {
        match self {
            Self::Numbered(pattern) => vec![pattern.clone()],
            Self::Named(names) => names.clone(),
        }
    }
}

/// Finds columns whose names differ by a number. Returns their name with a placeholder for the
/// number, which begins at 0 or 1, and the number of consecutive columns.
fn number_patterns(columns: &[String]) -> Vec<(String, usize)> {
    let is = |name: String| columns.contains(&name);
    let mut patterns = Vec::new();
    for column in columns {
        for number in number_ranges(column) {
            let (begin, end) = (&column[..number.start], &column[number.end..]);
            let first = match &column[number] {
                "0" => 0,
                "1" if !is(format!("{begin}0{end}")) => 1,
                _ => continue,
            };
            let count = (first..).take_while(|axis| is(format!("{begin}{axis}{end}"))).count();
            patterns.push((
                format!("{begin}{}{end}", [INDEX_PLACEHOLDER, AXIS_PLACEHOLDER][first]),
                count,
            ));
        }
    }
    patterns
}

/// Returns all groups that have one column per axis.
pub(super) fn column_groups(
    columns: &[String],
    axes: usize,
    joints: &[String],
) -> Vec<ColumnGroup> {
    let is = |name: &String| columns.contains(name);
    let mut groups: Vec<ColumnGroup> = (number_patterns(columns).into_iter())
        .filter(|(_, count)| *count == axes)
        .map(|(pattern, _)| ColumnGroup::Numbered(pattern))
        .collect();
    let Some(first) = joints.first() else { return groups };
    for column in columns {
        let Some((begin, end)) = column.split_once(first.as_str()) else { continue };
        let names: Vec<String> =
            joints.iter().map(|joint| format!("{begin}{joint}{end}")).collect();
        // Joints with numbered names are found by their numbers.
        let numbered = groups.iter().any(|other| match other {
            ColumnGroup::Numbered(pattern) => [(AXIS_PLACEHOLDER, 1), (INDEX_PLACEHOLDER, 0)]
                .iter()
                .any(|(mark, first)| pattern.replace(mark, &first.to_string()) == names[0]),
            ColumnGroup::Named(_) => false,
        });
        if !numbered && names.iter().all(is) {
            groups.push(ColumnGroup::Named(names));
        }
    }
    groups
}

/// Returns the positions of the numbers in a name.
fn number_ranges(name: &str) -> Vec<core::ops::Range<usize>> {
    let mut runs: Vec<core::ops::Range<usize>> = Vec::new();
    for (at, c) in name.char_indices().filter(|(_, c)| c.is_ascii_digit()) {
        match runs.last_mut() {
            Some(last) if last.end == at => last.end = at + c.len_utf8(),
            _ => runs.push(at..at + c.len_utf8()),
        }
    }
    runs
}

/// Returns the unit in a name: in brackets, or as its last word. An unknown word in brackets also
/// counts as a unit.
pub(super) fn unit<'a>(name: &str, units: &[(&str, &'a str)]) -> Option<Result<&'a str, String>> {
    let bracketed = name.split_once(['[', '(']).and_then(|(_, rest)| {
        let (unit, _) = rest.split_once([']', ')'])?;
        let unit = unit.trim();
        (!unit.is_empty() && !unit.chars().any(|c| c.is_ascii_digit())).then_some(unit)
    });
    let unit_of = |configured: &str| {
        let lowercase = configured.to_lowercase().replace(['.', '·', '*', ' '], "");
        units.iter().find(|(word, _)| *word == lowercase).map(|(_, unit)| *unit)
    };
    if let Some(configured_value) = bracketed {
        return Some(unit_of(configured_value).ok_or_else(|| configured_value.to_owned()));
    }
    let plain_name = name.replace(AXIS_PLACEHOLDER, "").replace(INDEX_PLACEHOLDER, "");
    let mut words =
        plain_name.split(|c: char| !c.is_alphabetic() && c != '°').filter(|word| !word.is_empty());
    let last = words.next_back()?;
    let is_other = OTHER_UNITS.contains(&last.to_lowercase().as_str());
    unit_of(last).map(Ok).or_else(|| is_other.then(|| Err(last.to_owned())))
}

/// Units that are not supported and may be the last word of a name.
const OTHER_UNITS: &[&str] = &[
    "ma", "knm", "ncm", "percent", "permille", "pct", "counts", "ticks", "inc", "min", "grad",
    "rpm",
];

/// Lists the quantities whose number of columns differs from the number of axes, each with its
/// number of columns.
pub(super) fn counted_otherwise(columns: &[String], axes: usize) -> Vec<String> {
    let patterns = number_patterns(columns).into_iter();
    let otherwise = patterns.filter(|(pattern, count)| {
        *count > 1 && *count != axes && column_meaning(pattern).is_some()
    });
    otherwise.map(|(pattern, count)| format!("`{pattern}` {count} times")).collect()
}
